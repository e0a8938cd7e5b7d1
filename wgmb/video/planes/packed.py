"""The planes of a picture as bytes on the GPU, and their way down."""

from __future__ import annotations

from collections.abc import Callable
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
        self._free: list[wgpu.GPUBuffer] = []  # to be mapped; others hold pictures on their way

    def buffer(self, places: list[PlaneSlot]) -> wgpu.GPUBuffer:
        """The buffer for these planes; its contents are undefined."""
        return self._buffer.at_least(4 * _words(places))

    def read(
        self, encoder: wgpu.GPUCommandEncoder, places: list[PlaneSlot], coding: Coding
    ) -> CodedPicture:
        """Submit the passes that write the buffer, and return the planes.

        With a GPU, they are on their way: any thread may wait for them, and others be made
        meanwhile.
        """
        size = 4 * _words(places)
        staging = self._staging(size)
        encoder.copy_buffer_to_buffer(self.buffer(places), 0, staging, 0, size)
        gpu.submit(self._device, encoder)
        mapped = staging.map_async(wgpu.MapMode.READ)

        def planes() -> tuple[np.ndarray, ...]:
            with gpu.reported():
                mapped.sync_wait()
                try:
                    data = np.array(staging.read_mapped(copy=False), copy=True).view(np.uint8)
                finally:
                    staging.unmap()
            self._free.append(staging)
            return tuple(_plane(data, place, coding) for place in places)

        coming = _Coming(planes, coding)
        if self._device.adapter_info["adapter_type"] == gpu.SOFTWARE:
            _ = coming.planes  # a submission is not interrupted there, so that one is waited for
        return coming

    def _staging(self, size: int) -> wgpu.GPUBuffer:
        """A buffer that no picture uses; buffers of another size are dropped."""
        while self._free:
            if (one := self._free.pop()).size == size:
                return one
        usage = wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.MAP_READ
        return self._device.create_buffer(label="planes", size=size, usage=usage)


class _Coming(CodedPicture):
    """A picture on its way from the GPU: the first who asks for its planes waits for them."""

    def __init__(self, read: Callable[[], tuple[np.ndarray, ...]], coding: Coding):
        vars(self).update(coding=coding, _read=read)

    def __getattr__(self, name: str) -> tuple[np.ndarray, ...]:
        if name != "planes":
            raise AttributeError(name)
        vars(self)["planes"] = planes = vars(self).pop("_read")()
        return planes


def _plane(data: np.ndarray, place: PlaneSlot, coding: Coding) -> np.ndarray:
    """One plane of all bytes of a picture, as an array of its own."""
    width, height = place.size
    rows = data[4 * place.first :][: 4 * place.words * height]
    rows = rows.view("<u2" if coding.bits > 8 else "u1").reshape(height, -1)
    return np.ascontiguousarray(rows[:, :width])


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
