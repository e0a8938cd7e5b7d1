"""The pictures that an output frame of a video is exposed from, as far as they are known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from ...exposure import Cell, cells_in_shot
from ...shutter import Shutter
from ...video.clock import Clock
from ...video.output_times import OutputFrame
from ...video.read.timeline import Times
from .video_motion import PictureFinding

Knowledge = Callable[[int], PictureFinding | None]
"""The finding about a picture, by its number; None until there is one."""


@dataclass(frozen=True)
class VideoExposure:
    """An output frame, made of pictures of one shot."""

    here: int
    """The picture that is shown at its time."""
    cells: tuple[Cell, ...]
    """Their parts of the exposure; the indices are pictures' numbers."""
    lacking: tuple[int, ...]
    """Pictures nothing is known of, on which the exposure depends."""


def exposure_of(
    times: Times, clock: Clock, frame: OutputFrame, shutter: Shutter, known: Knowledge
) -> VideoExposure:
    """The exposure of an output frame; where motion is missing, of the pictures that have it."""
    shown = picture_at(times, clock, frame)
    here, lacking = _kept(shown, known)

    def time(number: int) -> float:
        return float(clock.out(times[number]))

    def neighbour(number: int, side: int) -> int | None:
        return _neighbour(number, side, known, lacking)

    at, interval = float(frame.time), float(frame.interval)
    cells = cells_in_shot(here, neighbour, time, at, interval, shutter)
    return VideoExposure(here, tuple(cells), tuple(dict.fromkeys(lacking)))


def picture_at(times: Times, clock: Clock, frame: OutputFrame) -> int:
    """The picture that is shown at an output frame's time; before the first one, that."""
    tick = clock.back(frame.time) / times.base
    after = int(np.searchsorted(times.ticks, tick.numerator // tick.denominator, side="right"))
    return max(after - 1, 0)


def reach(times: Times, clock: Clock, frame: OutputFrame, shutter: Shutter) -> tuple[int, int]:
    """First and last picture of an exposure, if there is no cut and no repeat among them."""
    at = clock.back(frame.time)
    opens, closes = (
        float((at + Fraction(t) * frame.interval * clock.speed) / times.base) for t in shutter.span
    )
    first = last = picture_at(times, clock, frame)
    while first > 0 and _middle(times, first) > opens:
        first -= 1
    while last + 1 < len(times) and _middle(times, last + 1) < closes:
        last += 1
    return first, last


def _middle(times: Times, number: int) -> float:
    """Half-way from the picture before one [ticks]."""
    return (int(times.ticks[number]) + int(times.ticks[number - 1])) / 2


def _kept(number: int, known: Knowledge) -> tuple[int, list[int]]:
    """The picture that stands for one: itself, or where it is left out the one before."""
    found = known(number)
    if found is None:
        return number, [number]
    if not found.is_left_out:
        return number, []
    before = found.after if found.before is None else found.before
    if before is None:
        return number, []
    return before, [] if known(before) is not None else [before]


def _neighbour(number: int, side: int, known: Knowledge, lacking: list[int]) -> int | None:
    """The picture before (-1) or after (1) one in its shot; None if there is none, or unknown."""
    here = known(number)
    if here is None:
        lacking.append(number)
        return None
    if side < 0:
        return None if here.begins_shot else here.before
    return None if here.ends_shot else here.after
