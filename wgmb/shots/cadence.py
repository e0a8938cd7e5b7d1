"""Pictures of a steady rate that a faster file repeats in turn, such as film of 24 in a file of 30.

Each is shown from the next place on that the file has, so that they come at uneven times, though
the motion in them is even. They get their own times again, evenly around those of the file.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from .picture import Picture

LONGEST = 5  # pictures after which a cadence begins again: 25 a second in a file of 30
_TIMES = 3  # that it is seen in a row
_AROUND = _TIMES * LONGEST  # pictures after one, and before it, among which it is looked for
_STEADY = 0.25  # of the file's interval, by which its own times may be uneven

T = TypeVar("T")


def at_own_times(pictures: Iterator[Picture[T]]) -> Iterator[Picture[T]]:
    """The pictures, which lack those that are repeated, at times that are even in a cadence."""
    ahead: deque[Picture[T]] = deque()
    places: deque[tuple[int, float]] = deque(maxlen=2 * _AROUND + 1)  # number and time in the file
    after = 0  # of the places, those that are ahead
    while True:
        while len(ahead) <= _AROUND and (one := next(pictures, None)) is not None:
            ahead.append(one)
            places.append((one.number, one.time))
        if not ahead:
            return
        after = len(ahead) - 1
        picture = ahead.popleft()
        yield replace(picture, time=_own_time(list(places), len(places) - 1 - after))


def _own_time(places: Sequence[tuple[int, float]], index: int) -> float:
    """The time of a picture among others: in the first cadence that holds it, or as in the file."""
    numbers, times = np.array([n for n, _ in places]), np.array([t for _, t in places])
    for first in range(index, max(index - _AROUND, 0) - 1, -1):
        part = slice(first, first + _AROUND + 1)
        if (line := _steady(numbers[part], times[part])) is not None:
            return line[0] + line[1] * (index - first)
    return times[index]


def _steady(numbers: np.ndarray, times: np.ndarray) -> tuple[float, float] | None:
    """The first own time and the interval of pictures in a cadence; None if they keep none."""
    gaps = np.diff(numbers)
    if len(gaps) < _TIMES or (gaps == gaps[0]).all():
        return None
    tick = (times[-1] - times[0]) / (numbers[-1] - numbers[0])
    if np.abs(times - times[0] - tick * (numbers - numbers[0])).max() > _STEADY * tick:
        return None
    for length in range(2, min(LONGEST, len(gaps) // _TIMES) + 1):
        if (gaps[length:] == gaps[:-length]).all():
            interval = tick * gaps[:length].sum() / length
            return float((times[:length] - interval * np.arange(length)).mean()), float(interval)
    return None
