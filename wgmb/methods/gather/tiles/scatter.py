"""Starts of searches where the candidate motions of a tile are not all that come."""

from __future__ import annotations

import math

import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import ScratchBuffer
from ...contract import Inputs, PreparedFrame, View
from .active_tiles import grid_of

_MOST = 3  # frames that are scattered: the frame itself and its neighbours


class Scatter:
    """Pixels of the frame, and of its neighbours those that it hides, scattered to the blocks where
    they are at slices of the exposure."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device = device
        self._scattered, self._tiles = ScratchBuffer(device), ScratchBuffer(device)

    def tiles(self, encoder: wgpu.GPUCommandEncoder, size: tuple[int, int]) -> gpu.BufferPart:
        """The worklist of the tiles of one frame from which to scatter, recorded to be empty."""
        source = wgsl.load("methods/gather/worklist.wgsl")
        words = math.prod(grid_of(size)) + source.integer("CELLS_WORD")
        tiles = {"buffer": self._tiles.at_least(8 * words), "offset": 0, "size": 8 * words}
        encoder.clear_buffer(tiles["buffer"], 0, 8 * words)
        return tiles

    def scattered(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs) -> gpu.BufferPart:
        """The buffer of all that is scattered, see scattered.wgsl; recorded to be empty."""
        source = wgsl.load("methods/gather/tiles/scattered.wgsl")
        tile, block, most = map(source.integer, ("TILE", "BLOCK", "SLICES"))
        blocks = math.prod(grid_of(inputs.bindings.size)) * (tile // block) ** 2
        slice_size = 4 * blocks * len(_near(inputs))
        limit = self._device.limits["max-storage-buffer-binding-size"]
        size = slice_size * max(min(most, inputs.samples, limit // slice_size), 1)
        count = len(_near(inputs))
        room = size if count == 1 else min(_MOST * size // count, limit)  # for all, as in layers.py
        scattered = {"buffer": self._scattered.at_least(room), "offset": 0, "size": size}
        encoder.clear_buffer(scattered["buffer"], 0, size)
        return scattered

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        index: int,
        surfaces: tuple[View, View],
        candidates: View,
        tiles: gpu.BufferPart,
        scattered: gpu.BufferPart,
    ) -> None:
        """Record the scatter of frame `index` of the inputs from `tiles`, if it is no farther than
        a neighbour; `surfaces`: the front surfaces of the frame itself, and of that frame."""
        if index >= len(_near(inputs)):
            return
        kernel = gpu.kernel(self._device, "methods/gather/tiles/scatter.wgsl")
        own, front = surfaces
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            tiles,
            source={
                "offset": inputs.frames[index].offset,
                "index": index,
                "count": len(_near(inputs)),
            },
            front_surface=front,
            own_surface=own,
            tile_candidates=candidates,
            worklist=tiles,
            scattered=scattered,
        )


def _near(inputs: Inputs) -> list[PreparedFrame]:
    """The frame and its neighbours, which come first."""
    return [frame for frame in inputs.frames if abs(frame.offset) <= 1]
