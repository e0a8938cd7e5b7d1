"""Pictures in time, read once from first to last; cut into shots.

A video is a reel, and so is a sequence of pictures whose rate is to change. Only the pictures
around the present one are kept, however long it is.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from .exposure import Cell, cells
from .shutter import Shutter

_BEYOND = 6  # pictures read beyond an exposure: as far as flow looks
_TO_KEEP = 6  # pictures kept before an exposure

T = TypeVar("T")


@dataclass
class Picture(Generic[T]):
    """One picture of a reel."""

    time: float
    """When it is shown first [s]."""
    content: T
    """The picture itself: whatever the reel's tests for cuts and repeats take."""
    number: int = 0
    """Of the frame in its file."""
    begins_shot: bool = False


class Reel(Generic[T]):
    """Reads `pictures` as far as is asked for; they count from 0 on, without those left out.

    `is_cut(before, after)`: whether a cut lies between the contents of two pictures;
    `known_cuts`: numbers of pictures that begin a shot all the same.
    `is_double(before, after)`: whether a picture only repeats the one before; it is left out, and
    its neighbours' cells reach over its time.
    """

    def __init__(
        self,
        pictures: Iterator[Picture[T]],
        *,
        is_cut: Callable[[T, T], bool] | None = None,
        known_cuts: Collection[int] = (),
        is_double: Callable[[T, T], bool] | None = None,
    ):
        self._pictures = pictures
        self._is_cut, self._is_double = is_cut, is_double
        self._known_cuts = known_cuts
        self._kept: dict[int, Picture[T]] = {}
        self._count = 0
        self._last: Picture[T] | None = None
        self.cuts: list[int] = []
        self.doubles: list[int] = []

    def __getitem__(self, index: int) -> Picture[T]:
        """A picture that is kept; KeyError for others."""
        return self._kept[index]

    def cells(self, at: float, interval: float, shutter: Shutter) -> list[Cell]:
        """The cells of an output frame (see exposure.cells); their indices are the reel's.

        Asked for in the order of time, as what lies before is forgotten.
        """
        self._read_beyond(at + interval * max(shutter.span[1], 0.0))
        here = self._index_at(at)
        first, last = here, here
        while first > min(self._kept) and self.same_shot(first, first - 1):
            first -= 1
        while self.same_shot(last, last + 1):
            last += 1
        times = [self._kept[i].time for i in range(first, last + 1)]
        found = cells(times, at, interval, shutter)
        self._forget_before(min(first + found[0].index, here) - _TO_KEEP)
        return [replace(cell, index=first + cell.index) for cell in found]

    def same_shot(self, index: int, other: int) -> bool:
        """Whether two pictures are kept, and no cut lies between them."""
        first, last = min(index, other), max(index, other)
        if first not in self._kept or last not in self._kept:
            return False
        return not any(self._kept[i].begins_shot for i in range(first + 1, last + 1))

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
                before, after = self._last.content, picture.content
                if self._is_double is not None and self._is_double(before, after):
                    self.doubles.append(picture.number)
                    continue
                if picture.number in self._known_cuts or (
                    self._is_cut is not None and self._is_cut(before, after)
                ):
                    picture.begins_shot = True
                    self.cuts.append(picture.number)
            self._last = picture
            self._kept[self._count] = picture
            self._count += 1
            return True
        return False

    def _forget_before(self, index: int) -> None:
        for old in [i for i in self._kept if i < index and i + 1 in self._kept]:
            del self._kept[old]
