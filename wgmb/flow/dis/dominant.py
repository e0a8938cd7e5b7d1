"""The dominant motion of a picture, a homography, which counts wherever it fits as well."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from .blocks import BLOCK, HALF, UNFIT, Reduced, scaled, way_of
from .homographies import homography_of, ways_of
from .inverse_search import Pictures

_APART = 0.5  # px of the level, by which a motion differs that is not the dominant one
_SAME = 2.0  # px of the level: places beside each other may lead to one place


def _cv() -> Any:
    """OpenCV, which is optional."""
    return importlib.import_module("cv2")


class Dominant:
    """The dominant motion of a picture, and the picture with its neighbours, in which it counts.

    On flat ground and in patterns that repeat, a search finds one motion as well as another.
    `motion`: of the picture (height, width, 4) [px].
    """

    def __init__(self, pictures: Pictures, motion: np.ndarray):
        self._level = level = Reduced(pictures, HALF).softened()
        self._matrices = [homography_of(way_of(motion, side)) for side in (0, 1)]
        columns, rows = (np.arange(n, dtype=np.float32) for n in level.size)
        x, y = ((n + 0.5) * np.float32(level.factor) - 0.5 for n in (columns, rows))
        self._state = self._motion(x, y) / np.float32(level.factor)

    def put(self, motion: np.ndarray) -> np.ndarray:
        """The motion, with the dominant one in regions that differ from it and fit it as well.

        A region keeps its motion if the dominant one fits worse anywhere in it, and so does a
        picture that is smaller than a block. Where a picture has one neighbour alone, places that
        are hidden there take the dominant motion, too.
        """
        level, dominant = self._level, self._state
        if min(level.size) < BLOCK:
            return motion
        state = scaled(motion, level)
        differs = np.abs(state - dominant).max(axis=2) > _APART
        worse = level.differences(dominant)[0] - level.differences(state)[0] > UNFIT
        if len(level.sides) == 1:
            hidden = _hidden(level, state, dominant)
            self._put(motion, differs & hidden, (0, 0, *level.size))
            differs &= ~hidden
        _, labels, boxes, _ = _cv().connectedComponentsWithStats(differs.astype(np.uint8))
        keeps = np.zeros(len(boxes), bool)
        keeps[labels[worse]] = keeps[0] = True
        for label in np.flatnonzero(~keeps):
            left, top, wide, high, _ = boxes[label].tolist()
            region = labels[top : top + high, left : left + wide] == label
            self._put(motion, region, (left, top, wide, high))
        return motion

    def _motion(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """At columns and rows of the picture."""
        ways = [plane for matrix in self._matrices for plane in ways_of(matrix, x, y[:, None])]
        return _cv().merge(ways)

    def _put(self, motion: np.ndarray, region: np.ndarray, box: tuple[int, int, int, int]) -> None:
        """Write it where `region` is true, of the pixels in a box of the level: left, top, width,
        height.
        """
        left, top, wide, high = box
        (y0, y1), (x0, x1) = (
            (round(first * self._level.factor), min(round((first + n) * self._level.factor), size))
            for first, n, size in ((top, high, motion.shape[0]), (left, wide, motion.shape[1]))
        )
        plane, size = region.astype(np.uint8), (x1 - x0, y1 - y0)
        whole = _cv().resize(plane, size, interpolation=_cv().INTER_NEAREST)
        x, y = (np.arange(a, b, dtype=np.float32) for a, b in ((x0, x1), (y0, y1)))
        _cv().copyTo(self._motion(x, y), whole, motion[y0:y1, x0:x1])


def _hidden(level: Reduced, state: np.ndarray, dominant: np.ndarray) -> np.ndarray:
    """(height, width) bool: places that another place hides in the only neighbour.

    Where their motion and the dominant one lead, others lead and fit better.
    """
    (side,) = level.sides
    way, cost = way_of(state, side).reshape(-1, 2), level.cost(state)
    first = np.full(cost.size, -1)  # the place that leads to each and fits best
    order = np.argsort(-cost, axis=None, kind="stable")
    first[level.places(way_of(state, side)).flat[order]] = order
    hidden = np.ones(cost.shape, bool)
    for one in (state, dominant):
        other = first[level.places(way_of(one, side))]
        apart = np.abs(way_of(one, side) - way[other]).max(axis=2) > _SAME
        hidden &= (other >= 0) & apart & (level.cost(one) - cost.flat[other] > 0)
    return _cv().medianBlur(hidden.astype(np.uint8), 5) > 0
