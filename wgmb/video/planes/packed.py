"""The planes of a picture as bytes on the GPU, and their way down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import wgpu

from ... import gpu
from ...color.coding import CodedPicture, Coding
from ...gpu.textures import ScratchBuffer


@dataclass(frozen=True)
class PlaneSlot:
    """Position of a plane in the buffer."""

    component: int
    """Of the samples: 0 to 3."""
    step: tuple[int, int]
    """Columns and rows of pixels to one sample."""
    size: tuple[int, int]
    """Width and height [samples]."""
    words: int
    """Of a row; a word is 32 bits."""
    first: int
    """Word."""


class Packed:
    """One buffer for all planes of a picture, row by row, several samples to a word."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._buffer = device, ScratchBuffer(device)
        self._staging: wgpu.GPUBuffer | None = None

    def buffer(self, places: list[PlaneSlot]) -> wgpu.GPUBuffer:
        """The buffer for these planes; its contents are undefined."""
        return self._buffer.at_least(4 * _words(places))

    def read(
        self, encoder: wgpu.GPUCommandEncoder, places: list[PlaneSlot], coding: Coding
    ) -> CodedPicture:
        """Submit the passes that write the buffer, and return the planes."""
        size, usage = 4 * _words(places), wgpu.BufferUsage
        if self._staging is None or self._staging.size != size:
            self._staging = self._device.create_buffer(
                label="planes", size=size, usage=usage.COPY_DST | usage.MAP_READ
            )
        encoder.copy_buffer_to_buffer(self.buffer(places), 0, self._staging, 0, size)
        gpu.submit(self._device, encoder)
        self._staging.map_sync(wgpu.MapMode.READ)
        try:
            everything = np.array(self._staging.read_mapped(copy=False), copy=True).view(np.uint8)
        finally:
            self._staging.unmap()
        kind = np.dtype("<u2" if coding.bits > 8 else "u1")
        planes = []
        for place in places:
            width, height = place.size
            rows = everything[4 * place.first :][: 4 * place.words * height]
            rows = rows.view(kind).reshape(height, -1)
            planes.append(np.ascontiguousarray(rows[:, :width]))
        return CodedPicture(tuple(planes), coding)


def _words(places: list[PlaneSlot]) -> int:
    return places[-1].first + places[-1].words * places[-1].size[1]


def places_of(size: tuple[int, int], coding: Coding) -> list[PlaneSlot]:
    """Positions of the planes of a picture of `size` (width, height), in their order."""
    per, found, first = (2 if coding.bits > 8 else 4), [], 0
    for component, step in _components(coding):
        width, height = (-(-n // s) for n, s in zip(size, step, strict=True))
        place = PlaneSlot(component, step, (width, height), -(-width // per), first)
        found.append(place)
        first += place.words * height
    return found


def _components(coding: Coding) -> list[tuple[int, tuple[int, int]]]:
    """Of every plane the component of the samples, and the pixels to one of its samples."""
    colors = {"grey": [(0, (1, 1))], "rgb": [(i, (1, 1)) for i in range(3)]}
    chroma = [(1, coding.steps), (2, coding.steps)]
    planes = colors.get(coding.model, [(0, (1, 1)), *chroma])
    return [*planes, (3, (1, 1))] if coding.alpha else planes
