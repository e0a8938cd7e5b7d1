"""Pictures in time, read once from first to last; cut into shots.

Only the pictures around the present one are kept, however many there are.

A flash is no shot: a picture, or some for up to a 24th of a second, that differ from those around
them, which agree with each other. They are exposed with those around, but no motion leads to them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator
from typing import Generic, Protocol, TypeVar

from ..exposure import Cell, cells_in_shot
from ..shutter import Shutter
from .cadence import at_own_times
from .picture import Picture as Picture
from .repeats import Change, without_repeats

REACH = 6  # pictures kept before an exposure and read beyond it, where motion looks no farther
FLASH = 1.01 / 24  # seconds that a flash of several pictures lasts at most
LONGEST = 10  # pictures of a flash at most

T = TypeVar("T")


class NoPicturesError(Exception):
    """There is no picture at all."""


class Shots(Protocol[T]):
    """Pictures by their indices, and where motion leads from one to another."""

    tolerance: float
    """By how much their times may be rounded [s]."""

    def __getitem__(self, index: int) -> Picture[T]:
        """A picture that is there; KeyError for others."""
        ...

    def neighbour(self, index: int, side: int) -> int | None:
        """The picture before (-1) or after (1) another one in its shot; None if there is none."""
        ...

    def moves_on(self, index: int, other: int) -> bool:
        """True if two pictures are there, and neither a cut nor a flash lies between them."""
        ...


class ShotReader(Generic[T]):
    """Reads `pictures` as far as is asked for; they count from 0 on, without those left out.

    `is_cut(before, after)`: whether a cut lies between the contents of two pictures;
    `known_cuts`: numbers of pictures that begin a shot all the same.
    `change`: see repeats.py; pictures that only repeat the one before are left out, and the cells
    of their neighbours reach over their time; those of a cadence are evened out (cadence.py).
    `reach`: pictures that are kept before those asked for, and read beyond them.
    `flash`: how long a flash of several pictures lasts at most [s]. `tolerance`: by how much the
    file may have rounded a picture's time [s]; so much earlier, it is shown already.
    """

    def __init__(
        self,
        pictures: Iterator[Picture[T]],
        *,
        is_cut: Callable[[T, T], bool] | None = None,
        known_cuts: Collection[int] = (),
        change: Change[T] | None = None,
        reach: int = REACH,
        flash: float = FLASH,
        tolerance: float = 0.0,
    ):
        self.doubles: list[int] = []
        if change is not None:
            pictures = at_own_times(without_repeats(pictures, change, is_cut, self.doubles))
        self._pictures, self.tolerance, self._is_cut = pictures, tolerance, is_cut
        self._known_cuts, self._flash, self._reach = known_cuts, flash, reach
        self._kept: dict[int, Picture[T]] = {}
        self._count = 0
        self._last: Picture[T] | None = None
        self._waiting: deque[Picture[T]] = deque()  # read, to tell a flash from a shot
        self._flash_ends = float("-inf")
        self.cuts: list[int] = []
        self.flashes: list[int] = []

    def __getitem__(self, index: int) -> Picture[T]:
        """A picture that is kept; KeyError for others."""
        return self._kept[index]

    @property
    def kept(self) -> range:
        """Indices of the pictures that are kept."""
        return range(min(self._kept, default=0), max(self._kept, default=-1) + 1)

    def at(self, time: float, behind: int = 0) -> int:
        """The index of the picture that is shown at `time`; some after it are kept, too.

        Asked for in the order of time, or as far back as is kept: `behind` pictures, and not less
        than the reach. NoPicturesError if there are none.
        """
        self.read_beyond(time)
        here = self._index_at(time)
        self._forget_before(here - max(behind, self._reach))
        return here

    def cells(self, at: float, interval: float, shutter: Shutter) -> list[Cell]:
        """The cells of an output frame (see exposure.py); their indices are the reader's.

        Requests must be in the order of time, as earlier pictures are forgotten.
        """
        self.read_beyond(at + interval * max(shutter.span[1], 0.0))
        here = self._index_at(at)

        def time(index: int) -> float:
            return self._kept[index].time

        found = cells_in_shot(here, self.neighbour, time, at, interval, shutter)
        self._forget_before(min(found[0].index, here) - self._reach)
        return found

    def neighbour(self, index: int, side: int) -> int | None:
        """The picture before (-1) or after (1) another one in its shot; None if none is kept."""
        return index + side if self.same_shot(index, index + side) else None

    def same_shot(self, index: int, other: int) -> bool:
        """True if two pictures are kept, and no cut lies between them."""
        between = self._up_to(index, other)
        return between is not None and not any(picture.begins_shot for picture in between)

    def moves_on(self, index: int, other: int) -> bool:
        """True if two pictures are kept, and neither a cut nor a flash lies between them."""
        between = self._up_to(index, other)
        return between is not None and not any(picture.breaks_motion for picture in between)

    def _up_to(self, index: int, other: int) -> list[Picture[T]] | None:
        """The pictures after the first of two up to the other; None unless both are kept."""
        first, last = min(index, other), max(index, other)
        if first not in self._kept or last not in self._kept:
            return None
        return [self._kept[i] for i in range(first + 1, last + 1)]

    def _index_at(self, time: float) -> int:
        """The picture that is shown at `time`; before the first one, that."""
        if not self._kept:
            raise NoPicturesError
        shown = [i for i, picture in self._kept.items() if picture.time <= time + self.tolerance]
        return max(shown, default=min(self._kept))

    def read_beyond(self, time: float) -> None:
        """Read some pictures after the one that is shown at `time`, as far as there are."""
        beyond = sum(picture.time > time for picture in self._kept.values())
        while beyond < self._reach and self._read_one():
            beyond += self._kept[self._count - 1].time > time

    def _read_one(self) -> bool:
        picture = self._next()
        if picture is None:
            return False
        if self._last is not None:
            self._compare(self._last, picture)
        self._last = picture
        self._kept[self._count] = picture
        self._count += 1
        return True

    def _compare(self, before: Picture[T], picture: Picture[T]) -> None:
        """Tell whether a shot or a flash begins with a picture."""
        if picture.number in self._known_cuts:
            picture.begins_shot = picture.breaks_motion = True
        elif self._is_cut is not None and self._is_cut(before.content, picture.content):
            picture.breaks_motion = True
            ends = self._end_of_flash(before, picture, self._is_cut)
            if ends is not None:
                self.flashes.append(picture.number)
                self._flash_ends = max(self._flash_ends, ends)
            picture.begins_shot = picture.time > self._flash_ends
        if picture.begins_shot:
            self.cuts.append(picture.number)

    def _end_of_flash(
        self, before: Picture[T], begins: Picture[T], is_cut: Callable[[T, T], bool]
    ) -> float | None:
        """Time of the first picture that continues `before`; None if none does soon."""
        for ahead in range(LONGEST):
            picture = self._ahead(ahead)
            if picture is None or picture.number in self._known_cuts:
                return None
            if ahead and picture.time > begins.time + self._flash:
                return None
            if not is_cut(before.content, picture.content):
                return picture.time
        return None

    def _next(self) -> Picture[T] | None:
        """The next picture that is not left out."""
        if self._ahead(0) is None:
            return None
        return self._waiting.popleft()

    def _ahead(self, count: int) -> Picture[T] | None:
        """The picture that will be next after `count` others; None after the last one."""
        while len(self._waiting) <= count:
            picture = next(self._pictures, None)
            if picture is None:
                return None
            self._waiting.append(picture)
        return self._waiting[count]

    def _forget_before(self, index: int) -> None:
        for old in [i for i in self._kept if i < index and i + 1 in self._kept]:
            del self._kept[old]
