"""A coded picture at a glance: small copies that tell cuts, repeats and motion apart."""

from __future__ import annotations

from functools import cache, cached_property

import numpy as np

from ..color.coding import (
    FLOAT,
    HLG,
    LINEAR,
    PQ,
    SRGB,
    CodedPicture,
    Coding,
)
from ..color.srgb import srgb
from ..shots import repeats
from ..shots.cuts import small_step, smalls_differ
from .planes.matrices import from_samples

_LUMA = 77, 150, 29  # of 256: ITU-R BT.601
_LUMA_ROWS = 4  # of a block of pixels, that are averaged
_CHROMA = 2  # rows and columns of a block, for the other planes
_BAND = 64  # rows that are compared at once
_WHITE = {PQ: 0.58, HLG: 0.75}  # signal of the white of text and paper (ITU-R BT.2408)


class Thumbnail:
    """A coded picture and its small versions; each is made once, on request."""

    def __init__(self, coded: CodedPicture):
        self.coded = coded

    @cached_property
    def _integers(self) -> CodedPicture:
        """The picture as integers."""
        coding = self.coded.coding
        if coding.bits != FLOAT:
            return self.coded
        color = self.coded.planes[0][..., :3]
        signal = srgb(color) if coding.transfer == LINEAR else color
        samples = np.rint(np.clip(signal, 0, 1) * 65535).astype(np.uint16)
        transfer = SRGB if coding.transfer == LINEAR else coding.transfer
        whole = Coding("rgb", 16, (1, 1), full_range=True, transfer=transfer)
        return CodedPicture(tuple(np.moveaxis(samples, 2, 0)), whole)

    @cached_property
    def small(self) -> np.ndarray:
        """(height, width, 3) display values of a small copy; see small_step."""
        width, height = self.coded.size
        step = small_step(width, height)
        size = width // step, height // step
        luma, *chroma = self._colors
        planes = [_means(luma, size, step, (1, 1), min(step, _LUMA_ROWS), whole=True)]
        for plane in chroma:
            planes.append(_means(plane, size, step, self._steps(plane), min(step, _CHROMA), False))
        return self._display(planes)

    @cached_property
    def sampled(self) -> np.ndarray:
        """(height, width, 3) display values of pixels in even distances, at least 480 a row."""
        width, height = self.coded.size
        step = max(1, width // repeats.SAMPLED)
        planes = []
        for plane in self._colors:
            wide, high = self._steps(plane)
            rows = plane[np.arange(0, height, step) // high]
            planes.append(rows[:, np.arange(0, width, step) // wide])
        return self._display(planes)

    @cached_property
    def grey(self) -> np.ndarray:
        """(height, width) uint8: display values without colour."""
        coding, planes = self._integers.coding, self._colors
        most, unit = 2**coding.bits - 1, 2 ** (coding.bits - 8)
        if coding.model == "rgb" and coding.bits == 8:
            total = np.full(planes[0].shape, 128, np.uint16)
            for plane, weight in zip(planes, _LUMA, strict=True):
                total += np.uint16(weight) * plane.astype(np.uint16)
            return (total >> 8).astype(np.uint8)
        if coding.model == "rgb":
            parts = (
                w / 256 * plane.astype(np.float32) for w, plane in zip(_LUMA, planes, strict=True)
            )
            return np.rint(sum(parts) * (255 / most)).astype(np.uint8)
        low, high = (0, most) if coding.full_range else (16 * unit, 235 * unit)
        table = np.clip((np.arange(most + 1) - low) / (high - low), 0, 1)
        return np.rint(255 * table).astype(np.uint8)[planes[0]]

    @property
    def _colors(self) -> tuple[np.ndarray, ...]:
        """The planes without alpha."""
        planes = self._integers.planes
        return planes[:-1] if self._integers.coding.alpha else planes

    def _steps(self, plane: np.ndarray) -> tuple[int, int]:
        """Columns and rows of pixels to one sample of a plane."""
        whole = plane.shape == self._integers.planes[0].shape
        return (1, 1) if whole else self._integers.coding.steps

    def _display(self, planes: list[np.ndarray]) -> np.ndarray:
        """Display values of samples, those of HDR up to the white of text."""
        coding = self._integers.coding
        samples = np.array(planes if len(planes) == 3 else [planes[0]] * 3, np.float32)
        rows = _rows(coding)
        signal = np.einsum("cp,pyx->yxc", rows[:, :3], samples) + rows[:, 3]
        if coding.transfer == LINEAR:
            return srgb(signal)
        return np.clip(signal / _WHITE.get(coding.transfer, 1.0), 0, 1)


@cache
def _rows(coding: Coding) -> np.ndarray:
    """See from_samples."""
    return from_samples(coding).astype(np.float32)


def _means(
    plane: np.ndarray,
    size: tuple[int, int],
    step: int,
    coarse: tuple[int, int],
    count: int,
    whole: bool,
) -> np.ndarray:
    """(height, width) of `size`: means over blocks of `step` pixels, of some rows and columns.

    `coarse`: columns and rows of pixels to one sample. `count` rows of a block are taken, and as
    many columns, or, where `whole`, all of them.
    """
    across, down = size
    some = [(n * step + step // 2) // count for n in range(count)]
    deep = np.uint32 if plane.dtype == np.uint16 else np.uint16
    rows = [plane[_places(i, step, down, coarse[1])] for i in some]
    if whole:
        total = _sum([row[:, : across * step] for row in rows], deep).reshape(down, across, step)
        return np.einsum("yxi->yx", total, dtype=np.uint32) / np.float32(count * step)
    columns = [_places(i, step, across, coarse[0]) for i in some]
    return _sum([row[:, x] for row in rows for x in columns], deep) / np.float32(count * count)


def _places(first: int, step: int, count: int, coarse: int) -> slice | np.ndarray:
    """Positions of the samples of every `step`th pixel, of `count`, from the pixel `first` on."""
    if step % coarse:
        return (first + step * np.arange(count)) // coarse
    begin, every = first // coarse, step // coarse
    return slice(begin, begin + every * (count - 1) + 1, every)


def _sum(parts: list[np.ndarray], kind: type) -> np.ndarray:
    """The sum of arrays as numbers of this kind."""
    total = parts[0].astype(kind)
    for part in parts[1:]:
        total += part
    return total


def is_cut(before: Thumbnail, after: Thumbnail) -> bool:
    """Return True if a cut lies between two pictures."""
    return smalls_differ(before.small, after.small)


def is_same(one: Thumbnail, other: Thumbnail) -> bool:
    """Return True if two pictures have the same samples."""
    if one is other:
        return True
    pairs = zip(one.coded.planes, other.coded.planes, strict=True)
    return one.coded.coding == other.coded.coding and all(_equal(a, b) for a, b in pairs)


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    """Equality of two planes; most planes that differ do so in the first band of rows."""
    return a.shape == b.shape and all(
        np.array_equal(a[top : top + _BAND], b[top : top + _BAND])
        for top in range(0, len(a), _BAND)
    )


def change(before: Thumbnail, after: Thumbnail) -> np.ndarray:
    """The energy of the change from one picture to another, see shots/repeats.py."""
    return repeats.change(before.sampled, after.sampled)
