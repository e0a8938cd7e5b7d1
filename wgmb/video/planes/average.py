"""Weighted means of coded pictures in linear light: from planes to planes in one pass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import wgpu

from ... import gpu
from ...color.coding import CodedPicture, Coding
from ...gpu.textures import ScratchBuffer, TexturePool
from .packed import Packed, places_of
from .uniforms import curve_of, reading, writing

EIGHT = 8  # pictures that one pass takes, and that are kept on the GPU
_BLOCK = 16, 2  # columns and rows of pixels that an invocation makes
_MOST_GROUPS = 65535  # of a dispatch, across (WebGPU)
_SUMS = 512  # bytes of a block's sums
_KINDS = {8: "rg32uint", 16: "rgba32uint"}  # of texels, by their bytes
_BAND = 4 << 20  # bytes that are uploaded at once


def averages(stored: Coding, wanted: Coding) -> bool:
    """Return True if pictures that are `stored` so can be averaged and be coded as `wanted`."""
    return all(
        one.model == "yuv" and not one.alpha and max(one.steps) <= 2 for one in (stored, wanted)
    )


class Average:
    """Averages the pictures of one video, whose planes stay on the GPU while they are needed."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)
        self._sums, self._packed = ScratchBuffer(device), Packed(device)
        self._frame = gpu.SizeBindings(device)
        self._held: list[CodedPicture | None] = [None] * EIGHT

    def __call__(
        self, pictures: Sequence[CodedPicture], weights: Sequence[float], wanted: Coding
    ) -> CodedPicture:
        """The sum of pictures of one size and Coding, for which `averages` holds, by `weights`."""
        encoder = gpu.encoder(self._device, "average")
        for first in range(0, len(pictures), EIGHT):
            if first:
                gpu.hand_in(self._device, encoder)
                encoder = gpu.encoder(self._device, "average")
            some = pictures[first : first + EIGHT]
            ends = first == 0, first + EIGHT >= len(pictures)
            self._add(encoder, some, weights[first : first + EIGHT], wanted, ends)
        places = places_of(pictures[0].size, wanted)
        return self._packed.read(encoder, places, wanted)

    def _add(
        self,
        encoder: wgpu.GPUCommandEncoder,
        pictures: Sequence[CodedPicture],
        weights: Sequence[float],
        wanted: Coding,
        ends: tuple[bool, bool],
    ) -> None:
        """Record the pass over up to eight pictures; `ends`: they are the first, the last ones."""
        (width, height), stored = pictures[0].size, pictures[0].coding
        grid = -(-width // _BLOCK[0]), -(-height // _BLOCK[1])
        planes = [self._layered(index, pictures[0]) for index in range(3)]
        kernel = gpu.kernel(
            self._device,
            "video/planes/average.wgsl",
            {"blues": planes[1].format, "reds": planes[2].format},
            CURVE=curve_of(stored),
            PRECISE=max(stored.bits, wanted.bits) > 8,
            READ_X=stored.steps[0],
            READ_Y=stored.steps[1],
            WRITE_X=wanted.steps[0],
            WRITE_Y=wanted.steps[1],
            READ_BITS=8 * _bytes(stored),
            BITS=8 * _bytes(wanted),
            FIRST=ends[0],
            LAST=ends[1],
        )
        places = places_of((width, height), wanted)
        data = np.zeros((), kernel.source.dtype("Average"))
        data["parts"][: len(pictures), 0] = weights
        data["parts"][: len(pictures), 1] = self._layers(pictures)
        data["count"], data["blocks"], data["most"] = len(pictures), grid[0], 2**wanted.bits - 1
        for name, place in zip(("luma", "blue", "red"), places, strict=True):
            data[name][:3] = place.words, place.size[1], place.first
        kernel.run(
            encoder,
            "main",
            self._frame(_invocations(grid[0] * grid[1], kernel.workgroup)),
            stored=reading(self._device, stored),
            wanted=writing(self._device, wanted),
            average=data,
            lumas=self._images.view_of(planes[0], dimension="2d-array"),
            blues=self._images.view_of(planes[1], dimension="2d-array"),
            reds=self._images.view_of(planes[2], dimension="2d-array"),
            sums=self._sums.at_least(_SUMS if all(ends) else _SUMS * grid[0] * grid[1]),
            packed=self._packed.buffer(places),
        )

    def _layers(self, pictures: Sequence[CodedPicture]) -> list[int]:
        """The layer that holds each picture; those that are not there are uploaded."""
        free = [n for n, held in enumerate(self._held) if not any(held is p for p in pictures)]
        layers = []
        for picture in pictures:
            layer = next((n for n, held in enumerate(self._held) if held is picture), None)
            if layer is None:
                layer = free.pop(0)
                self._held[layer] = picture
                self._upload(picture, layer)
            layers.append(layer)
        return layers

    def _layered(self, index: int, picture: CodedPicture) -> wgpu.GPUTexture:
        """The texture that holds a plane of every picture."""
        height, width = picture.planes[index].shape
        samples = _samples(index, picture.coding)
        row = -(-width // samples) * samples * _bytes(picture.coding)
        texel = min(samples * _bytes(picture.coding), max(_KINDS))
        size = row // texel, height
        return self._images.texture(f"plane {index}", size, _KINDS[texel], EIGHT)

    def _upload(self, picture: CodedPicture, layer: int) -> None:
        gpu.before_writing(self._device)
        for index, plane in enumerate(picture.planes):
            texture = self._layered(index, picture)
            if over := -plane.shape[1] % _samples(index, picture.coding):
                plane = np.pad(plane, ((0, 0), (0, over)), "edge")
            plane = _in_rows(plane)
            width, height, _ = texture.size
            pitch = plane.strides[0]
            band = max(1, _BAND // pitch)
            for top in range(0, height, band):
                rows = plane[top : top + band]
                self._device.queue.write_texture(
                    {"texture": texture, "origin": (0, top, layer)},
                    _memory(rows),
                    {"bytes_per_row": pitch, "rows_per_image": len(rows)},
                    (width, len(rows), 1),
                )
        gpu.submit(self._device)  # written data stays in memory until a submission


def _invocations(count: int, workgroup: tuple[int, int]) -> tuple[int, int]:
    """Across and down, as whole workgroups: at least so many."""
    groups = -(-count // (workgroup[0] * workgroup[1]))
    across = min(groups, _MOST_GROUPS)
    return across * workgroup[0], -(-groups // across) * workgroup[1]


def _bytes(coding: Coding) -> int:
    """Of a sample."""
    return 2 if coding.bits > 8 else 1


def _in_rows(plane: np.ndarray) -> np.ndarray:
    """The plane, copied unless its rows lie one after the other, gaps between them or none."""
    row = plane.shape[1] * plane.itemsize
    fits = plane.strides[1] == plane.itemsize and plane.strides[0] >= row
    return plane if fits else np.ascontiguousarray(plane)


def _memory(rows: np.ndarray) -> np.ndarray:
    """The bytes from the first sample to the last one, with the gaps between rows."""
    length = rows.strides[0] * (len(rows) - 1) + rows.shape[1] * rows.itemsize
    return np.lib.stride_tricks.as_strided(rows.view(np.uint8), (length,), (1,), writeable=False)


def _samples(index: int, coding: Coding) -> int:
    """Of a plane in a row of a block."""
    return _BLOCK[0] // (coding.steps[0] if index else 1)
