"""Times of the pictures of a video: one pass over its packets, without decoding.

Times are those in the file, on the clock that all its streams share: with edit lists, late starts
and variable rates. The number of a picture says nothing about its time.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from math import lcm
from pathlib import Path
from typing import overload

import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.format import Flags
from av.stream import Disposition
from av.video.stream import VideoStream

from .packets import PictureTimes, completed, justified

KNOWN_RATES = tuple(
    Fraction(rate)
    for rate in (
        "10", "12", "12.5", "15000/1001", "15", "18", "20", "24000/1001", "24", "25", "30000/1001",
        "30", "48000/1001", "48", "50", "60000/1001", "60", "72", "75", "90", "96", "100",
        "120000/1001", "120", "144", "165", "180", "200", "240000/1001", "240", "300", "360",
        "480", "500", "960", "1000",
    )
)  # fmt: skip
_NEAR = 1e-3  # of a rate: it is taken for the known one
_ROUNDED = 1.001  # ticks by which times differ at most from those of a rate
_STATED = 1e-4  # the same of a rate that the file states
_UNEVEN = 0.02  # of a step: more is a variable rate
_JITTER = 0.25  # of a step: less is a rate all the same
_SELDOM = 0.05  # of the steps: if more are uneven, the rate varies
_ANIMATIONS = ("gif", "apng")
_SHORTEST_DELAY, _DELAY = 2, 10  # of a GIF [1/100 s]: one that is kept, and the one instead
_FINEST = 1_001_000  # denominator of a rate


class Times(Sequence[Fraction]):
    """Times [s], exact, kept as whole ticks of a clock."""

    def __init__(self, ticks: np.ndarray, base: Fraction):
        self.ticks, self.base = ticks, base

    @overload
    def __getitem__(self, index: int) -> Fraction: ...
    @overload
    def __getitem__(self, index: slice) -> Times: ...
    def __getitem__(self, index: int | slice) -> Fraction | Times:
        if isinstance(index, slice):
            return Times(self.ticks[index], self.base)
        return int(self.ticks[index]) * self.base

    def __len__(self) -> int:
        return len(self.ticks)

    @property
    def seconds(self) -> np.ndarray:
        """All of them as float64."""
        return self.ticks * float(self.base)


@dataclass(frozen=True, eq=False)
class Timeline:
    """The times of the pictures of one stream, and where decoding can begin."""

    times: Times
    keys: np.ndarray
    """Ticks at which pictures are shown that need no other."""
    in_order: bool
    """Decoded pictures are to be counted: their own times are not those in `times`."""
    is_assumed: bool
    """Neither the file nor its codec says when its pictures are shown: the rate is a guess."""
    end: Fraction
    """End of the last packet of any stream [s]."""
    problem: str
    """The reason why the pass ended before the file, or ''."""
    lacks: Fraction = Fraction(0)
    """Duration that the file lacks, by its header [s]."""
    is_encrypted: bool = False
    """Its packets cannot be decoded without a key."""
    stated: Fraction | None = None
    """The known rate that the file states."""
    lasts: Fraction = Fraction(0)
    """Duration of the last picture [s] where the file states that of each; else 0."""
    counted: Timeline | None = None
    """The timeline for decoded pictures that do not come in the order of their times; the times are
    then those of decoding, and pictures are counted. None if that is impossible."""
    repeated: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    """Ticks of pictures that have the time of another one, and so are never shown."""
    begins: dict[int, Fraction] = field(default_factory=dict)
    """The time at which each stream begins, by its number [s]."""
    slowed: int = 0
    """Pictures of a GIF whose delay players do not keep, see `_as_shown`."""
    goes_back: tuple[int, Fraction, Fraction] | None = None
    """The first packet whose clock begins anew: its number, the time before it, its own [s]."""

    @property
    def steps(self) -> np.ndarray:
        """Time from each picture to the next [ticks]."""
        return np.diff(self.times.ticks)

    @cached_property
    def rate(self) -> Fraction:
        """Pictures a second, by the mean of the steps without gaps and hitches; 24 without steps.

        The rate that the file states if all times are multiples of it, rounded; else the nearest
        known rate if it is within 0.1 %, or within the rounding of the clock over a few steps.
        """
        steps = self.steps
        if not len(steps):
            return self.stated or Fraction(24)
        if self.stated is not None and self._keeps(self.stated):
            return self.stated
        middle = np.median(steps)
        usual = steps[(steps > 0.5 * middle) & (steps < 1.5 * middle)]
        usual = usual if len(usual) else steps  # of two lengths, with the middle in neither
        exact = Fraction(len(usual), int(usual.sum())) / self.times.base
        rounding = 0.5 / (float(middle) * len(usual) ** 0.5) if usual.min() < usual.max() else 0
        off = {known: abs(float(known / exact) - 1) for known in KNOWN_RATES}
        nearest = min(off, key=lambda known: off[known])
        if off[nearest] < _NEAR:
            return nearest
        if near := [known for known in off if off[known] < rounding]:
            return min(near, key=lambda known: (known.denominator, off[known]))
        return max(exact.limit_denominator(_FINEST), Fraction(1, _FINEST))

    def _keeps(self, rate: Fraction) -> bool:
        """Return True if all times are those of a rate, rounded to ticks alike."""
        step = float(1 / (rate * self.times.base))
        since = self.times.ticks - self.times.ticks[0]
        places = self._places(rate)
        off = since - places * step
        return bool(np.median(np.diff(places)) == 1 and off.max() - off.min() < _ROUNDED)

    def _places(self, rate: Fraction) -> np.ndarray:
        """Intervals of a rate from the first picture to each, in whole numbers."""
        return np.rint((self.times.ticks - self.times.ticks[0]) * float(self.times.base * rate))

    @cached_property
    def exact(self) -> Sequence[Fraction]:
        """The times, those of the rate where all are that, rounded to ticks."""
        if len(self.times) < 2 or not self._keeps(self.rate):
            return self.times
        finest = lcm(self.times.base.denominator, self.rate.numerator)
        base = Fraction(1, finest)
        first = int(self.times[0] / base)
        return Times(
            first + self._places(self.rate).astype(np.int64) * int(1 / self.rate / base), base
        )

    @property
    def is_variable(self) -> bool:
        """Return True if steps differ by more than the clock's rounding."""
        return bool(self._uneven().any())

    @property
    def until(self) -> Fraction:
        """The end of the last picture [s]."""
        return self.times[-1] + max(self.lasts, 1 / self.rate)

    def _uneven(self, tolerance: float = _UNEVEN) -> np.ndarray:
        return np.abs(self.steps - self._usual) > max(1.0, tolerance * self._usual)

    @property
    def _usual(self) -> float:
        """A step at the rate [ticks]."""
        return float(1 / (self.rate * self.times.base))

    @property
    def has_rate(self) -> bool:
        """Return True if the steps are alike to a quarter, apart from a few pauses."""
        uneven = self._uneven(_JITTER)
        return not uneven.any() or self._are_pauses(uneven)

    def _are_pauses(self, uneven: np.ndarray) -> bool:
        is_seldom = np.count_nonzero(uneven) <= _SELDOM * len(uneven)
        return bool(is_seldom and (self.steps[uneven] >= 1.5 * self._usual).all())

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Gaps of a steady rate: begin and length of each [s]; none if the rate varies."""
        uneven = self._uneven()
        if not self._are_pauses(uneven):
            return []
        base = float(self.times.base)
        places = np.flatnonzero(uneven)
        return [(int(self.times.ticks[n]) * base, int(self.steps[n]) * base) for n in places]

    def from_picture(self, number: int) -> Timeline:
        """The same without the pictures before `number`."""
        return replace(self, times=self.times[number:])

    def doubled(self) -> Timeline:
        """Twice as many pictures: one more half-way to the next of each."""
        ticks, step = 2 * self.times.ticks, round(2 / (self.rate * self.times.base))
        after = np.append(ticks[1:], ticks[-1] + step)
        both = np.stack([ticks, (ticks + after) // 2], 1).ravel()
        times, stated = Times(both, self.times.base / 2), self.stated and 2 * self.stated
        return replace(self, times=times, keys=2 * self.keys, stated=stated)


def scanned(container: InputContainer, stream: VideoStream, path: Path) -> Timeline:
    """Read all packets of a file; the Timeline of one of its streams.

    InputError for more packets than a file of its size has.
    """
    base = stream.time_base or Fraction(1, 90000)
    context = stream.codec_context
    found = PictureTimes(context.name, context.extradata or b"")
    wanted = [s for s in container.streams if not s.disposition & Disposition.attached_pic]
    ends: dict[int, int] = {}
    begins: dict[int, int] = {}
    problem = ""
    try:
        for packet in justified(container.demux(wanted), path):
            if not packet.size:
                continue
            if packet.pts is not None:
                last = packet.pts + (packet.duration or 0)
                ends[packet.stream_index] = max(last, ends.get(packet.stream_index, last))
                if not packet.is_discard:
                    first = begins.get(packet.stream_index, packet.pts)
                    begins[packet.stream_index] = min(packet.pts, first)
            if packet.stream_index == stream.index:
                found.add(packet)
    except FFmpegError as error:
        problem = str(error.strerror or error)
    bases = [one.time_base or base for one in container.streams]
    end = max((n * bases[i] for i, n in ends.items()), default=base)
    times, in_order, is_assumed = _picture_times(container, stream, found)
    timeline = Timeline(times, _sorted(found.keys), in_order, is_assumed, end, problem)
    is_raw = _is_raw(container)
    timeline = replace(
        timeline,
        lacks=_lacking(container, stream, timeline, found.read),
        is_encrypted=found.is_encrypted,
        stated=None if is_raw else known_rate(stream.average_rate),
        lasts=_lasting(stream, found, timeline),
        begins={i: n * bases[i] for i, n in begins.items()},
        goes_back=None if is_assumed else _going_back(found.decoded, base),
    )
    if container.format.name == "gif":
        timeline = _as_shown(timeline)
    if timeline.in_order:
        return timeline
    counted = _counted(timeline, found, bool(stream.codec_context.has_b_frames))
    return replace(timeline, counted=counted, repeated=_repeated(found.presented))


def _picture_times(
    container: InputContainer, stream: VideoStream, packets: PictureTimes
) -> tuple[Times, bool, bool]:
    """The times of the pictures; whether they are to be counted; whether their rate is a guess.

    A format without times has the rate in the header of its codec, or FFmpeg takes 25.
    """
    base, context = stream.time_base or Fraction(1, 90000), stream.codec_context
    count, shown = packets.count, _sorted(packets.presented)
    is_raw = _is_raw(container)
    is_guess = is_raw and not context.framerate
    if is_raw and count > 1 and (not len(shown) or _keeps_count(shown, count)):
        begin, step = (
            (shown[0], int(np.median(np.diff(shown)))) if len(shown) else (0, packets.step)
        )
        if step:
            return Times(begin + step * np.arange(count), base), not len(shown), is_guess
    if len(packets.presented) == count:
        has_order = container.format.name == "avi" and context.has_b_frames
        return Times(shown, base), bool(has_order), is_guess  # of decoding only, in an AVI
    if len(packets.decoded) == count:
        return Times(_sorted(packets.decoded), base), True, is_guess
    rate = stream.guessed_rate or stream.average_rate or Fraction(25)
    if len(shown) > 1:
        stated = known_rate(stream.average_rate)
        there = Timeline(Times(shown, base), shown, False, False, base, "", stated=stated)
        step = float(1 / (there.rate * base))
        return Times(completed(shown, packets, step), base), False, False
    return Times(np.arange(count), 1 / rate), True, True


def _is_raw(container: InputContainer) -> bool:
    """Return True for a format that holds packets alone, without times."""
    return bool(container.format.flags & Flags.no_timestamps.value)


def _keeps_count(ticks: np.ndarray, count: int) -> bool:
    """Return True for times that FFmpeg counted: their steps are the same, but for the first one,
    which it makes before it knows the rate."""
    return len(ticks) == count > 2 and len(np.unique(np.diff(ticks)[1:])) == 1


def _lasting(stream: VideoStream, packets: PictureTimes, timeline: Timeline) -> Fraction:
    """See Timeline.lasts. Durations that are all alike are those of a rate, perhaps another one.

    Only animations state a short one: elsewhere it may be the interval of a rate that the encoder
    was told, and did not keep.
    """
    base = stream.time_base
    if base is None or timeline.times.base != base or not packets.are_of_each:
        return Fraction(0)
    lasts, last = packets.lasts, int(timeline.times.ticks[-1])
    if stream.duration is not None and stream.start_time is not None:
        until = stream.start_time + stream.duration  # by the edit list, of an MP4
        lasts = min(lasts, until - last) if until > last else lasts
    states_each = stream.codec_context.name in _ANIMATIONS
    return lasts * base if states_each or lasts * base > 1 / KNOWN_RATES[0] else Fraction(0)


def _as_shown(timeline: Timeline) -> Timeline:
    """The times of a GIF as browsers show it: a delay under two hundredths of a second is ten."""
    base, ticks = timeline.times.base, timeline.times.ticks
    delays = np.append(np.diff(ticks), round(timeline.lasts / base) or _DELAY)
    short = delays < _SHORTEST_DELAY
    if not short.any():
        return timeline
    delays[short] = _DELAY
    times = ticks[0] + np.append(0, np.cumsum(delays[:-1]))
    return replace(
        timeline, times=Times(times, base), lasts=int(delays[-1]) * base, in_order=True,
        stated=None, slowed=int(np.count_nonzero(short)),
    )  # fmt: skip


def known_rate(rate: Fraction | None) -> Fraction | None:
    """The known rate that is meant, if any: files round the length of a picture."""
    near = (known for known in KNOWN_RATES if rate and abs(rate / known - 1) < _STATED)
    return next(near, None)


def _counted(timeline: Timeline, packets: PictureTimes, reorders: bool) -> Timeline | None:
    """See Timeline.counted."""
    times = timeline.times
    if len(times) < packets.count:  # times that repeat: some pictures have that of decoding instead
        decoded = _sorted(packets.decoded)
        if len(decoded) < packets.count:
            return None
        return replace(
            timeline, in_order=True, times=Times(decoded - decoded[0] + times.ticks[0], times.base)
        )
    return replace(timeline, in_order=True) if packets.ascends and reorders else None


def _sorted(ticks: array[int]) -> np.ndarray:
    return np.unique(np.frombuffer(ticks, np.int64)) if len(ticks) else np.zeros(0, np.int64)


def _repeated(ticks: array[int]) -> np.ndarray:
    values, counts = np.unique(np.frombuffer(ticks, np.int64), return_counts=True)
    return np.repeat(values, counts - 1)


def _going_back(decoded: array[int], base: Fraction) -> tuple[int, Fraction, Fraction] | None:
    """See Timeline.goes_back. Two packets on each side agree, so that none is merely damaged."""
    ticks = np.frombuffer(decoded, np.int64) if len(decoded) else np.zeros(0, np.int64)
    if len(ticks) < 4:
        return None
    before, after = np.minimum(ticks[:-1], ticks[1:])[:-2], np.maximum(ticks[:-1], ticks[1:])[2:]
    usual = np.median(np.abs(np.diff(ticks)))
    places = np.flatnonzero(before - after > usual)
    if not len(places):
        return None
    number = int(places[0]) + 2
    return number, int(ticks[number - 1]) * base, int(ticks[number]) * base


def _lacking(
    container: InputContainer, stream: VideoStream, timeline: Timeline, read: int
) -> Fraction:
    """Duration that the packets of a file lack [s]."""
    name, stated = container.format.name, Fraction(0)
    if name == "avi":
        stated = stream.frames * (stream.time_base or Fraction(0))
    elif container.duration is not None and (
        name.startswith(("matroska", "flv"))
        or (name.startswith("mov,") and stream.frames and len(stream.index_entries) > read)
    ):
        stated = Fraction(container.duration, 1_000_000)
    missing = stated - timeline.end
    return missing if missing > 1 / timeline.rate + Fraction(1, 10) else Fraction(0)
