"""The input frames that an output frame is made of, when their rates differ.

Several input frames may share the exposure of an output frame. Every input frame stands for its
*cell*: the time from half-way to the frame before to half-way to the next one. It is blurred over
the part of its cell that is exposed, and counts as much as the shutter weighs that part. One rule
so covers 240 frames a second made 60, 144 made 60, 24 as 24, and variable rates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .errors import InputError
from .shutter import Shutter

_ROUNDING = 1e-9  # of an interval: what is left of equal intervals in floating point
_LEAST = 1e-9  # share of an exposure that is worth a picture


@dataclass(frozen=True)
class Cell:
    """The part of an exposure that one input frame stands for."""

    index: int
    """Of the frame, in the times that were given."""
    share: float
    """Of the exposure, 0..1; those of all cells of an exposure add up to 1."""
    shutter: Shutter
    """For the frame's blur: open while its cell is exposed, in the frame's own interval."""


def cells(times: Sequence[float], at: float, interval: float, shutter: Shutter) -> list[Cell]:
    """The cells of the exposure of an output frame.

    `times`: of the input frames [s], ascending, with no cut between them. `at`: of the output frame
    [s]; `interval` between output frames [s], which `shutter` is in. Exposure before
    the first cell and after the last one is left out; if that is all, the nearest frame is taken as
    it is. InputError for a rolling shutter, and for times that do not ascend.
    """
    if shutter.rolling is not None:
        raise InputError("a rolling shutter needs frames of the output's own rate")
    here = np.asarray(times, np.float64)
    if not len(here) or not (np.diff(here) > 0).all():
        raise InputError("times of frames must ascend")
    ends = (here[1:] + here[:-1]) / 2
    first, last = here[0] - own_interval(here, 0) / 2, here[-1] + own_interval(here, -1) / 2
    borders = np.concatenate([[first], ends, [last]])
    opens, closes = (at + interval * t for t in shutter.span)
    parts = []
    reached = np.searchsorted(borders, (opens, closes), side="right") - 1
    for index in range(max(int(reached[0]), 0), min(int(reached[1]), len(here) - 1) + 1):
        begin, end = max(opens, borders[index]), min(closes, borders[index + 1])
        inner = (begin - at) / interval, (end - at) / interval
        share = shutter.share(*inner) if closes > opens else 1.0
        if share >= _LEAST:
            own = own_interval(here, index)
            part = shutter.part(*inner).timed(interval / own, (at - here[index]) / own)
            parts.append(Cell(index, share, part))
    if not parts:
        nearest = int(np.abs(here - np.clip(at, opens, closes)).argmin())
        return [Cell(nearest, 1.0, Shutter(0))]
    total = sum(cell.share for cell in parts)
    return [Cell(cell.index, cell.share / total, cell.shutter) for cell in parts]


def cells_in_shot(
    here: int,
    neighbour: Callable[[int, int], int | None],
    time: Callable[[int], float],
    at: float,
    interval: float,
    shutter: Shutter,
) -> list[Cell]:
    """The cells of an exposure of one shot; their indices are the numbers of its frames.

    `here`: the frame that is shown at `at`. `neighbour`: the frame before (-1) or after (1) another
    one in the shot, None if there is none; asked for as far as the exposure reaches, and once more
    on either side. `time`: when a frame is shown [s]. All else as for `cells`.
    """
    opens, closes = (at + interval * t for t in shutter.span)
    numbers, times = [here], [time(here)]
    while len(numbers) == 1 or times[0] + times[1] > 2 * opens:
        if (before := neighbour(numbers[0], -1)) is None:
            break
        numbers.insert(0, before)
        times.insert(0, time(before))
    while numbers[-1] == here or times[-1] + times[-2] <= 2 * closes:
        if (after := neighbour(numbers[-1], 1)) is None:
            break
        numbers.append(after)
        times.append(time(after))
    parts = cells(times, at, interval, shutter)
    return [replace(cell, index=numbers[cell.index]) for cell in parts]


def own_interval(times: np.ndarray, index: int) -> float:
    """Time [s] that counts as a frame's interval: half of that from the frame before to the next.

    At the ends, the time to the only neighbour; for a single frame 1.
    """
    index %= len(times)
    near = times[max(index - 1, 0) : index + 2]
    return float(near[-1] - near[0]) / (len(near) - 1) if len(near) > 1 else 1.0


def evened(
    times: np.ndarray,
    index: int,
    known: tuple[bool, bool] = (True, True),
    tolerance: float = 0.0,
) -> tuple[float, float]:
    """Factors that turn a frame's way to its neighbours into ways in its own interval.

    To the previous, to the next frame; 1 where there is none. `known`: whether its way to each of
    them is; where only one is, the other goes straight on from it. `tolerance`: by how much times
    may be rounded [s]; intervals that differ by no more than that are equal.
    """
    own = own_interval(times, index)
    near = np.diff(times[max(index - 1, 0) : index + 2])
    if not len(near) or np.ptp(near) <= 2 * tolerance + _ROUNDING * own:
        return 1.0, 1.0
    back = own / (times[index] - times[index - 1]) if index > 0 else 1.0
    ahead = own / (times[index + 1] - times[index]) if index + 1 < len(times) else 1.0
    if known == (False, True):
        back = ahead
    elif known == (True, False):
        ahead = back
    return float(back), float(ahead)
