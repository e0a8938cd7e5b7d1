"""Motion of pictures by dense inverse search, finer and searched in blocks where it must be."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from .blocks import Reduced, raised, searched
from .cost import is_better
from .dominant import Dominant
from .inverse_search import Dis, DisShot, Load, Pictures

TILE = 16  # px
THIN = 4  # px from one pixel whose motion is looked at to the next
UNEVEN = 8.0  # px per frame interval, by which motion that is made finer changes within a tile
OTHER = 0.05  # share of a tile that moves otherwise
AROUND = 32  # px around tiles that are seen where their motion is made finer
JOINED = 1.1  # boxes are joined where the one around them is larger by less
MARGIN = 1.6  # times the cost of dense inverse search that the motion of blocks may have
Box = tuple[slice, slice]


def _cv() -> Any:
    """OpenCV, which is optional."""
    return importlib.import_module("cv2")


class ByPlace:
    """Motion and depth order of pictures by dense inverse search, better where that is not enough.

    It is made finer in tiles where motion changes by over `UNEVEN` px, or fits neither neighbour;
    there, blocks are searched (blocks.py), and taken where they fit better.
    """

    def __init__(self) -> None:
        self._quick, self._fine = Dis("fast"), Dis("best")
        self.grey, self.depth = self._quick.grey, self._quick.depth

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion depends on."""
        return 1

    def shot(self, load: Load, depth: bool = True) -> PlaceShot:
        """Motion (height, width, 4) [px] of a shot's pictures, and depth.

        `load(number)`: the picture (height, width) uint8, or linear (height, width, 3 or 4).
        """
        return PlaceShot(self, load, depth)

    def motion(self, pictures: Pictures) -> np.ndarray:
        """That of a picture, (height, width) uint8, between its neighbours; one may lack."""
        here = pictures[1]
        assert here is not None
        motion = self._quick.motion(pictures)
        dominant = Dominant(pictures, motion)
        motion = dominant.put(motion)
        wanted = uneven(motion, UNEVEN)
        found = searched(pictures, motion)
        if found is not None:
            size = wanted.shape[::-1]
            wanted |= _cv().resize(found.other, size, interpolation=_cv().INTER_AREA) > OTHER
        wanted = _cv().dilate(wanted.astype(np.uint8), np.ones((3, 3), np.uint8))
        if not wanted.any():
            return motion
        whole = Reduced(pictures, max(here.shape)) if found else None
        takes = _cv().resize(wanted, None, fx=TILE, fy=TILE, interpolation=_cv().INTER_NEAREST)
        for box in _boxes(wanted, here.shape):
            part = [None if p is None else np.ascontiguousarray(p[box]) for p in pictures]
            one = self._fine.motion(part)
            if found is not None and whole is not None:
                other = raised(found.level, whole, found.state, box)
                _cv().copyTo(other, is_better(part, one, other, MARGIN).view(np.uint8), one)
            _cv().copyTo(one, takes[box], motion[box])
        return dominant.put(motion)


def uneven(motion: np.ndarray, least: float) -> np.ndarray:
    """(rows, columns) bool: tiles in which motion (height, width, 4) changes by over `least` px."""
    return changes(motion) > least


def changes(motion: np.ndarray) -> np.ndarray:
    """(rows, columns) by how much the motion changes in each tile and beside it [px]."""
    thin, side = motion[THIN // 2 :: THIN, THIN // 2 :: THIN], TILE // THIN
    if not thin.size:
        thin = motion[:1, :1]
    kernel = np.ones((side + 1, side + 1), np.uint8)
    change = (_cv().dilate(thin, kernel) - _cv().erode(thin, kernel)).max(axis=2)
    rows, columns = (-(-n // TILE) for n in motion.shape[:2])
    at = (
        np.minimum(np.arange(n) * side + side // 2, m - 1)
        for n, m in zip((rows, columns), change.shape, strict=True)
    )
    return change[np.ix_(*at)]


def _boxes(tiles: np.ndarray, shape: tuple[int, ...]) -> list[Box]:
    """Boxes of pixels around tiles that are beside each other, with what must be seen there."""
    height, width = shape
    *_, found, _ = _cv().connectedComponentsWithStats(tiles)
    boxes = [
        (max(0, y * TILE - AROUND), min(height, (y + rows) * TILE + AROUND),
         max(0, x * TILE - AROUND), min(width, (x + columns) * TILE + AROUND))
        for x, y, columns, rows, _ in found[1:].tolist()
    ]  # fmt: skip
    while pair := next(_joined(boxes), None):
        one, two, both = pair
        boxes = [box for k, box in enumerate(boxes) if k not in (one, two)] + [both]
    return [(slice(top, bottom), slice(left, right)) for top, bottom, left, right in sorted(boxes)]


def _joined(boxes: list[tuple[int, ...]]) -> Iterator[tuple[int, int, tuple[int, ...]]]:
    """Pairs of boxes that are hardly smaller than the one around both, and that."""

    def area(box: tuple[int, ...]) -> int:
        return (box[1] - box[0]) * (box[3] - box[2])

    for k, a in enumerate(boxes):
        for m, b in enumerate(boxes[:k]):
            both = min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])
            if area(both) <= JOINED * (area(a) + area(b)):
                yield m, k, both


class PlaceShot(DisShot):
    """Motion of the pictures of a shot by a ByPlace; made by `ByPlace.shot`."""
