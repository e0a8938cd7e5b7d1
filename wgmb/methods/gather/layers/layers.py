"""Every frame as two layers, foreground and background, parted at silhouettes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import wgpu

from .... import gpu
from ....gpu.textures import ScratchBuffer, TexturePool
from ...contract import Inputs, PreparedFrame, View
from ..tiles.active_tiles import grid_of


class Layers:
    """The layers of up to `most` frames, each in a slot: its index among the inputs.

    `textures`: "layer_colors" and "surfaces" have two layers per slot, "mattes" has one. They have
    a slot for all `most` frames once one has a neighbour, as a texture that grows leaves its memory
    unused.
    """

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool, most: int):
        self._device, self._images = device, images
        self._edges, self._edge_pixels = Edges(device, images), ScratchBuffer(device)
        self._edge_groups = ScratchBuffer(device)
        self._relight = Relight(device)
        self._most, self._slots = most, 1
        self.textures: dict[str, wgpu.GPUTexture] = {}

    def front_surface(self, slot: int) -> wgpu.GPUTextureView:
        """The foreground's surfaces of the frame in a slot."""
        return self._images.layer(self.textures["surfaces"], 2 * slot)

    def _front_colors(self, slot: int) -> wgpu.GPUTextureView:
        """The foreground's colours of the frame in a slot."""
        return self._images.layer(self.textures["layer_colors"], 2 * slot)

    def _views(self, slot: int) -> dict[str, wgpu.GPUTextureView]:
        """The layers in a slot, by the names of their bindings."""

        def both(texture: wgpu.GPUTexture) -> wgpu.GPUTextureView:
            return self._images.view_of(
                texture, dimension="2d-array", base_array_layer=2 * slot, array_layer_count=2
            )

        return {
            "colors": both(self.textures["layer_colors"]),
            "surfaces": both(self.textures["surfaces"]),
            "mattes": self._images.layer(self.textures["mattes"], slot),
        }

    def _far(self, inputs: Inputs, offset: int) -> dict[str, View | None]:
        """Inputs of a frame's layers from frames beyond the neighbours: all of them for the frame
        itself, nothing for the others."""
        near = sum(abs(frame.offset) <= 1 for frame in inputs.frames)
        far = 0 if offset else len(inputs.frames) - near
        per_frame = {"layer_colors": 2, "surfaces": 2, "mattes": 1}
        if not far:
            return dict.fromkeys(f"far_{name}" for name in per_frame)
        return {
            f"far_{name}": self._images.view_of(
                self.textures[name],
                dimension="2d-array",
                base_array_layer=layers * near,
                array_layer_count=layers * far,
            )
            for name, layers in per_frame.items()
        }

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        worklists: Mapping[str, gpu.BufferPart],
    ) -> None:
        """Record the layers of all frames, where something moves near."""
        size = inputs.bindings.size
        count = self._slots = self._most if len(inputs.frames) > 1 else self._slots
        color = inputs.frame.color.texture.format
        if color not in ("rgba16float", "rgba32float"):
            color = gpu.texel(self._device, 4)
        matte = "r32uint" if inputs.frame.weight is None else "rg32uint"
        self.textures = {
            "layer_colors": self._images.texture("layer colors", size, color, 2 * count),
            "surfaces": self._images.texture("surfaces", size, "rgba32uint", 2 * count),
            "mattes": self._images.texture("mattes", size, matte, count),
        }
        by_offset = {frame.offset: frame for frame in inputs.frames}
        for slot, frame in reversed(list(enumerate(inputs.frames))):  # the farthest ones first
            around = {
                "prev": by_offset.get(frame.offset - 1),
                "next": by_offset.get(frame.offset + 1),
            }
            self._separate(encoder, inputs, slot, frame, around, worklists)

    def _separate(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        slot: int,
        frame: PreparedFrame,
        neighbours: Mapping[str, PreparedFrame | None],
        worklists: Mapping[str, gpu.BufferPart],
    ) -> None:
        """Record the layers of a frame, of which `neighbours` may show what it does not."""
        size, colors = inputs.bindings.size, self.textures["layer_colors"]
        # Away from silhouettes the foreground is the frame itself; nothing is behind it.
        if copied := _is_like(frame.color.texture, colors):
            _copy(encoder, (frame.color.texture, 0), (colors, 2 * slot))
        cells = worklists["separated"]
        edges = self._edges.encode(encoder, inputs, frame, worklists["flagged"])
        bound = self._bound(inputs, slot, frame, neighbours)
        kernel = gpu.kernel(
            self._device,
            "methods/gather/layers/layers.wgsl",
            {"Color": colors.format, "Mattes": self.textures["mattes"].format} | bound,
            WEIGHTED=frame.weight is not None,
            COPIED=copied,
        )
        pixels = self._edge_pixels.at_least(4 + 4 * size[0] * size[1])
        encoder.clear_buffer(pixels, 0, 4)
        groups = {"buffer": self._edge_groups.at_least(16), "offset": 0, "size": 16}
        # One layer everywhere, and a list of the pixels at silhouettes; only these get two layers.
        passes: dict[str, tuple[tuple[int, int] | gpu.BufferPart, gpu.BufferPart]] = {
            "copy_motion_only": (worklists["motion_only"], worklists["motion_only"]),
            "write_single_layer": (cells, cells),
            "size_dispatch": ((1, 1), cells),
            "separate_layers": (groups, cells),
        }
        for entry, (over, worklist) in passes.items():
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                over,
                worklist=worklist,
                edges=pixels,
                edge_groups=groups if entry == "size_dispatch" else None,
                **bound,
                **edges,
            )
            if entry == "write_single_layer":
                surfaces = self.textures["surfaces"]
                _copy(encoder, (surfaces, 2 * slot), (surfaces, 2 * slot + 1))
            if entry == "write_single_layer" and not frame.offset:
                self._relit(encoder, inputs, cells)

    def _bound(
        self,
        inputs: Inputs,
        slot: int,
        frame: PreparedFrame,
        neighbours: Mapping[str, PreparedFrame | None],
    ) -> dict[str, Any]:
        """Bindings that all passes over the layers of a frame share."""
        offsets = {other.offset for other in inputs.frames}
        around = {
            "has_prev": neighbours["prev"] is not None,
            "has_next": neighbours["next"] is not None,
            "own_is_prev": frame.offset == 1,
            "own_is_next": frame.offset == -1,
            "relit": not frame.offset,
            "has_far_prev": not frame.offset and -2 in offsets,
            "has_far_next": not frame.offset and 2 in offsets,
        }
        others = {
            f"{side}_{name}": getattr(other or frame, name)
            for side, other in neighbours.items()
            for name in ("color", "motion", "depth", "weight")
        }
        own = {name: getattr(frame, name) for name in ("color", "motion", "depth", "weight")}
        gains = {
            f"{side}_gains": self._relight.gains(inputs.bindings.size, step)
            for side, step in (("prev", -1), ("next", 1))
        }
        layers = self._views(slot) | self._far(inputs, frame.offset)
        return {"neighbours": around, **own, **others, **layers, **gains}

    def _relit(
        self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, cells: gpu.BufferPart
    ) -> None:
        """Record that the neighbours get the light of the frame on surfaces that it hides."""
        for slot, frame in enumerate(inputs.frames):
            if abs(frame.offset) == 1:
                surfaces = self.front_surface(0), self.front_surface(slot)
                relit = self._front_colors(slot)
                self._relight.encode(encoder, inputs, frame, surfaces, relit, cells)


