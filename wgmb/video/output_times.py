"""The output frames of a video: which part of it they are made from, and when each is shown."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import overload

import numpy as np

from ..errors import InputError
from .clock import Clock, tick
from .read.reader import VideoReader
from .read.timeline import Times

SPARE = Fraction(1, 20)  # of an output frame: less at the end, as files round times, is none
_HELD = Fraction(1, 2)  # of a picture's interval beyond it: less is rounding


@dataclass(frozen=True)
class OutputFrame:
    """An output frame: its number from 0 on; its time and interval [s], on the output's clock."""

    number: int
    time: Fraction
    interval: Fraction


class OutputFrames(Sequence[OutputFrame]):
    """The output frames of a video: at `fps`, or at the times of its own pictures where it is None.

    From the first picture that `clock` lets through to the end of the last one. A last picture that
    is held is shown once more where its own interval ends, so that no time is lost. InputError if
    `clock` lets none through, or if two pictures that it lets through are more than `longest_pause`
    [s] apart and frames of a steady rate would fill the time between.
    """

    def __init__(
        self,
        reader: VideoReader,
        clock: Clock,
        fps: Fraction | None,
        longest_pause: float = math.inf,
    ):
        times = reader.times
        first = 0 if clock.first is None else _count_before(times, clock.first)
        last = len(times) if clock.end is None else _count_before(times, clock.end)
        if first >= last:
            raise InputError(f"{reader.path}: has no pictures in this range")
        self._clock = clock
        self._own: list[Fraction] | None = None
        self._begin = clock.out(times[first])
        self._step = 1 / (fps or reader.rate * clock.speed)
        end = reader.until if clock.end is None else min(reader.until, clock.end)
        if fps is not None:
            _check_pauses(reader, clock, times[first:last], longest_pause)
            self._count = max(1, math.ceil((clock.out(end) - self._begin) * fps - SPARE))
            return
        self._own, self._count = list(times[first:last]), last - first
        again = reader.until - 1 / reader.rate
        if times[-1] + _HELD / reader.rate < again < end:
            self._own.append(again)
            self._count += 1

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> OutputFrame: ...
    @overload
    def __getitem__(self, index: slice) -> list[OutputFrame]: ...
    def __getitem__(self, index: int | slice) -> OutputFrame | list[OutputFrame]:
        numbers = range(self._count)[index]
        return (
            [self._frame(k) for k in numbers]
            if isinstance(numbers, range)
            else self._frame(numbers)
        )

    @property
    def has_own_times(self) -> bool:
        """True if each has the time of a picture, not that of a rate."""
        return self._own is not None

    @property
    def times(self) -> Sequence[Fraction]:
        """Their times [s]; nothing is listed."""
        return _Times(self)

    @property
    def longest(self) -> Fraction:
        """The longest time from one to the next, or their interval [s]."""
        if self._own is None:
            return self._step
        pauses = (after - before for before, after in pairwise(self._own))
        return max(max(pauses, default=Fraction(0)) / self._clock.speed, self._step)

    @property
    def tick(self) -> Fraction:
        """The tick of a clock that all their times are multiples of, and their interval too [s]."""
        if self._own is None:
            return tick(self._begin, self._step)
        return tick(*self.times, self._step)

    @property
    def key(self) -> str:
        """Their number and times, in a text that no other frames have."""
        if self._own is None:
            return f"{self._count} from {self._begin} by {self._step}"
        own = ",".join(map(str, self.times))
        return f"{self._count} by {self._step}, {zlib.crc32(own.encode()):08x}"

    def nearest(self, time: Fraction) -> int:
        """The number of the output frame whose time is nearest to `time` [s], on its clock."""
        if self._own is None:
            return min(max(round((time - self._begin) / self._step), 0), self._count - 1)
        after = _count_before(self._own, self._clock.back(time))
        near = {min(max(n, 0), self._count - 1) for n in (after - 1, after)}
        return min(near, key=lambda n: (abs(self[n].time - time), n))

    def _frame(self, number: int) -> OutputFrame:
        if self._own is None:
            return OutputFrame(number, self._begin + number * self._step, self._step)
        return OutputFrame(number, self._clock.out(self._own[number]), self._step)


class _Times(Sequence[Fraction]):
    """The times of output frames, each made when it is asked for."""

    def __init__(self, frames: OutputFrames):
        self._frames = frames

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> Fraction: ...
    @overload
    def __getitem__(self, index: slice) -> list[Fraction]: ...
    def __getitem__(self, index: int | slice) -> Fraction | list[Fraction]:
        if isinstance(index, slice):
            return [frame.time for frame in self._frames[index]]
        return self._frames[index].time


def _count_before(times: Sequence[Fraction], time: Fraction) -> int:
    """Number of the ascending times before one."""
    low, high = 0, len(times)
    while low < high:
        middle = (low + high) // 2
        low, high = (middle + 1, high) if times[middle] < time else (low, middle)
    return low


def _check_pauses(reader: VideoReader, clock: Clock, times: Times, longest: float) -> None:
    """InputError where a picture is held for longer, up to the next one or to the end."""
    end = reader.until if clock.end is None else min(reader.until, clock.end)
    begins = np.append(times.ticks, int(end / times.base))
    number = int(np.argmax(np.diff(begins)))
    held = int(begins[number + 1] - begins[number]) * times.base
    if held > longest:
        raise InputError(
            f"{reader.path}: a pause of {math.ceil(held):,} s after "
            f"{float(times[number] - reader.times[0]):.2f} s, which frames of a steady rate would "
            f"fill; `longest_pause={math.ceil(held)}` allows it, `begin` and `end` choose a part"
        )
