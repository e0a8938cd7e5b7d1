"""Blocks of a small picture, each searched in both neighbours: for what dense inverse search loses.

States are (height, width, 4) to_prev, to_next [px of their level].
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from copy import copy
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ...gpu import wgsl
from .inverse_search import Pictures

SMALL, HALF = 160, 320  # px along the longer side: where blocks are searched, and refined
MOST_BLOCKS = 400  # of a picture: those that fit worst
SOFT = 0.8  # px of a Gaussian, so that an error of a part of a pixel hardly shows in texture
NEAR = (0, 0), (-1, 0), (0, -1), (0, 1), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)


def constants(file: str, *names: str) -> Iterator[float]:
    """Those of a shader of the search on a GPU, which has the same steps."""
    return map(wgsl.load(f"flow/dense/{file}.wgsl").constant, names)


BLOCK, SPACING = map(int, constants("summary", "BLOCK", "SPACING"))
REACH, ALIKE, LEVEL, OTHER, MOST_SQUARE = constants(
    "blocks", "REACH", "ALIKE", "LEVEL", "OTHER", "MOST_SQUARE"
)
UNFIT, CHANGED, FLAT, LEAST_EVEN, REGION = constants(
    "unfit", "UNFIT", "CHANGED", "FLAT", "LEAST_EVEN", "REGION"
)
MOST_OTHER, OTHERWISE, BETTER, MORE = constants("spread", "MOST_OTHER", "APART", "BETTER", "LEVEL")
(NOISE,) = constants("summarize", "NOISE")
(AWAY,) = constants("raising", "AWAY")
(MOST_APART,) = constants("differences", "MOST_APART")
STEPS, LONGEST_STEP, MOST_STEP_APART = constants("refine", "STEPS", "LONGEST_STEP", "MOST_APART")


def _cv() -> Any:
    """OpenCV, which is optional."""
    return importlib.import_module("cv2")


class Reduced:
    """A picture and its neighbours, reduced to a longer side of at most `longest` px.

    `pictures`: previous, own, next, (height, width) uint8; one neighbour may lack.
    """

    def __init__(self, pictures: Pictures, longest: int):
        prev, here, next = pictures
        assert here is not None
        height, width = here.shape
        self.factor = max(1.0, max(height, width) / longest)
        self.size = max(1, round(width / self.factor)), max(1, round(height / self.factor))
        self.here = self.reduced(here)
        beside = enumerate((prev, next))
        self.sides = {side: self.reduced(p) for side, p in beside if p is not None}
        x, y = np.arange(self.size[0]), np.arange(self.size[1])
        self._x, self._y = np.meshgrid(x.astype(np.float32), y.astype(np.float32))

    def reduced(self, plane: np.ndarray) -> np.ndarray:
        """A plane of the whole size at that of the level, float32, by means of areas."""
        if plane.shape[1::-1] != self.size:
            plane = _cv().resize(plane, self.size, interpolation=_cv().INTER_AREA)
        return plane.astype(np.float32)

    def moved(self, plane: np.ndarray, way: np.ndarray) -> np.ndarray:
        """The plane at where the ways (height, width, 2) [px] lead."""
        at = self._x + way[..., 0], self._y + way[..., 1]
        return _cv().remap(plane, *at, _cv().INTER_LINEAR, borderMode=_cv().BORDER_REPLICATE)

    def places(self, way: np.ndarray) -> np.ndarray:
        """Indices, row by row, of the pixels that the ways (height, width, 2) [px] lead to."""
        at = self._x + way[..., 0], self._y + way[..., 1]
        x, y = (np.rint(n).clip(0, most - 1) for n, most in zip(at, self.size, strict=True))
        return (y * self.size[0] + x).astype(np.intp)

    def differences(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Those to the neighbour that fits better and to the other, means of 3 x 3 pixels.

        That to the other is 0 if it lacks.
        """
        return _better_and_other([self._apart(plane) for plane in self._neighbours(state)])

    def cost(self, state: np.ndarray) -> np.ndarray:
        """The differences of a state, in levels of 255, averaged over 3 x 3 pixels once more.

        The mean of both neighbours counts as a third one. In a dissolve it would fit almost any
        way, but there no block is searched (`unfit`).
        """
        neighbours = self._neighbours(state)
        better, worse = _better_and_other([self._apart(plane) for plane in neighbours])
        if len(neighbours) > 1:
            better = _cv().min(better, self._apart(_mean(neighbours)))
        return _cv().blur(better + OTHER * _cv().min(worse, MOST_OTHER), (3, 3))

    def _neighbours(self, state: np.ndarray) -> list[np.ndarray]:
        """The neighbours that there are, each at where the state leads."""
        return [self.moved(other, way_of(state, side)) for side, other in self.sides.items()]

    def _apart(self, plane: np.ndarray) -> np.ndarray:
        """Differences of a plane from the picture, each at most `MOST_APART`, means of 3 x 3."""
        return _cv().blur(_cv().min(_cv().absdiff(plane, self.here), MOST_APART), (3, 3))

    def softened(self) -> Reduced:
        """The same without the finest texture, in which errors of a part of a pixel show most."""
        soft = copy(self)
        soft.here = _cv().GaussianBlur(self.here, (0, 0), SOFT)
        soft.sides = {k: _cv().GaussianBlur(p, (0, 0), SOFT) for k, p in self.sides.items()}
        return soft

    def unfit(self, state: np.ndarray) -> np.ndarray:
        """Levels by which places that change fit neither neighbour, 0 for all others.

        In a dissolve, light changes evenly: many places that fit neither neighbour fit the mean of
        both. Around these it is 0, as no body is lost there.
        """
        better, _ = self.differences(state)
        changes = [_cv().absdiff(self.here, other) for other in self.sides.values()]
        changes = _cv().blur(np.minimum.reduce(changes), (3, 3))
        is_there = (better > UNFIT) & (changes > CHANGED + np.percentile(changes, 100 * NOISE))
        if len(self.sides) == 2:
            is_there &= ~self._is_even(state, is_there)
        return np.where(is_there, better, 0)

    def _is_even(self, state: np.ndarray, unfit: np.ndarray) -> np.ndarray:
        """(height, width) bool: places around which some of the unfit fit the mean of both."""
        even = unfit & (self._apart(_mean(self._neighbours(state))) <= UNFIT)
        side = 2 * int(REGION) + 1
        evens, all = (_cv().blur(n.astype(np.float32), (side, side)) for n in (even, unfit))
        return evens > LEAST_EVEN * all


