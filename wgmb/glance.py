"""A coded picture at a glance: small copies that tell cuts, repeats and motion apart."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from functools import cached_property

import numpy as np

from .coding import HLG, LINEAR, PQ, CodedPicture
from .color import srgb
from .io.cuts import SAMPLED, SMALL, copies, smalls_differ
from .planes.matrices import from_samples

_LUMA_ROWS = 4  # of a block of pixels, that are averaged
_CHROMA = 2  # rows and columns of a block, for the other planes
_WHITE = {PQ: 0.58, HLG: 0.75}  # signal of the white of text and paper (ITU-R BT.2408)


class Glance:
    """A coded picture, and what is seen of it at a glance: each made once, when it is asked for."""

    def __init__(self, coded: CodedPicture):
        self.coded = coded

    @cached_property
    def small(self) -> np.ndarray:
        """(height, width, 3) display values of a copy about SMALL pixels wide."""
        width, height = self.coded.size
        step = max(1, width // SMALL)
        size = width // step, height // step
        luma, *chroma = self._colors
        planes = [_means(luma, size, step, (1, 1), min(step, _LUMA_ROWS), whole=True)]
        for plane in chroma:
            planes.append(_means(plane, size, step, self._steps(plane), min(step, _CHROMA), False))
        return self._display(planes)

    @cached_property
    def sampled(self) -> np.ndarray:
        """(height, width, 3) display values of pixels in even distances, at least SAMPLED a row."""
        width, height = self.coded.size
        step = max(1, width // SAMPLED)
        planes = []
        for plane in self._colors:
            wide, high = self._steps(plane)
            rows = plane[np.arange(0, height, step) // high]
            planes.append(rows[:, np.arange(0, width, step) // wide])
        return self._display(planes)

    @property
    def grey(self) -> np.ndarray:
        """(height, width) uint8: display values without colour."""
        coding, planes = self.coded.coding, self._colors
        most, unit = 2**coding.bits - 1, 2 ** (coding.bits - 8)
        if coding.model == "rgb":
            mean = 0.25 * planes[0].astype(np.float32) + 0.625 * planes[1] + 0.125 * planes[2]
            return (mean * (255 / most)).astype(np.uint8)
        low, high = (0, most) if coding.full_range else (16 * unit, 235 * unit)
        table = np.clip((np.arange(most + 1) - low) / (high - low), 0, 1)
        return np.rint(255 * table).astype(np.uint8)[planes[0]]

    @property
    def _colors(self) -> tuple[np.ndarray, ...]:
        """The planes without alpha."""
        planes = self.coded.planes
        return planes[:-1] if self.coded.coding.alpha else planes

    def _steps(self, plane: np.ndarray) -> tuple[int, int]:
        """Columns and rows of pixels to one sample of a plane."""
        whole = plane.shape == self.coded.planes[0].shape
        return (1, 1) if whole else self.coded.coding.steps

    def _display(self, planes: list[np.ndarray]) -> np.ndarray:
        """Display values of samples, those of HDR up to the white of text."""
        coding = self.coded.coding
        samples = np.stack(planes if len(planes) == 3 else [planes[0]] * 3, axis=-1)
        rows = from_samples(coding).astype(np.float32)
        signal = samples.astype(np.float32) @ rows[:, :3].T + rows[:, 3]
        if coding.transfer == LINEAR:
            return srgb(signal)
        return np.clip(signal / _WHITE.get(coding.transfer, 1.0), 0, 1)


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
    some = (np.arange(count) * step + step // 2) // count
    y, x = ((np.arange(n)[:, None] * step + some).ravel() for n in (down, across))
    rows = plane[y // coarse[1]]
    if whole:
        columns, rows = step, rows[:, : across * step]
    else:
        columns, rows = count, np.take(rows, x // coarse[0], axis=1)
    deep = np.uint32 if plane.dtype == np.uint16 else np.uint16
    sums = rows.reshape(down, count, -1).sum(axis=1, dtype=deep).reshape(down, across, columns)
    return sums.sum(axis=2, dtype=np.uint32) / np.float32(count * columns)


def is_cut(before: Glance, after: Glance) -> bool:
    """Return True if a cut lies between two pictures."""
    return smalls_differ(before.small, after.small)


def is_double(before: Glance, after: Glance) -> bool:
    """Return True if a picture only repeats the one before."""
    return copies(before.sampled, after.sampled)
