"""The pixels that may show two surfaces, and the tiles that show too many to separate."""

from __future__ import annotations

import math

import wgpu

from .... import gpu
from ....gpu.textures import ScratchBuffer, TexturePool
from ...contract import Inputs, PreparedFrame, View
from ..tiles.active_tiles import grid_of


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