def _better_and_other(apart: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The smaller and the larger of two planes of differences; a single one, and 0."""
    one, two = apart[0], apart[-1]
    return _cv().min(one, two), _cv().max(one, two) if len(apart) > 1 else np.zeros_like(one)


def _mean(neighbours: list[np.ndarray]) -> np.ndarray:
    """The mean of two neighbours."""
    return _cv().addWeighted(neighbours[0], 0.5, neighbours[1], 0.5, 0)


class Blocks(NamedTuple):
    """A state of a level, and a plane of 1 where blocks move otherwise, 0 elsewhere (any size)."""

    level: Reduced
    state: np.ndarray
    other: np.ndarray


def searched(pictures: Pictures, motion: np.ndarray) -> Blocks | None:
    """A state of a level, with what blocks find where `motion` fits neither neighbour.

    `motion`: of the picture (height, width, 4) [px]. None where it fits, where blocks find the
    same, and in a picture that is smaller than a block.
    """
    small = Reduced(pictures, SMALL)
    begin = scaled(motion, small)
    unfit = small.softened().unfit(begin)
    if min(small.size) < BLOCK or not unfit.any():
        return None
    rows, columns = (n // SPACING for n in small.here.shape)
    grid = _cv().resize(unfit, (columns, rows), interpolation=_cv().INTER_AREA)
    wanted = _cv().dilate(grid, np.ones((3, 3), np.uint8))
    most = np.median(begin[..., 2:].reshape(-1, 2), axis=0)
    found = _best_ways(small, wanted, most)
    state, area = _spread(small, begin, found)
    other = (np.abs(state - begin).max(axis=2) > OTHERWISE).astype(np.float32)
    if not other.any():
        return None
    state = np.where(area[..., None], _medians(state, 5), state)
    state = refined(small, state, 5)
    half = Reduced(pictures, HALF)
    state = refined(half, _medians(raised(small, half, state), 3), 7)
    return Blocks(half, state, other)


def way_of(state: np.ndarray, side: int) -> np.ndarray:
    """The ways (height, width, 2) of a state to one neighbour, 0 the previous, 1 the next."""
    return state[..., 2 * side : 2 * side + 2]


def scaled(motion: np.ndarray, level: Reduced) -> np.ndarray:
    """Motion of the whole picture as a state of a level."""
    return level.reduced(motion) / np.float32(level.factor)


def _best_ways(level: Reduced, wanted: np.ndarray, most: np.ndarray) -> np.ndarray:
    """(rows, columns, 2) the way to the next picture [px] of blocks, NaN where none is searched.

    `wanted`: how much each should be; `most`: the motion of most, the nearest to which counts of
    ways that match alike. The way to the previous picture is the opposite one.
    """
    reach, half = round(REACH * max(level.size)), BLOCK // 2
    margin = reach + half
    here, *beside = (
        _cv().copyMakeBorder(plane, *[margin] * 4, _cv().BORDER_REPLICATE)
        for plane in (level.here, *level.sides.values())
    )
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float32)
    far = np.hypot(x - most[0], y - most[1])
    ways = np.full((*wanted.shape, 2), np.nan, np.float32)
    order = np.argsort(-wanted, axis=None, kind="stable")[:MOST_BLOCKS]
    for row, column in zip(*np.unravel_index(order, wanted.shape), strict=True):
        if not wanted[row, column]:
            break
        top, left = (int((n + 0.5) * SPACING) - half + margin for n in (row, column))
        block = here[top : top + BLOCK, left : left + BLOCK]
        if block.var() < FLAT:
            continue
        rows, columns = (slice(n - reach, n + reach + BLOCK) for n in (top, left))
        fits = []
        for side, plane in zip(level.sides, beside, strict=True):
            fit = _cv().matchTemplate(plane[rows, columns], block, _cv().TM_SQDIFF) / BLOCK**2
            fits.append(fit if side else fit[::-1, ::-1])  # by the way to the next picture
        cost = np.minimum.reduce(fits)
        if len(fits) > 1:
            cost = cost + OTHER * np.minimum(np.maximum.reduce(fits), MOST_SQUARE)
        alike = cost <= ALIKE * cost.min() + LEVEL
        at = np.where(alike, far, np.inf).argmin()
        ways[row, column] = x.flat[at], y.flat[at]
    return ways


def _spread(level: Reduced, state: np.ndarray, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The state, with the ways of blocks near by where they fit better; where they were tried."""
    width, height = level.size
    best, state = BETTER * level.cost(state) + MORE, state.copy()
    there = ~np.isnan(ways[..., 0])
    area = np.zeros((height, width), bool)
    pad = np.pad(ways, ((2, 2), (2, 2), (0, 0)), constant_values=np.nan)
    rows, columns = there.shape
    offsets = sorted(product(range(-2, 3), repeat=2), key=lambda o: abs(o[0]) + abs(o[1]))
    for down, right in offsets:
        near = pad[2 + down : 2 + down + rows, 2 + right : 2 + right + columns]
        near = _cv().resize(
            near, (columns * SPACING, rows * SPACING), interpolation=_cv().INTER_NEAREST
        )
        more = height - near.shape[0], width - near.shape[1]
        near = _cv().copyMakeBorder(near, 0, more[0], 0, more[1], _cv().BORDER_REPLICATE)
        tried = ~np.isnan(near[..., 0])
        if not tried.any():
            continue
        near = np.where(tried[..., None], near, 0)
        other = np.concatenate([-near, near], axis=2)
        cost = level.cost(other)
        takes = tried & (cost < best)
        best[takes], state[takes] = cost[takes], other[takes]
        area |= tried
    return state, area


def refined(level: Reduced, state: np.ndarray, side: int) -> np.ndarray:
    """A state after steps of inverse search over squares of a side [px], each way by itself."""
    across = _cv().Scharr(level.here, _cv().CV_32F, 1, 0, scale=1 / 32)
    down = _cv().Scharr(level.here, _cv().CV_32F, 0, 1, scale=1 / 32)

    def mean(plane: np.ndarray) -> np.ndarray:
        return _cv().blur(plane, (side, side))

    xx, xy, yy = mean(across * across) + 1, mean(across * down), mean(down * down) + 1
    scale = 1 / (xx * yy - xy * xy)
    found: dict[int, np.ndarray] = {}
    for side_of, other in level.sides.items():
        way = way_of(state, side_of)
        apart = level.moved(other, way) - level.here
        cost = mean(np.abs(apart))
        for _ in range(int(STEPS)):
            apart = np.clip(apart, -MOST_STEP_APART, MOST_STEP_APART)
            x, y = mean(across * apart), mean(down * apart)
            step = np.stack([xy * y - yy * x, xy * x - xx * y], axis=2) * scale[..., None]
            tried = way + np.clip(step, -LONGEST_STEP, LONGEST_STEP)
            other_apart = level.moved(other, tried) - level.here
            other_cost = mean(np.abs(other_apart))
            takes = other_cost < cost
            way = np.where(takes[..., None], tried, way)
            apart = np.where(takes, other_apart, apart)
            cost = np.minimum(cost, other_cost)
        found[side_of] = way
    one, two = (found[k] if k in found else -found[1 - k] for k in (0, 1))
    return np.concatenate([one, two], axis=2)


def _medians(state: np.ndarray, side: int) -> np.ndarray:
    planes = [_cv().medianBlur(np.ascontiguousarray(state[..., k]), side) for k in range(4)]
    return np.stack(planes, axis=2)


def raised(
    small: Reduced, large: Reduced, state: np.ndarray, box: tuple[slice, slice] | None = None
) -> np.ndarray:
    """A state of a small level for the pixels of a larger one, or of a `box` of it.

    Each takes that of the likest of the nine pixels around it.
    """
    rows, columns = box or (slice(0, large.size[1]), slice(0, large.size[0]))
    at, nearest = [], []
    for part, few, many in zip((columns, rows), small.size, large.size, strict=True):
        centres = np.arange(part.start, part.stop, dtype=np.float32) + 0.5
        at.append(centres * np.float32(few / many) - 0.5)
        nearest.append(np.rint(at[-1]))
    here, (width, height) = large.here[rows, columns], small.size
    best = np.full(here.shape, np.inf, np.float32)
    likest = np.zeros(here.shape, np.uint8)  # of NEAR
    steps = np.array(NEAR)
    down, right = (
        (middle.astype(np.intp) + step[:, None]).clip(0, many - 1)
        for middle, step, many in zip(nearest[::-1], steps.T, (height, width), strict=True)
    )
    for k, (step_down, step_right) in enumerate(NEAR):
        x, y = (
            (m + s - a) ** 2 for m, s, a in zip(nearest, (step_right, step_down), at, strict=True)
        )
        cost = np.sqrt(y[:, None] + x)
        cost *= np.float32(AWAY)
        cost += _cv().absdiff(small.here[down[k]].take(right[k], axis=1), here)
        np.copyto(likest, k, where=cost < best)
        np.minimum(best, cost, out=best)
    places = np.take_along_axis(down.T, likest, axis=1) * width
    places += np.take_along_axis(right, likest, axis=0)
    found = np.take(state.reshape(-1, 4), places, axis=0)
    found *= np.float32(small.factor / large.factor)
    return found
