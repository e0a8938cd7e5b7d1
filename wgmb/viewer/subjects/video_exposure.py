"""The pictures that an output frame of a video is exposed from, as far as they are known."""

from __future__ import annotations

from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import wgpu

from ...errors import InputError
from ...exposure import Cell, cells_in_shot
from ...gpu.textures import TexturePool
from ...shots.reader import Picture, Shots
from ...shutter import Shutter
from ...video.clock import Clock
from ...video.edges import MotionEdges
from ...video.holdouts import Holdout
from ...video.linear_frames import CodedPictures
from ...video.output_times import OutputFrame
from ...video.ragged import KEPT
from ...video.read.reader import VideoReader
from ...video.thumbnail import Thumbnail
from .video_motion import PictureFinding

Knowledge = Callable[[int], PictureFinding | None]
"""The finding about a picture, by its number; None until there is one."""
_Findings = list[PictureFinding | None]
_MEMORY = 1 << 29  # bytes of pictures kept
_FEWEST = 12  # pictures kept at least


@dataclass(frozen=True)
class ClockedTimes:
    """The times of a video's pictures [s], on the clock of its output."""

    own: Sequence[Fraction]
    """On the clock of the video."""
    clock: Clock
    tolerance: float = 0.0
    """By how much they may be rounded [s]; so much earlier, a picture is shown already."""

    def __len__(self) -> int:
        return len(self.own)

    def __getitem__(self, number: int) -> float:
        return float(self.clock.out(self.own[number]))

    def of(self, number: int, finding: PictureFinding | None) -> float:
        """The time of a picture, in a cadence its own one."""
        if finding is None or finding.time is None:
            return self[number]
        return float(self.clock.out(Fraction(finding.time)))

    def shown_at(self, time: float) -> int:
        """The picture that is shown at a time; before the first one, that."""
        after = bisect_right(range(len(self)), time + self.tolerance, key=self.__getitem__)
        return max(after - 1, 0)


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
    times: ClockedTimes,
    frame: OutputFrame,
    shutter: Shutter,
    known: Knowledge,
    is_filled: bool = False,
) -> VideoExposure:
    """The exposure of an output frame; where motion is missing, of the pictures that have it.

    `is_filled`: repeated pictures are left out, so that the time of a picture is a finding.
    """
    lacking: list[int] = []

    def time(number: int) -> float:
        finding = known(number)
        if finding is None and is_filled:
            lacking.append(number)
        return times.of(number, finding)

    def neighbour(number: int, side: int) -> int | None:
        return _neighbour(number, side, known, lacking)

    at, interval = float(frame.time), float(frame.interval)
    here = _kept(times.shown_at(at), known, lacking)
    if is_filled:
        here = _at_own_time(here, at + times.tolerance, time, known)
    cells = cells_in_shot(here, neighbour, time, at, interval, shutter)
    return VideoExposure(here, tuple(cells), tuple(dict.fromkeys(lacking)))


def reach(times: ClockedTimes, frame: OutputFrame, shutter: Shutter) -> tuple[int, int]:
    """First and last picture of an exposure, if there is no cut and no repeat among them."""
    at = float(frame.time)
    opens, closes = (at + float(frame.interval) * t for t in shutter.span)
    first = last = times.shown_at(at)
    while first > 0 and times[first] + times[first - 1] > 2 * opens:
        first -= 1
    while last + 1 < len(times) and times[last + 1] + times[last] < 2 * closes:
        last += 1
    return first, last


def _kept(number: int, known: Knowledge, lacking: list[int]) -> int:
    """The picture that stands for one: itself, or where it is left out the one before."""
    finding = known(number)
    if finding is None:
        lacking.append(number)
        return number
    if not finding.is_left_out:
        return number
    before = finding.after if finding.before is None else finding.before
    if before is None:
        return number
    if known(before) is None:
        lacking.append(before)
    return before


def _at_own_time(here: int, at: float, time: Callable[[int], float], known: Knowledge) -> int:
    """The picture that is shown at a time, near `here`, by the times that a cadence gives."""
    while (finding := known(here)) and finding.after is not None and time(finding.after) <= at:
        here = finding.after
    while (finding := known(here)) and finding.before is not None and time(here) > at:
        here = finding.before
    return here


def _neighbour(number: int, side: int, known: Knowledge, lacking: list[int]) -> int | None:
    """The picture before (-1) or after (1) one in its shot; None if there is none, or unknown."""
    here = known(number)
    if here is None:
        lacking.append(number)
        return None
    if side < 0:
        return None if here.begins_shot else here.before
    return None if here.ends_shot else here.after