def _is_like(image: wgpu.GPUTexture, layers: wgpu.GPUTexture) -> bool:
    """Return True if all of `image` can be copied into a layer: then no shader need store it."""
    readable = bool(image.usage & wgpu.TextureUsage.COPY_SRC)
    single = image.mip_level_count == image.size[2] == image.sample_count == 1
    same = image.format == layers.format and image.size[:2] == layers.size[:2]
    return readable and single and same


def _copy(
    encoder: wgpu.GPUCommandEncoder,
    source: tuple[wgpu.GPUTexture, int],
    target: tuple[wgpu.GPUTexture, int],
) -> None:
    """Record a copy of one layer of a texture into one of another, or of the same."""
    texture, layer = source
    into, number = target
    encoder.copy_texture_to_texture(
        {"texture": texture, "origin": (0, 0, layer)},
        {"texture": into, "origin": (0, 0, number)},
        (*texture.size[:2], 1),
    )


# ---- the pixels that may show two surfaces, and the tiles that show too many to separate ------


class Edges:
    """The edges of one frame after the other: each overwrites those before it."""

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool):
        self._device, self._images = device, images
        self._crowds = ScratchBuffer(device)

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        frame: PreparedFrame,
        worklist: gpu.BufferPart,
    ) -> dict[str, View | wgpu.GPUBuffer]:
        """Record the search for a frame's edges, and return them by the names of their bindings:
        "edge_flags" per pixel and "crowds" per tile."""
        size = inputs.bindings.size
        flags = self._images.view("edge flags", size, "r32uint")
        read = {"motion": frame.motion, "depth": frame.depth}
        kernel = gpu.kernel(self._device, "methods/gather/layers/edges.wgsl", read)
        kinds = kernel.source.integer("KINDS")
        crowds = self._crowds.at_least(4 * kinds * math.prod(grid_of(size)))
        encoder.clear_buffer(crowds)
        own = {"worklist": worklist, "edge_flags_out": flags, "crowds": crowds, **read}
        kernel.run(encoder, "detect_edges", inputs.bindings, worklist, **own)
        kernel.run(encoder, "look_around_tiles", inputs.bindings, grid_of(size), **own)
        return {"edge_flags": flags, "crowds": crowds}


