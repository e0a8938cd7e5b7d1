"""Displays and captions over a moving picture: counters, crosshairs, subtitles, logos.

Thin strokes before moving ground take the motion of the ground, and would be blurred until nobody
can read them. They are found pixel by pixel: pixels that do not change from picture to picture and
differ from those beside them, while their surroundings change. Digits that change and the soft
edges of strokes are found by their brightness, next to strokes that stand.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from itertools import takewhile
from typing import Any

import numpy as np

from .. import threads

REACH = 5  # pictures to each side that are looked at
_STILL = 5  # successive steps without a change, from which a pixel stands
_NOISE = 5  # levels of 255 by which codecs change what stands
_EDGE = 0.25  # of the contrast, by which they change it beside what moves
_CONTRAST = 30, 50  # levels of 255 from which a pixel differs, or clearly, from those beside it
_MOVING = 0.3  # share of changes around a pixel, from which its surroundings move
_CLEARLY = np.uint8(16)  # more than the pictures that are counted: REACH to each side, and one
_SEEN = 3  # pictures in which a stroke differs from ground that may be as bright in others
_ACROSS = 0.3  # of the squared contrast, across its main direction: strokes run more than one way
_SUPPORT = 3  # pixels of 5 x 5 that must stand with one
_TILE = 16  # px; surroundings are 5 x 5 tiles
_NEAR = 8  # px; a digit that changes has what stands within one or two of these
_LINE = 1, 2  # of these tiles around, along a line of text one further
_ALIKE = 18  # levels of 255 by which strokes of one display differ
_MIXED = 0.6  # of the way from a stroke to the ground: up to there a pixel belongs to the stroke
SHARES = 0.001, 0.15  # of the picture, that a display takes


@dataclass(frozen=True)
class _Picture:
    """A picture in display values without colour, and the contrast around each pixel (uint8).

    `differs`: 1 where the contrast is over the first of `_CONTRAST`, plus `_CLEARLY` where it is
    over the second; so one sum counts both.
    """

    grey: np.ndarray
    contrast: np.ndarray
    differs: np.ndarray

    @classmethod
    def of(cls, grey: np.ndarray) -> _Picture:
        """A picture, measured."""
        contrast = _contrast(grey)
        over, clearly = ((contrast > least).view(np.uint8) for least in _CONTRAST)
        return cls(grey, contrast, over + _CLEARLY * clearly)


@dataclass(frozen=True, eq=False)
class _Window:
    """A picture and those around that have a say in its mask, by their numbers, as loaded."""

    number: int
    loaded: dict[int, Any]

    def is_same(self, other: _Window) -> bool:
        """True if the mask is the same."""
        return (self.number, [*self.loaded]) == (other.number, [*other.loaded]) and all(
            picture is other.loaded[n] for n, picture in self.loaded.items()
        )


class Displays:
    """Displays in pictures, one after the other.

    `load(number)`: a picture, whose display values without colour, (height, width) uint8, are
    `grey` of it.
    `leads(number, other)`: whether motion leads from a picture to another, which is there then.
    `always`: also where their share of the picture, or a standing camera, speaks against a display.
    `ahead`: once a picture follows another, the mask of the next one is begun in a thread beside.
    """

    def __init__(
        self,
        load: Callable[[int], Any],
        leads: Callable[[int, int], bool],
        always: bool = False,
        ahead: bool = False,
        grey: Callable[[Any], np.ndarray] = lambda picture: picture,
    ):
        self._load, self._leads, self._always, self._ahead = load, leads, always, ahead
        self._grey = grey
        self._pictures: dict[int, _Picture] = {}
        self._steps: dict[int, np.ndarray] = {}
        self._loaded: dict[int, Any] = {}
        self._last: int | None = None
        self._begun: tuple[_Window, Callable[[], np.ndarray | None]] | None = None

    def mask(self, number: int) -> np.ndarray | None:
        """(height, width) bool, True at a display; None if there is no display.

        It depends on the REACH pictures before and after alone.
        """
        window, begun = self._window(number), self._begun
        found = begun[1]() if begun else None
        if begun is None or not begun[0].is_same(window):
            found = self._searched(window)
        follows = self._last is not None and number == self._last + 1
        self._last, self._begun = number, None
        if self._ahead and follows and self._leads(number, number + 1):
            later = self._window(number + 1)
            self._begun = later, threads.started(lambda: self._searched(later), "displays")
        return found

    def _window(self, number: int) -> _Window:
        """The pictures up to REACH before and after one, as far as motion leads to them."""
        ends = []
        for way in (-1, 1):
            steps = range(1, REACH + 1)
            there = takewhile(lambda k, way=way: self._leads(number, number + way * k), steps)
            ends.append(number + way * max(there, default=0))
        return _Window(number, {n: self._load(n) for n in range(ends[0], ends[1] + 1)})

    def _searched(self, window: _Window) -> np.ndarray | None:
        """The mask of the picture in the middle; by one thread at a time."""
        number, self._loaded = window.number, window.loaded
        self._forget(number)
        here = self._picture(number)
        back = self._steps_between(range(min(window.loaded), number))[::-1]
        ahead = self._steps_between(range(number, max(window.loaded)))
        if len(back) + len(ahead) < _STILL:
            return None
        count, often = self._standing(number, back, ahead)
        still = count >= _STILL
        stands = still & (often & (_CLEARLY - 1) >= _SEEN)
        clearly = still & (often >= _SEEN * _CLEARLY)
        textured = here.contrast > _CONTRAST[0]
        if not self._always and 2 * np.count_nonzero(stands) > np.count_nonzero(textured):
            return None  # the camera stands
        core = stands & clearly & _moves_around(back + ahead, textured.shape)
        core &= _sum_around(core, 2) >= _SUPPORT
        if not core.any() or (not self._always and _two_ways(core, here.grey) < SHARES[0]):
            return None
        core |= stands & (_sum_around(core, 2) > 0)
        whole = core | _changing(core, textured, here.grey)
        whole |= _edges(whole, here.grey)
        whole |= _enclosed(whole)
        share, (low, high) = np.count_nonzero(whole) / whole.size, SHARES
        return whole if self._always or low <= share <= high else None

    def _standing(
        self, number: int, back: list[np.ndarray], ahead: list[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Number of steps around a picture, without a break, in which each pixel does not change,
        and the sum of `differs` of the pictures meanwhile: ground that passes may be as bright as a
        stroke for a while.

        `back`, `ahead`: the unchanged pixels of each step.
        """
        often = self._picture(number).differs.copy()
        count = np.zeros_like(often)
        for way, steps in ((-1, back), (1, ahead)):
            going = np.ones_like(often)
            for k, still in enumerate(steps, 1):
                going &= still
                count += going
                often += going * self._picture(number + way * k).differs
        return count, often

    def _picture(self, number: int) -> _Picture:
        if number not in self._pictures:
            self._pictures[number] = _Picture.of(self._grey(self._loaded[number]))
        return self._pictures[number]

    def _steps_between(self, numbers: range) -> list[np.ndarray]:
        """The unchanged pixels (uint8, 0 or 1) of the steps from these pictures to their next."""
        for number in numbers:
            if number not in self._steps:
                self._steps[number] = self._step(number)
        return [self._steps[number] for number in numbers]

    def _step(self, number: int) -> np.ndarray:
        """The pixels that do not change from a picture to the next."""
        one, two = self._picture(number), self._picture(number + 1)
        change = np.maximum(one.grey, two.grey) - np.minimum(one.grey, two.grey)
        least = np.minimum(one.contrast, two.contrast)
        return (change <= np.maximum(least // round(1 / _EDGE), _NOISE)).view(np.uint8)

    def _forget(self, number: int) -> None:
        for kept in (self._pictures, self._steps):
            for old in [n for n in kept if abs(n - number) > REACH + 1]:
                del kept[old]


def _contrast(grey: np.ndarray) -> np.ndarray:
    """The greatest less the least of 3 x 3 pixels."""
    return _neighbourhood(grey, (1, 1), np.maximum) - _neighbourhood(grey, (1, 1), np.minimum)


def _neighbourhood(plane: np.ndarray, reach: tuple[int, int], choose: np.ufunc) -> np.ndarray:
    """The sum, greatest or least up to `reach` rows and columns to each side."""
    for axis in (0, 1):
        whole = np.moveaxis(plane, axis, 0)
        total = whole.copy(order="K")
        for k in range(1, reach[axis] + 1):
            choose(total[k:], whole[:-k], out=total[k:])
            choose(total[:-k], whole[k:], out=total[:-k])
        plane = np.moveaxis(total, 0, axis)
    return plane


def _tiles(plane: np.ndarray, side: int, choose: np.ufunc) -> np.ndarray:
    """(rows, columns): the sum, least or greatest of each tile; the last ones repeat the edge.

    The sum over `side` rows must be below 256.
    """
    beyond = [(0, -size % side) for size in plane.shape]
    if beyond != [(0, 0), (0, 0)]:
        plane = np.pad(plane, beyond, mode="edge")
    strips = functools.reduce(choose, (plane[k::side] for k in range(side)))
    strips = strips.astype(np.uint32) if choose is np.add else strips
    return functools.reduce(choose, (strips[:, k::side] for k in range(side)))


def _spread(tiles: np.ndarray, side: int, shape: tuple[int, ...]) -> np.ndarray:
    """A value for each tile -> for each pixel."""
    return np.repeat(np.repeat(tiles, side, 0), side, 1)[: shape[0], : shape[1]]


def _moves_around(steps: list[np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
    """The pixels in whose surroundings many others change."""
    still = functools.reduce(np.add, steps)
    rest = _tiles(still, _TILE, np.add) / (_TILE**2 * len(steps))
    padded = np.pad(rest, 2, mode="edge")
    views = np.lib.stride_tricks.sliding_window_view(padded, (5, 5))
    return _spread(1 - views.mean((2, 3)) > _MOVING, _TILE, shape)


def _sum_around(plane: np.ndarray, reach: int) -> np.ndarray:
    """Number of pixels up to `reach` to each side that are set (uint8)."""
    return _neighbourhood(plane.view(np.uint8), (reach, reach), np.add)


def _two_ways(core: np.ndarray, grey: np.ndarray) -> float:
    """Share of the picture: pixels of strokes that run more than one way, as letters do.

    An edge that runs along the motion of the ground stands, too (the aperture problem). Measured
    near them, across the main direction: displays have 0.43 of their squared contrast, passing
    houses and roads 0.02 to 0.26.
    """
    y, x = np.nonzero(core)
    height, width = core.shape
    signed = grey.astype(np.int16)
    right, left = np.minimum(x + 1, width - 1), np.maximum(x - 1, 0)
    below, above = np.minimum(y + 1, height - 1), np.maximum(y - 1, 0)
    across = (signed[y, right] - signed[y, left]).astype(np.float64)
    down = (signed[below, x] - signed[above, x]).astype(np.float64)
    rows, columns = -(-height // _NEAR), -(-width // _NEAR)
    tile = y // _NEAR * columns + x // _NEAR

    def near(products: np.ndarray) -> np.ndarray:
        sums = np.bincount(tile, products, rows * columns).reshape(rows, columns)
        return _neighbourhood(sums, _LINE, np.add).ravel()[tile]

    one, other, both = near(across * across), near(down * down), near(across * down)
    least = (one + other - np.hypot(one - other, 2 * both)) / 2
    return np.count_nonzero(least > _ACROSS * (one + other)) / core.size


def _changing(core: np.ndarray, candidates: np.ndarray, grey: np.ndarray) -> np.ndarray:
    """Pixels as bright, or as dark, as the strokes near them: digits that change.

    Where more pixels are so than stand, the ground is as bright, and nothing is told.
    """
    marks = core.view(np.uint8)
    count = _neighbourhood(_tiles(marks, _NEAR, np.add), _LINE, np.add)
    most = _neighbourhood(_tiles(grey * marks, _NEAR, np.maximum), _LINE, np.maximum)
    least = _neighbourhood(
        _tiles(grey | (marks - np.uint8(1)), _NEAR, np.minimum), _LINE, np.minimum
    )
    high, low = np.maximum(most, _ALIKE) - _ALIKE, np.minimum(least, 255 - _ALIKE) + _ALIKE
    places = candidates & ~core & _spread(count > 0, _NEAR, core.shape)
    found = np.zeros(core.shape, bool)
    for compare, limit in ((np.greater_equal, high), (np.less_equal, low)):
        these = places & compare(grey, _spread(limit, _NEAR, core.shape))
        few = _neighbourhood(_tiles(these.view(np.uint8), _NEAR, np.add), _LINE, np.add) <= count
        found |= these & _spread(few, _NEAR, core.shape)
    return found


def _edges(strokes: np.ndarray, grey: np.ndarray) -> np.ndarray:
    """Pixels next to strokes that are partly theirs: they are nearer to them than to the ground."""
    beside = (_sum_around(strokes, 1) > 0) & ~strokes
    places = np.divmod(np.flatnonzero(beside), strokes.shape[1])
    own = grey[places].astype(np.float32)
    stroke = _mean_near(strokes, grey, places, (-1, 0, 1))
    ground = _mean_near(_sum_around(strokes, 2) == 0, grey, places, (-6, -3, 0, 3, 6))
    found = np.zeros(strokes.shape, bool)
    found[places] = np.abs(own - stroke) < _MIXED * np.abs(ground - stroke)
    return found


def _enclosed(strokes: np.ndarray) -> np.ndarray:
    """Strokes, and pixels between those at most two apart: gaps in a digit, and its inside.

    (A closing by 3 x 3 pixels.)
    """
    around = _sum_around(strokes, 1) > 0
    return _sum_around(~around, 1) == 0


def _mean_near(
    among: np.ndarray, grey: np.ndarray, places: tuple[np.ndarray, ...], offsets: tuple[int, ...]
) -> np.ndarray:
    """The mean of the pixels `among` those at some offsets from each place; 0 without any."""
    total = np.zeros(len(places[0]), np.float32)
    count = np.zeros(len(places[0]), np.float32)
    height, width = among.shape
    for down in offsets:
        for right in offsets:
            y = np.clip(places[0] + down, 0, height - 1)
            x = np.clip(places[1] + right, 0, width - 1)
            counts = among[y, x]
            total += np.where(counts, grey[y, x], 0)
            count += counts
    return total / np.maximum(count, 1)
