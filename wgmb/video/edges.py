"""Edges of a picture's motion, where gather is worth its cost: the rule of active_tiles.wgsl."""

from __future__ import annotations

import numpy as np

from ..flow.dis.by_place import changes
from ..gpu import wgsl
from ..shutter import Shutter

_TILES = wgsl.load("methods/gather/tiles/active_tiles.wgsl")
EDGE = float(_TILES.constant("EDGE"))  # px
RADIUS = _TILES.integer("EDGE_RADIUS")  # px
TILE = _TILES.integer("TILE")  # px


class MotionEdges:
    """The edges of the motion (height, width, 4) of a picture [px]."""

    def __init__(self, motion: np.ndarray):
        self._motion, self._changes = motion, changes(motion)

    def within(self, shutter: Shutter, factors: tuple[float, float]) -> bool:
        """True if gather lists a tile, where the motion back and ahead is multiplied by `factors`.

        Only tiles are looked at in which every fourth pixel leaves that possible.
        """
        ways = _ways(shutter, factors)
        possible = np.argwhere(self._changes * ways.sum(axis=1).max() > EDGE)
        largest = np.argsort(-self._changes[tuple(possible.T)], kind="stable")
        return any(self._has_edge(row, column, ways) for row, column in possible[largest])

    def _has_edge(self, row: int, column: int, ways: np.ndarray) -> bool:
        """True if displacements in a tile differ by has_edge() of active_tiles.wgsl."""
        rows, columns = (
            slice(max(0, n * TILE - RADIUS), (n + 1) * TILE + RADIUS) for n in (row, column)
        )
        here = self._motion[rows, columns].reshape(-1, 2, 2)
        return bool((ways @ (here.max(axis=0) - here.min(axis=0)) > EDGE).any())


def _ways(shutter: Shutter, factors: tuple[float, float]) -> np.ndarray:
    """(2, 2): absolute shares of the vectors back and ahead in the displacement at the shutter's
    opening (row 0) and at its closing (row 1)."""
    late = 0.5 * sum(map(abs, shutter.delay))
    opens, closes = shutter.span
    t = np.array([[opens - late], [closes + late]])
    return np.abs(0.5 * t * (t + np.array([-1.0, 1.0]))) * factors
