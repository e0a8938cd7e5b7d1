"""Motion by OpenCV's dense inverse search: quick, for slow motion; the extra `flow` brings it.

Kroeger, Timofte, Dai and Van Gool, "Fast Optical Flow using Dense Inverse Search" (2016).
"""

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from ... import extras
from ...color.srgb import to_display
from ...errors import InputError
from .homographies import homography_of, ways_of

QUALITIES = ("fast", "best")
_LEAST = 32  # pixels a side below which OpenCV fails; smaller pictures are continued
_HALVINGS = 2  # of the size at which "fast" ends, at most
_ENDS_AT = 300  # px of the longer side below which "fast" does not end
_REFINEMENTS = (
    1  # steps of variational refinement a level; five take twice as long, at the same FLIP
)
_APART = 0.005  # per pixel that a motion is off that of most of the picture, by which it is nearer
KEPT = 3  # pictures to either side of one whose motion is kept
Pictures = Sequence[np.ndarray | None]
"""Previous, own, next: (height, width) uint8, None where one lacks."""
Load = Callable[[int], np.ndarray | None]
Found = tuple[np.ndarray, np.ndarray | None]


class Dis:
    """Motion and depth order of pictures by dense inverse search, on the CPU.

    `quality`: "best" ends at full size; "fast" at a quarter of it, and pictures whose longer side
    is below 1200 px at half of it, those below 600 px at full size.
    """

    def __init__(self, quality: str = "fast"):
        if quality not in QUALITIES:
            raise InputError(f"`quality` must be one of {', '.join(QUALITIES)}, got {quality!r}")
        with extras.needed_by("dense inverse search"):
            cv2: Any = importlib.import_module("cv2")

        self._cv2 = cv2
        self._is_fast = quality == "fast"
        preset = (
            cv2.DISOPTICAL_FLOW_PRESET_FAST if self._is_fast else cv2.DISOPTICAL_FLOW_PRESET_MEDIUM
        )
        self._flow: Any = cv2.DISOpticalFlow_create(preset)
        self._flow.setVariationalRefinementIterations(_REFINEMENTS)

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion depends on."""
        return 1

    def shot(self, load: Load, depth: bool = True) -> DisShot:
        """Motion (height, width, 4) to_prev, to_next [px] and depth of a shot's frames.

        `load(number)`: the picture (height, width, 3 or 4), linear, or (height, width) uint8, its
        display values without colour; None outside the shot. Without `depth` it is None, and the
        motion takes half the time.
        """
        return DisShot(self, load, depth)

    def grey(self, color: np.ndarray) -> np.ndarray:
        """A picture's display values without colour, (height, width) uint8."""
        if color.ndim == 2:
            return color
        shown = to_display(np.asarray(color[..., :3], np.float32), 8)
        return self._cv2.cvtColor(shown, self._cv2.COLOR_RGB2GRAY)

    def motion(self, pictures: Pictures) -> np.ndarray:
        """That of a picture, (height, width) uint8, between its neighbours; one may lack."""
        prev, here, next = pictures
        assert here is not None
        back = None if prev is None else self._way(here, prev)
        ahead = None if next is None else self._way(here, next)
        found = back if back is not None else ahead
        assert found is not None
        back = -found if back is None else back  # a path goes on as on its other side
        ahead = -found if ahead is None else ahead
        return self._cv2.merge([back, ahead])

    def _way(self, here: np.ndarray, other: np.ndarray) -> np.ndarray:
        height, width = here.shape
        self._flow.setFinestScale(self._finest(here.shape))
        if min(here.shape) >= _LEAST:
            return self._flow.calc(here, other, None)
        more = 0, max(_LEAST - height, 0), 0, max(_LEAST - width, 0)  # above, below, left, right
        edge = self._cv2.BORDER_REPLICATE
        grown = (self._cv2.copyMakeBorder(p, *more, edge) for p in (here, other))
        return np.ascontiguousarray(self._flow.calc(*grown, None)[:height, :width])

    def _finest(self, shape: tuple[int, ...]) -> int:
        """The level at which the motion of a picture ends; each halves the size, 0 is full."""
        if not self._is_fast:
            return 0
        halvings = int(math.log2(max(1.0, max(shape) / _ENDS_AT)))
        return min(halvings, _HALVINGS)

    def depth(self, way: np.ndarray) -> np.ndarray:
        """Depth by motion (height, width, 2) [px] to a neighbour, (height, width).

        Pixels that do not move like most of the picture are nearer.
        """
        y, x = (np.arange(n, dtype=np.float32) for n in way.shape[:2])
        across, down = ways_of(homography_of(way), x, y[:, None])
        across -= way[..., 0]
        down -= way[..., 1]
        np.hypot(across, down, out=across)
        across *= _APART
        across += 1
        return self._cv2.medianBlur(np.reciprocal(across, out=across), 5)


class Source(Protocol):
    """Motion and depth from three pictures without colour; Dis and ByPlace are two."""

    def grey(self, color: np.ndarray) -> np.ndarray:
        """A picture's display values without colour, (height, width) uint8."""
        ...

    def motion(self, pictures: Pictures) -> np.ndarray:
        """That of a picture (height, width, 4) [px] between its neighbours; one may lack."""
        ...

    def depth(self, way: np.ndarray) -> np.ndarray:
        """Depth (height, width) by motion (height, width, 2) [px] to a neighbour."""
        ...


class DisShot:
    """Motion of the pictures of a shot by a source, each found once; made by `Dis.shot`."""

    def __init__(self, source: Source, load: Load, depth: bool):
        self._source, self._load, self._depth = source, load, depth
        self._grey: dict[int, np.ndarray | None] = {}
        self._motion: dict[int, np.ndarray | None] = {}

    def __call__(self, number: int) -> Found | None:
        """Motion (height, width, 4) [px] and depth of a picture; None where it is alone."""
        motion = self.motion(number)
        if motion is None:
            return None
        return motion, self.depth(number) if self._depth else None

    def motion(self, number: int) -> np.ndarray | None:
        """Motion (height, width, 4) [px] of a picture; None where it is alone."""
        return _kept(self._motion, number, self._motion_of)

    def depth(self, number: int) -> np.ndarray | None:
        """Depth order (height, width) of a picture, whether or not it is wanted of all."""
        motion = self.motion(number)
        if motion is None:
            return None
        there = [self._picture(number + side) is not None for side in (-1, 1)]
        ways = [motion[..., 2 * k : 2 * k + 2] for k in (0, 1) if there[k]]
        return functools.reduce(np.minimum, map(self._source.depth, ways))

    def _motion_of(self, number: int) -> np.ndarray | None:
        prev, here, next = (self._picture(number + side) for side in (-1, 0, 1))
        if here is None or (prev is None and next is None):
            return None
        return self._source.motion([prev, here, next])

    def _picture(self, number: int) -> np.ndarray | None:
        def grey(number: int) -> np.ndarray | None:
            picture = self._load(number)
            return None if picture is None else self._source.grey(picture)

        return _kept(self._grey, number, grey)


def _kept(known: dict[int, Any], number: int, make: Callable[[int], Any]) -> Any:
    """The value of a number, which is made once; those of far numbers are forgotten."""
    if number not in known:
        for old in [n for n in known if abs(n - number) > KEPT]:
            del known[old]
        known[number] = make(number)
    return known[number]
