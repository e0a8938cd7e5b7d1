"""Finding of a video's picture: its motion, and the end of its shot, as in `wgmb blur`.

The pictures around it go through the same ShotReader, so that cuts, flashes, repeated pictures and
those that cannot be decoded mean the same. Any picture may be asked for; neighbours are quick.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import wgpu

from ...shots.cut_list import CutList
from ...shots.motion import MotionSource, window
from ...shots.reader import NoPicturesError, Picture, ShotReader
from ...video.edges import MotionEdges
from ...video.exposures import BEFORE
from ...video.holdouts import NONE, Held, holdout_of
from ...video.motion import VideoMotion
from ...video.read.reader import VideoReader
from ...video.thumbnail import Thumbnail, change, is_cut

_EARLIER = 8  # more of them read at first, so that going back does not begin anew at each step
_BEHIND = 24  # pictures kept behind one
_NEAR = 48  # pictures ahead that are read on to


@dataclass(frozen=True)
class PictureFinding:
    """The finding about a picture; `before` and `after` are the numbers of its neighbours."""

    motion: np.ndarray | None
    """(height, width, 4) to_prev, to_next [px]; None without a source of motion, or alone."""
    depth: np.ndarray | None
    before: int | None
    after: int | None
    begins: bool = True
    """No motion leads to it from the picture before: that is of another shot, or of a flash."""
    ends: bool = True
    """No motion leads from it to the next picture."""
    begins_shot: bool = True
    ends_shot: bool = True
    is_left_out: bool = False
    """It repeats the picture before, or cannot be decoded: those beside it reach over its time."""
    holdout: np.ndarray | None = None
    """(height, width): 1 stays sharp; of pictures with motion."""
    edges: MotionEdges | None = None
    """Those of the motion, None if they are not known."""
    time: float | None = None
    """The time that a cadence gives it, on the video's clock [s]; None: that in the file."""

    @property
    def bytes(self) -> int:
        """Memory that its arrays take."""
        arrays = self.motion, self.depth, self.holdout
        return sum(array.nbytes for array in arrays if array is not None)


@dataclass(frozen=True)
class MotionRequest:
    """Settings on which the pictures' neighbours depend, besides the source of the motion.

    `masks`: areas that stay sharp (see video/holdouts.py). `fill`: repeated pictures are left out.
    `cuts`: see shots/cut_list.py.
    """

    masks: tuple[str, ...] = ()
    fill: bool = False
    cuts: str = ""


class PictureFinder:
    """Finds motion and other data of pictures, one after the other, on a device."""

    def __init__(
        self,
        reader: VideoReader,
        device: wgpu.GPUDevice,
        motion: MotionSource | None,
        request: MotionRequest,
    ):
        self._reader, self._device, self._source = reader, device, motion
        self._times = reader.times.seconds
        self._fill, self._cuts = request.fill, CutList(request.cuts)
        masks = request.masks if motion is not None else (NONE,)
        self._holdout = holdout_of(masks, reader)
        self._held: Held | None = None
        self._shots: ShotReader[Thumbnail] | None = None
        self._motion: VideoMotion | None = None
        self._numbers: WeakKeyDictionary[Thumbnail, int] = WeakKeyDictionary()
        self._compared: dict[tuple[int, int], bool] = {}

    def __call__(self, number: int) -> PictureFinding:
        """The finding about a picture, as far as possible."""
        shots = self._shots_around(number)
        try:
            shots.at(self._times[number], _BEHIND)
        except NoPicturesError:  # from some pictures before it on, none can be decoded
            return PictureFinding(None, None, None, None, is_left_out=True)
        near = {i: shots[i].number for i in shots.kept}
        here = next((i for i, n in near.items() if n == number), None)
        if here is None:
            before = max((n for n in near.values() if n < number), default=None)
            after = min((n for n in near.values() if n > number), default=None)
            return PictureFinding(None, None, before, after, is_left_out=True)
        found = self._motion(here) if self._motion else None
        motion, depth = found or (None, None)
        time = shots[here].time
        return PictureFinding(
            motion,
            depth,
            near.get(here - 1),
            near.get(here + 1),
            begins=not shots.moves_on(here, here - 1),
            ends=not shots.moves_on(here, here + 1),
            begins_shot=not shots.same_shot(here, here - 1),
            ends_shot=not shots.same_shot(here, here + 1),
            holdout=None if found is None or not self._held else self._held(here),
            edges=None if found is None or not self._motion else self._motion.edges(here),
            time=None if time == self._times[number] else time,
        )

    def close(self) -> None:
        """Let go of the pictures: their reader refers back to this, and they are large."""
        if self._motion is not None:
            self._motion.close()
        self._shots = self._motion = self._held = None

    def _shots_around(self, number: int) -> ShotReader[Thumbnail]:
        """A ShotReader that knows all around a picture: another one where the last is far away."""
        shots = self._shots
        if shots is not None and len(shots.kept):
            kept = shots.kept
            first, last = shots[kept[0]].number, shots[kept[-1]].number
            at_start = first == 0 or (kept[0] == 0 and first > number)
            behind = sum(shots[i].number < number for i in kept)
            if number <= last + _NEAR and (at_start or behind >= BEFORE):
                return shots
        self.close()
        first = max(number - BEFORE - _EARLIER, 0)
        self._shots = shots = ShotReader(
            self._pictures(first),
            is_cut=self._is_cut if self._cuts.is_search else None,
            known_cuts=self._cuts.frames(0),
            change=change if self._fill else None,
            reach=window(self._reader.size, self._source),
            tolerance=self._reader.tolerance,
        )
        source = self._source
        self._motion = VideoMotion(source, shots, self._device) if source else None
        self._held = self._holdout.of(shots)
        return shots

    def _pictures(self, first: int) -> Iterator[Picture[Thumbnail]]:
        for number, coded in self._reader.pictures(first):
            thumbnail = Thumbnail(coded)
            self._numbers[thumbnail] = number
            yield Picture(float(self._times[number]), thumbnail, number)

    def _is_cut(self, before: Thumbnail, after: Thumbnail) -> bool:
        """The same as is_cut, told once for two pictures: to tell costs more than to decode."""
        key = self._numbers[before], self._numbers[after]
        if key not in self._compared:
            self._compared[key] = is_cut(before, after)
        return self._compared[key]
