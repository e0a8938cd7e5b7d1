"""Starts of searches where the candidate motions of a tile are not all that come."""

from __future__ import annotations

import math

import wgpu

from ... import gpu
from ...gpu import wgsl
from ...gpu.textures import ScratchBuffer
from .active_tiles import grid_of


class Scatter:
    """The frame's own pixels, scattered to the blocks where they are at slices of the exposure."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device = device
        self._scattered, self._tiles = ScratchBuffer(device), ScratchBuffer(device)

    def tiles(self, encoder, size: tuple[int, int]) -> dict:
        """The worklist of the tiles from which to scatter, recorded to be empty."""
        source = wgsl.load("methods/gather/worklist.wgsl")
        words = math.prod(grid_of(size)) + int(source.constant("CELLS_WORD"))
        tiles = {"buffer": self._tiles.at_least(8 * words), "offset": 0, "size": 8 * words}
        encoder.clear_buffer(tiles["buffer"], 0, 8 * words)
        return tiles

    def encode(self, encoder, inputs, front_surface, candidates, tiles) -> dict:
        """Record the scatter from `tiles`; what is scattered, see scattered.wgsl."""
        kernel = gpu.kernel(self._device, "methods/gather/scatter.wgsl")
        tile, block, most = (int(kernel.source.constant(n)) for n in ("TILE", "BLOCK", "SLICES"))
        slice_size = 4 * math.prod(grid_of(inputs.bindings.size)) * (tile // block) ** 2
        limit = self._device.limits["max-storage-buffer-binding-size"]
        size = slice_size * max(min(most, inputs.samples, limit // slice_size), 1)
        scattered = {"buffer": self._scattered.at_least(size), "offset": 0, "size": size}
        encoder.clear_buffer(scattered["buffer"], 0, size)
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            tiles,
            front_surface=front_surface,
            tile_candidates=candidates,
            worklist=tiles,
            scattered=scattered,
        )
        return scattered
