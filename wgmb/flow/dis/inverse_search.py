"""Motion by OpenCV's dense inverse search: quick, for slow motion; the extra `flow` brings it.

Kroeger, Timofte, Dai and Van Gool, "Fast Optical Flow using Dense Inverse Search" (2016).
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ... import extras
from ...color.srgb import to_display
from ...errors import InputError
from .consistency import REACH, SPACING, Consistency

QUALITIES = ("fast", "best")
_LEAST = 32  # pixels a side below which OpenCV fails; smaller pictures are continued
_HALVINGS = 2  # of the size at which "fast" ends, and of that by which is told what is lost
_ENDS_AT = 300  # px of the longer side below which "fast" does not end
_APART = 0.005  # per pixel that a motion is off that of most of the picture, by which it is nearer
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
        self._shots: list[Consistency] = []

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion, or what it loses, depends on."""
        return REACH + 1

    def shot(self, load: Load, depth: bool = True) -> DisShot:
        """Motion (height, width, 4) to_prev, to_next [px] and depth of a shot's frames.

        `load(number)`: the picture (height, width, 3 or 4), linear, or (height, width) uint8, its
        display values without colour; None outside the shot. Without `depth` it is None, and the
        motion takes half the time.
        """
        shot = DisShot(self, load, depth)
        self._shots.append(shot.consistency)
        return shot

    @property
    def lost(self) -> int:
        """Number of pictures so far in which something was lost, of those that were `checked`."""
        return sum(shot.lost for shot in self._shots)

    @property
    def checked(self) -> int:
        """Number of pictures so far that lie between two others of their shot."""
        return sum(len(shot.shares) for shot in self._shots)

    def grey(self, color: np.ndarray) -> np.ndarray:
        """A picture's display values without colour, (height, width) uint8."""
        if color.ndim == 2:
            return color
        shown = to_display(np.asarray(color[..., :3], np.float32), 8)
        return self._cv2.cvtColor(shown, self._cv2.COLOR_RGB2GRAY)

    def between(
        self, prev: np.ndarray | None, here: np.ndarray, next: np.ndarray | None, depth: bool
    ) -> Found:
        """Motion and depth of a picture, from the grey of its neighbours, one of which is there."""
        motion = self.motion(prev, here, next)
        if not depth:
            return motion, None
        ways = [motion[..., 2 * k : 2 * k + 2] for k, p in enumerate((prev, next)) if p is not None]
        return motion, functools.reduce(np.minimum, map(self.depth, ways))

    def motion(
        self, prev: np.ndarray | None, here: np.ndarray, next: np.ndarray | None
    ) -> np.ndarray:
        """Motion (height, width, 4) [px] alone."""
        return self._motion(prev, here, next, self._finest(here.shape))

    def tells(
        self, prev: np.ndarray | None, here: np.ndarray, next: np.ndarray | None, motion: np.ndarray
    ) -> np.ndarray:
        """The motion by which is told what is lost in a picture, whose own is `motion`.

        Of "fast" that which ends at a quarter of the size, in small pictures, too: what a finer one
        loses besides is small, and searches find little of it.
        """
        if not self._is_fast or self._finest(here.shape) == _HALVINGS:
            return motion
        return self._motion(prev, here, next, _HALVINGS)

    def change(
        self, prev: np.ndarray | None, here: np.ndarray, next: np.ndarray | None
    ) -> np.ndarray:
        """By how much blocks of `SPACING` differ from each neighbour that is there, 0 to 255."""
        size = tuple(-(-n // SPACING) for n in here.shape[::-1])
        area = self._cv2.INTER_AREA
        return np.minimum.reduce(
            [
                self._cv2.resize(self._cv2.absdiff(here, other), size, interpolation=area)
                for other in (prev, next)
                if other is not None
            ]
        )

    def _motion(
        self, prev: np.ndarray | None, here: np.ndarray, next: np.ndarray | None, finest: int
    ) -> np.ndarray:
        back = None if prev is None else self._way(here, prev, finest)
        ahead = None if next is None else self._way(here, next, finest)
        found = back if back is not None else ahead
        assert found is not None
        back = -found if back is None else back  # a path goes on as on its other side
        ahead = -found if ahead is None else ahead
        return np.concatenate([back, ahead], axis=2)

    def _way(self, here: np.ndarray, other: np.ndarray, finest: int) -> np.ndarray:
        height, width = here.shape
        self._flow.setFinestScale(finest)
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
        height, width = way.shape[:2]
        step = max(1, max(width, height) // 40)
        y, x = np.mgrid[step // 2 : height : step, step // 2 : width : step]
        points = np.stack([x.ravel(), y.ravel()], 1).astype(np.float64)
        moved = points + way[y, x].reshape(-1, 2)
        most = np.eye(3)
        if len(points) >= 4:
            fitted, _ = self._cv2.findHomography(points, moved, self._cv2.RANSAC, 3.0)
            most = most if fitted is None else fitted
        # In place: the pages of large arrays cost as much as the arithmetic.
        y, x = np.arange(height, dtype=np.float32)[:, None], np.arange(width, dtype=np.float32)
        across, down, scale = (a * x + (b * y + c) for a, b, c in most.astype(np.float32))
        for off, place, moved in ((across, x, way[..., 0]), (down, y, way[..., 1])):
            off /= scale
            off -= place
            off -= moved
        np.hypot(across, down, out=across)
        across *= _APART
        across += 1
        return self._cv2.medianBlur(np.reciprocal(across, out=across), 5)


class DisShot:
    """Motion of the pictures of a shot by a Dis, and what it loses in them; made by `Dis.shot`."""

    def __init__(self, dis: Dis, load: Load, depth: bool):
        self._dis, self._load, self._depth = dis, load, depth
        self._grey: dict[int, np.ndarray | None] = {}
        self._ahead: dict[int, Found] = {}
        self.consistency = Consistency()

    def __call__(self, number: int) -> Found | None:
        """Motion (height, width, 4) [px] and depth of a picture; None where it is alone."""
        return self._ahead.pop(number, None) or self._motion_of(number)

    def loses(self, number: int) -> bool:
        """True if too much is lost in a picture or one beside it, whatever was asked for before.

        Their motion is found for that, and kept until it is asked for.
        """
        for old in [n for n in self._ahead if n < number - 1]:
            del self._ahead[old]
        for n in range(number - REACH, number + REACH + 1):
            if not self.consistency.knows(n) and (found := self._motion_of(n)) is not None:
                self._ahead[n] = found
        return any(self.consistency.loses.get(n) for n in (number - 1, number, number + 1))

    def _picture(self, number: int) -> np.ndarray | None:
        if number not in self._grey:
            for old in [n for n in self._grey if abs(n - number) > 2]:
                del self._grey[old]
            color = self._load(number)
            self._grey[number] = None if color is None else self._dis.grey(color)
        return self._grey[number]

    def _motion_of(self, number: int) -> Found | None:
        here = self._picture(number)
        prev, next = (self._picture(number + side) for side in (-1, 1))
        if here is None or (prev is None and next is None):
            return None
        motion, order = self._dis.between(prev, here, next, self._depth)
        change = None
        if prev is not None and next is not None:
            change = self._dis.change(prev, here, next)
        told = self._dis.tells(prev, here, next, motion)
        self.consistency.add(number, told[..., :2], told[..., 2:], change)
        return motion, order
