"""Every frame as two layers, foreground and background, parted at silhouettes."""

from __future__ import annotations

from dataclasses import replace

import wgpu

from ... import gpu
from ...gpu.textures import ScratchBuffer, TexturePool


def layer_view(images: TexturePool, texture: wgpu.GPUTexture, index: int) -> wgpu.GPUTextureView:
    """One layer of an array texture of the pool, as a texture of its own."""
    return images.view_of(texture, dimension="2d", base_array_layer=index, array_layer_count=1)


class Layers:
    """The layers of up to three frames, each in a slot: its index among the inputs.

    `textures`: "layer_colors" and "surfaces" have two layers per slot, "mattes" has one.
    """

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool):
        self._device, self._images = device, images
        self._edges, self._edge_groups, self._spare = (ScratchBuffer(device) for _ in range(3))
        self.textures: dict[str, wgpu.GPUTexture] = {}

    def front_surface(self, slot: int) -> wgpu.GPUTextureView:
        """The foreground's surfaces of the frame in a slot."""
        return layer_view(self._images, self.textures["surfaces"], 2 * slot)

    def _views(self, slot: int) -> dict[str, wgpu.GPUTextureView]:
        """The layers in a slot, by the names of their bindings."""

        def both(texture: wgpu.GPUTexture) -> wgpu.GPUTextureView:
            return self._images.view_of(
                texture, dimension="2d-array", base_array_layer=2 * slot, array_layer_count=2
            )

        return {
            "colors": both(self.textures["layer_colors"]),
            "surfaces": both(self.textures["surfaces"]),
            "matte": layer_view(self._images, self.textures["mattes"], slot),
        }

    def encode(self, encoder, inputs, worklists: dict[str, dict]) -> None:
        """Record the layers of all frames, where something moves near."""
        size, count = inputs.bindings.size, len(inputs.frames)
        color = gpu.texel(self._device, 4)
        self.textures = {
            "layer_colors": self._images.texture("layer colors", size, color, 2 * count),
            "surfaces": self._images.texture("surfaces", size, "rgba32uint", 2 * count),
            "mattes": self._images.texture("mattes", size, "rgba32float", count),
        }
        by_offset = {frame.offset: frame for frame in inputs.frames}
        for slot, frame in enumerate(inputs.frames):
            around = {
                "prev": by_offset.get(frame.offset - 1),
                "next": by_offset.get(frame.offset + 1),
            }
            self._separate(encoder, inputs, frame, around, self._views(slot), worklists)

    def _separate(self, encoder, inputs, frame, around, views, worklists):
        """Record the layers of a frame, `around` which others may show what it does not."""
        size = inputs.bindings.size
        groups = {"buffer": self._edge_groups.at_least(16), "offset": 0, "size": 16}
        cells = {
            "copy_motion_only": worklists["motion_only"],
            "detect_edges": worklists["flagged"],
            "write_single_layer": worklists["separated"],
        }
        passes: dict[str, tuple[dict | None, dict]] = {k: (c, c) for k, c in cells.items()}
        edge_cells = cells["write_single_layer"]
        passes |= {"size_dispatch": (None, edge_cells), "separate_layers": (groups, edge_cells)}
        kernel = gpu.kernel(
            self._device,
            "methods/gather/layers.wgsl",
            {"Color": gpu.texel(self._device, 4)},
            WEIGHTED=frame.weight is not None,
            HAS_PREV=around["prev"] is not None,
            HAS_NEXT=around["next"] is not None,
        )
        flags = self._images.view("edge flags", size, "r32uint")
        unbound = self._images.view("no edge flags", size, "r32uint")
        edges = self._edges.at_least(4 + 4 * size[0] * size[1])
        encoder.clear_buffer(edges, 0, 4)
        others = {
            f"{side}_{name}": getattr(other, name, None) or inputs.unbound
            for side, other in around.items()
            for name in ("color", "motion", "depth", "weight")
        }
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
                **others,
            )