# ---- relights pixels borrowed from a neighbouring frame, where the frame hides the surface ----


class Relight:
    """Corrects the front layer of a neighbour by the ratio of light beside the hidden surface."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device = device
        self._hidden, self._groups = ScratchBuffer(device), ScratchBuffer(device)
        self._changes = ScratchBuffer(device)
        self._gains = {-1: ScratchBuffer(device), 1: ScratchBuffer(device)}

    def gains(self, size: tuple[int, int], offset: int) -> wgpu.GPUBuffer:
        """The gain of every pixel of a neighbour, as `encode` finds it."""
        return self._gains[offset].at_least(4 * size[0] * size[1])

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        frame: PreparedFrame,
        surfaces: tuple[View, View],
        relit: View,
        cells: gpu.BufferPart,
    ) -> None:
        """Record it for the neighbour `frame`, in the worklist `cells`.

        `surfaces`: the front surfaces of the frame itself, whose edges need not be separated yet,
        and of the neighbour. `relit`: the neighbour's front layer, which has its colours.
        """
        own = inputs.frame
        kernel = gpu.kernel(
            self._device,
            "methods/gather/layers/relight.wgsl",
            {"Color": relit.texture.format, "color": frame.color, "own_texels": own.color},
            WEIGHTED=frame.weight is not None,
        )
        own_surface, front_surface = surfaces
        size = inputs.bindings.size
        side = kernel.source.integer("SQUARE")
        squares = math.ceil(size[0] / side) * math.ceil(size[1] / side)
        hidden = self._hidden.at_least(4 + 8 * squares)
        changes = self._changes.at_least(8 * math.prod(grid_of(size)))
        encoder.clear_buffer(hidden)
        encoder.clear_buffer(changes)
        encoder.clear_buffer(gains := self.gains(size, int(frame.offset)))
        groups = {"buffer": self._groups.at_least(16), "offset": 0, "size": 16}
        # Only pixels that the frame hides are relit, and only near tiles in which light changes:
        # the first pass lists them, the last one scales their light by the ratio seen beside them.
        passes: tuple[tuple[str, tuple[int, int] | gpu.BufferPart], ...] = (
            ("find_hidden", cells),
            ("spread_changes", grid_of(size)),
            ("size_dispatch", (1, 1)),
            ("relight", groups),
        )
        for entry, over in passes:
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                over,
                source={"offset": frame.offset},
                color=frame.color,
                weight=frame.weight,
                front_surface=front_surface,
                own_color=own.color,
                own_texels=own.color,
                own_weight=own.weight,
                own_surface=own_surface,
                worklist=cells,
                hidden=hidden,
                groups=groups if entry == "size_dispatch" else None,
                changes=changes,
                gains=gains,
                relit=relit,
                linear=inputs.linear,
            )
