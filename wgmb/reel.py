"""Pictures in time, read once from first to last, with their motion; cut into shots.

A video is a reel, and so is a sequence of pictures whose rate is to change. Only the pictures
around the present one are kept, however long it is.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from .exposure import Cell, cells, evened
from .frame import Frame
from .shutter import Shutter

_BEYOND = 6  # pictures read beyond an exposure: as far as flow looks
_TO_KEEP = 6  # pictures kept before an exposure

Load = Callable[[int], np.ndarray | None]


class MotionSource(Protocol):
    """Motion from pictures: Flow (wgmb/flow) and Dis are two."""

    def shot(self, load: Load) -> Callable[[int], tuple[np.ndarray, np.ndarray] | None]:
        """Motion (height, width, 4) [px] and depth of a shot's frames, by their number.

        `load` gives the picture of a number, or None outside the shot.
        """
        ...


@dataclass
class Picture:
    """One picture of a reel."""

    time: float
    """When it is shown first [s]."""
    color: np.ndarray
    """(height, width, 3 or 4) float, linear, premultiplied."""
    number: int = 0
    """Of the frame in its file."""
    frame: Frame | None = None
    """With its own motion, where that is known."""
    begins_shot: bool = False
    made: Frame | None = field(default=None, repr=False)


class Reel:
    """Reads `pictures` as far as is asked for.

    `is_cut(before, after)`: whether a cut lies between two pictures (height, width, 3 or 4);
    `known_cuts`: numbers of pictures that begin a shot all the same.
    `is_double(before, after)`: whether a picture only repeats the one before; it is left out, and
    its neighbours' cells reach over its time. `motion`: where motion comes from; None: there is
    none, unless the pictures have frames with their own. `holdout` (height, width): 1 stays sharp.
    """

    def __init__(
        self,
        pictures: Iterator[Picture],
        *,
        motion: MotionSource | None = None,
        is_cut: Callable[[np.ndarray, np.ndarray], bool] | None = None,
        known_cuts: Collection[int] = (),
        is_double: Callable[[np.ndarray, np.ndarray], bool] | None = None,
        neighbours: bool = True,
        holdout: np.ndarray | None = None,
    ):
        self._pictures, self._motion = pictures, motion
        self._is_cut, self._is_double = is_cut, is_double
        self._known_cuts = known_cuts
        self._neighbours, self._holdout = neighbours, holdout
        self._kept: dict[int, Picture] = {}
        self._count = 0
        self._last: np.ndarray | None = None
        self._shot: Callable[[int], tuple[np.ndarray, np.ndarray] | None] | None = None
        self._shot_start = 0
        self.cuts: list[int] = []
        self.doubles: list[int] = []

    def parts(self, at: float, interval: float, shutter: Shutter) -> list[tuple[Cell, Frame]]:
        """The cells of an output frame (see exposure.cells) and their frames.

        Asked for in the order of time, as what lies before is forgotten.
        """
        self._read_beyond(at + interval * max(shutter.span[1], 0.0))
        here = self._index_at(at)
        first, last = here, here
        while first > min(self._kept) and not self._kept[first].begins_shot:
            first -= 1
        while last + 1 < self._count and not self._kept[last + 1].begins_shot:
            last += 1
        times = [self._kept[i].time for i in range(first, last + 1)]
        found = cells(times, at, interval, shutter)
        made = [(cell, self._frame(first + cell.index)) for cell in found]
        self._forget_before(min(first + found[0].index, here) - _TO_KEEP)
        return made

    def _index_at(self, time: float) -> int:
        """The picture that is shown at `time`; before the first one, that."""
        shown = [i for i, picture in self._kept.items() if picture.time <= time]
        return max(shown, default=min(self._kept))

    def _read_beyond(self, time: float) -> None:
        beyond = sum(picture.time > time for picture in self._kept.values())
        while beyond < _BEYOND and self._read_one():
            beyond += self._kept[self._count - 1].time > time

    def _read_one(self) -> bool:
        for picture in self._pictures:
            if self._last is not None:
                if self._is_double is not None and self._is_double(self._last, picture.color):
                    self.doubles.append(picture.number)
                    continue
                if self._begins_shot(self._last, picture):
                    picture.begins_shot = True
                    self.cuts.append(picture.number)
            self._last = picture.color
            self._kept[self._count] = picture
            self._count += 1
            return True
        return False

    def _begins_shot(self, before: np.ndarray, picture: Picture) -> bool:
        if picture.number in self._known_cuts:
            return True
        return self._is_cut is not None and self._is_cut(before, picture.color)

    def _forget_before(self, index: int) -> None:
        for old in [i for i in self._kept if i < index and i + 1 in self._kept]:
            del self._kept[old]

    def _load(self, index: int) -> np.ndarray | None:
        """The picture of an index of the present shot, None outside it."""
        if index < self._shot_start or index not in self._kept:
            return None
        return None if self._cut_after(self._shot_start, index) else self._kept[index].color

    def _frame(self, index: int) -> Frame:
        """The picture with its motion, between its neighbours."""
        frame = self._alone(index)
        if self._motion is None or not self._neighbours or "motion" not in frame.has:
            return frame
        prev, after = (
            self._alone(i) if self._same_shot(index, i) else None for i in (index - 1, index + 1)
        )
        return frame.between(prev, after)

    def _same_shot(self, index: int, other: int) -> bool:
        """Whether a neighbour is there, and no cut lies between."""
        return other in self._kept and not self._kept[max(index, other)].begins_shot

    def _cut_after(self, first: int, last: int) -> bool:
        """Whether a cut lies after picture `first`, up to the beginning of `last`."""
        between = (self._kept.get(i) for i in range(first + 1, last + 1))
        return any(picture is not None and picture.begins_shot for picture in between)

    def _alone(self, index: int) -> Frame:
        picture = self._kept[index]
        if picture.made is None:
            picture.made = picture.frame or self._with_motion(index, picture)
        return picture.made

    def _with_motion(self, index: int, picture: Picture) -> Frame:
        if self._motion is None:
            return self._still(picture)
        if self._shot is None or self._cut_after(self._shot_start, index):
            self._shot_start = index
            while self._same_shot(self._shot_start, self._shot_start - 1):
                self._shot_start -= 1
            self._shot = self._motion.shot(self._load)
        found = self._shot(index)
        if found is None:
            return self._still(picture)
        motion, depth = found
        near = [i for i in (index - 1, index, index + 1) if self._same_shot(index, i) or i == index]
        times = np.array([self._kept[i].time for i in near])
        back, ahead = evened(times, near.index(index))
        if (back, ahead) != (1.0, 1.0):
            motion = motion * np.array([back, back, ahead, ahead], np.float32)
        return Frame(
            picture.color,
            motion=motion,
            depth=depth,
            holdout=self._holdout,
            number=picture.number,
        ).locked()

    def _still(self, picture: Picture) -> Frame:
        return Frame(picture.color, number=picture.number).locked()
