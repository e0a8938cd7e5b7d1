"""Every frame as two layers, foreground and background, parted at silhouettes."""

from __future__ import annotations

from dataclasses import replace

import wgpu

from ... import gpu
from ...gpu.textures import ScratchBuffer, TexturePool
from .active_tiles import ActiveTiles


def layer_view(texture: wgpu.GPUTexture, index: int) -> wgpu.GPUTextureView:
    """One layer of an array texture, as a texture of its own."""
    return texture.create_view(dimension="2d", base_array_layer=index, array_layer_count=1)


class Layers:
    """The layers of up to three frames, each in a slot; frames with a `key` stay there.

    `textures`: "layer_colors" and "surfaces" have two layers per slot, "mattes" has one.
    """

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool, tiles: ActiveTiles):
        self._device, self._images, self._tiles = device, images, tiles
        self._edges, self._edge_groups, self._spare = (ScratchBuffer(device) for _ in range(3))
        self._made: dict[int, tuple] = {}  # what the layers in a slot were made of
        self.textures: dict[str, wgpu.GPUTexture] = {}

    def slots(self, size: tuple[int, int], frames) -> list[int]:
        """Return the slots of the frames' layers; layers that are already present stay."""
        textures = self._textures(size, len(frames))
        if textures["layer_colors"] is not self.textures.get("layer_colors"):
            self._made = {}
        self.textures = textures
        made = {contents: slot for slot, contents in self._made.items()}
        slots = [made.get(_contents(frame)) for frame in frames]
        free = (slot for slot in range(textures["layer_colors"].size[2] // 2) if slot not in slots)
        return [next(free) if slot is None else slot for slot in slots]

    def front_surface(self, slot: int) -> wgpu.GPUTextureView:
        """The foreground's surfaces of the frame in a slot."""
        return layer_view(self.textures["surfaces"], 2 * slot)

    def _views(self, slot: int) -> dict[str, wgpu.GPUTextureView]:
        """The layers in a slot, by the names of their bindings."""

        def both(texture: wgpu.GPUTexture) -> wgpu.GPUTextureView:
            return texture.create_view(
                dimension="2d-array", base_array_layer=2 * slot, array_layer_count=2
            )

        return {
            "colors": both(self.textures["layer_colors"]),
            "surfaces": both(self.textures["surfaces"]),
            "matte": layer_view(self.textures["mattes"], slot),
        }

    def encode(self, encoder, inputs, frame, slot: int, worklists: dict[str, dict]) -> None:
        """Record the layers of a frame, unless its slot has them already."""
        if self._made.get(slot) != _contents(frame):
            self._separate(encoder, inputs, frame, self._views(slot), worklists)
            self._made.pop(slot, None)
        if frame.key is not None:
            self._made[slot] = _contents(frame)

    def _textures(self, size, count: int) -> dict[str, wgpu.GPUTexture]:
        """The textures of all layers: front and back per frame, and one matte per frame."""
        colors = self.textures.get("layer_colors")
        if colors is not None and colors.size[:2] == size:
            count = max(count, colors.size[2] // 2)
        color = gpu.texel(self._device, 4)
        return {
            "layer_colors": self._images.texture("layer colors", size, color, 2 * count),
            "surfaces": self._images.texture("surfaces", size, "rgba32uint", 2 * count),
            "mattes": self._images.texture("mattes", size, "rgba32float", count),
        }

    def _separate(self, encoder, inputs, frame, views, worklists):
        """Record the layers of a frame: where something moves near, or all if they are kept."""
        size = inputs.bindings.size
        groups = {"buffer": self._edge_groups.at_least(16), "offset": 0, "size": 16}
        if frame.key is None:
            cells = {
                "copy_motion_only": worklists["motion_only"],
                "detect_edges": worklists["flagged"],
                "write_single_layer": worklists["separated"],
            }
        else:
            cells = dict.fromkeys(
                ("detect_edges", "write_single_layer"), self._tiles.everywhere(size)
            )
        passes: dict[str, tuple[dict | None, dict]] = {k: (c, c) for k, c in cells.items()}
        edge_cells = cells["write_single_layer"]
        passes |= {"size_dispatch": (None, edge_cells), "separate_layers": (groups, edge_cells)}
        kernel = gpu.kernel(
            self._device,
            "methods/gather/layers.wgsl",
            {"Color": gpu.texel(self._device, 4)},
            WEIGHTED=frame.weight is not None,
        )
        flags = self._images.view("edge flags", size, "r32uint")
        unbound = self._images.view("no edge flags", size, "r32uint")
        edges = self._edges.at_least(4 + 4 * size[0] * size[1])
        encoder.clear_buffer(edges, 0, 4)
        for entry, (indirect, worklist) in passes.items():
            detecting = entry == "detect_edges"
            kernel.run(
                encoder,
                entry,
                inputs.bindings if indirect else replace(inputs.bindings, size=(1, 1)),
                indirect,
                worklist=worklist,
                color=frame.color,
                motion=frame.motion,
                depth=frame.depth,
                weight=frame.weight or inputs.unbound,
                edge_flags=unbound if detecting else flags,
                edge_flags_out=flags if detecting else unbound,
                edges=edges,
                edge_groups=groups if entry == "size_dispatch" else self._spare.at_least(16),
                **views,
            )


def _contents(frame) -> tuple[object, bool]:
    """The cache key of a frame's layers: its pixels, with weights or without."""
    return frame.key, frame.weight is not None
