"""The levels of a picture's pyramid, and the passes over them.

A picture and its neighbours have a layer each.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import wgpu

from ... import gpu
from ...gpu import wgsl
from ...gpu.textures import TexturePool
from ..dis.blocks import HALF, SMALL

FOLDER = "flow/dense"
COARSEST = 40  # px along the longer side of the coarsest level
KEPT = 3  # pictures: one and its neighbours
STATE = "rgba32float"


def sizes_of(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Width, height of every level: the picture's own, then sides of 40 px times 2, 4, ...."""
    longest = max(size)
    halvings = max(0, math.ceil(math.log2(longest / COARSEST)))
    sides = [COARSEST << k for k in reversed(range(halvings))]
    width, height = size
    return [size, *((_at(width, s, longest), _at(height, s, longest)) for s in sides)]


def _at(n: int, side: int, longest: int) -> int:
    """A side of `n` px in a picture whose `longest` side becomes `side`."""
    return max(1, round(n * side / longest))


class Levels:
    """Textures and buffers for pictures of one size, and passes over them.

    `sizes`: of every level; `small` and `middle` are the numbers of the level of blocks and of that
    on which motions are compared. `summary`, `arrivals`: see the shaders of these names.
    """

    def __init__(self, device: wgpu.GPUDevice, size: tuple[int, int]):
        self.device, self.size, self.sizes = device, size, sizes_of(size)
        self.images, self.frame = TexturePool(device), gpu.SizeBindings(device)
        self.small, self.middle = (
            next(k for k, s in enumerate(self.sizes) if max(s) <= longest or s == self.sizes[-1])
            for longest in (SMALL, HALF)
        )
        self._turns: dict[tuple[int, int, int], wgpu.GPUBuffer] = {}
        held = wgsl.load(f"{FOLDER}/unfit.wgsl").dtype("Summary").itemsize
        self.summary = self.buffer("Summary", held)
        self.arrivals = self.buffer("arrivals", 4 * math.prod(self.sizes[self.middle]))

    def run(
        self,
        encoder: gpu.Tape,
        file: str,
        entry: str,
        size: tuple[int, int],
        groups: tuple[int, int] | None = None,
        /,
        **bound: Any,
    ) -> None:
        """Record a pass over a picture of `size`, of so many `groups` if not one for each pixel."""
        kernel, frame = gpu.kernel(self.device, f"{FOLDER}/{file}.wgsl"), self.frame(size)
        if groups:
            many = (n * edge for n, edge in zip(groups, kernel.workgroup, strict=True))
            frame = replace(frame, size=tuple(many))
        kernel.run(encoder, entry, frame, **bound)

    def turn(self, number: int, has_prev: bool, has_next: bool) -> wgpu.GPUBuffer:
        """The layers of a picture and its neighbours, of which the pyramid's levels have three."""
        here, before, after = (n % KEPT for n in (number, number - 1, number + 1))
        key = here, before if has_prev else here, after if has_next else here
        if key not in self._turns:
            layers = dict(zip(("here", "prev", "next"), key, strict=True))
            there = float(has_prev), float(has_next)
            made = gpu.uniform(self.device, f"{FOLDER}/turn.wgsl", "Turn", there=there, **layers)
            self._turns[key] = made
        return self._turns[key]

    def level(self, level: int) -> wgpu.GPUTextureView:
        """The pictures of a level of the pyramid, a layer each."""
        return self.array(f"level {level}", self.sizes[level])

    def array(self, name: str, size: tuple[int, int]) -> wgpu.GPUTextureView:
        """A texture of a layer for each picture that is kept."""
        texture = self.images.texture(name, size, "r32float", KEPT)
        return self.images.view_of(texture, dimension="2d-array")

    def buffer(self, name: str, size: int) -> wgpu.GPUBuffer:
        """A storage buffer of `size` bytes."""
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.INDIRECT
        return self.device.create_buffer(label=name, size=size, usage=usage)