# ---- the same for wgmb/video, which makes the exposures of files: pictures, motion, holdouts ----


class KnownShots:
    """Pictures of a video in any order, by their numbers, in shots as far as those are known.

    The last pictures are kept; each is the same object until more is known of it or of those
    beside it, or its time is another one.
    """

    def __init__(self, reader: VideoReader, times: ClockedTimes, known: Knowledge):
        self._path, self._count = reader.path, len(reader)
        self.times, self.tolerance = times, times.tolerance
        self._known, self._coded = known, CodedPictures(reader)
        self._kept: OrderedDict[int, tuple[_Findings, Picture[Thumbnail]]] = OrderedDict()

    def retime(self, times: ClockedTimes) -> None:
        """Show the pictures at other times."""
        self.times, self.tolerance = times, times.tolerance

    def __getitem__(self, index: int) -> Picture[Thumbnail]:
        """A picture; the nearest one before, or after, if it cannot be decoded."""
        finding = self._known(index)
        near = [finding.before, finding.after] if finding else []
        findings = [finding, *(None if n is None else self._known(n) for n in near)]
        time, held = self.times.of(index, finding), self._kept.get(index)
        if held is None:
            held = findings, Picture(time, Thumbnail(self._decoded(index)), index)
        elif held[1].time != time or list(map(id, held[0])) != list(map(id, findings)):
            held = findings, replace(held[1], time=time)
        self._kept[index] = held
        self._kept.move_to_end(index)
        size = sum(plane.nbytes for plane in held[1].content.coded.planes)
        while len(self._kept) > max(_MEMORY // size, _FEWEST):
            self._kept.popitem(last=False)
        return held[1]

    def _decoded(self, index: int):
        near = index, *range(index - 1, -1, -1), *range(index + 1, self._count)
        for number in near:
            if number in self._kept:
                return self._kept[number][1].content.coded
            if (coded := self._coded.at(number)) is not None:
                return coded
        raise InputError(f"{self._path}: its pictures cannot be decoded any more")

    def neighbour(self, index: int, side: int) -> int | None:
        """The picture before (-1) or after (1) another one in its shot, as far as is known."""
        return _neighbour(index, side, self._known, [])

    def same_shot(self, index: int, other: int) -> bool:
        """True for a picture and one beside it in its shot."""
        return other in (index, self.neighbour(index, -1), self.neighbour(index, 1))

    def moves_on(self, index: int, other: int) -> bool:
        """True if motion is known to lead from a picture to one beside it."""
        finding = self._known(index)
        if finding is None or other == index:
            return other == index
        leads = other == finding.before and not finding.begins
        return leads or (other == finding.after and not finding.ends)


class KnownMotion:
    """The motion of pictures that was found already, uploaded when it is asked for."""

    def __init__(self, device: wgpu.GPUDevice, known: Knowledge):
        self._known, self._images = known, TexturePool(device)
        self._places: dict[int, int] = {}  # by number, the latest last

    def place(self, index: int) -> int:
        """The place of a picture's textures: that which was used longest ago, if none is free."""
        place = self._places.pop(index, None)
        if place is None:
            free = set(range(KEPT)).difference(self._places.values())
            place = min(free) if free else self._places.pop(next(iter(self._places)))
        self._places[index] = place
        return place

    def textures(self, index: int) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture | None] | None:
        """Motion (rgba32float) of a picture, and depth (r32float); None if none is known."""
        finding = self._known(index)
        if finding is None or finding.motion is None:
            return None
        place, depth = self.place(index), finding.depth
        motion = self._images.upload(f"motion {place}", finding.motion, "rgba32float").texture
        if depth is None:
            return motion, None
        return motion, self._images.upload(f"depth {place}", depth, "r32float").texture

    def depth(self, index: int) -> None:
        """None: it is given with the motion."""

    def edges(self, index: int) -> MotionEdges | None:
        """Edges of a picture's motion, None if they are not known."""
        finding = self._known(index)
        return None if finding is None else finding.edges

    def is_unfollowed(self, index: int, held: object) -> bool:
        """False: the viewer has no report."""
        return False


@dataclass
class KnownHoldout(Holdout):
    """Areas that stay sharp, found with the motion."""

    known: Knowledge = lambda number: None

    def of(
        self, shots: Shots[Thumbnail], ahead: bool = False
    ) -> Callable[[int], np.ndarray | None]:
        """Masks of pictures, by their numbers; `ahead` changes nothing, as all are there."""

        def held(index: int) -> np.ndarray | None:
            finding = self.known(index)
            return finding and finding.holdout

        return held
