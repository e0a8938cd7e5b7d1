"""Motion of a video's pictures, made in a thread of its own while the window goes on.

The thread has its own device and its own reader, so that the window never waits for it. What it
has found of a picture is kept, as far as memory allows.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import wgpu

from .. import gpu
from ..errors import Error
from ..flow.dis import Dis
from ..glance import Glance, is_cut
from ..io.footage import Footage
from ..io.picture_motion import FAR
from ..io.video_masks import holdout_of
from ..motion_source import MotionSource
from ..reel import FLASH, LONGEST
from ..video_pictures import VideoPictures
from ..video_settings import FlowSettings

_MEMORY = 1 << 30  # bytes of motion kept
_PICTURES = 24  # kept for the pictures around them
_POLL = 0.2  # seconds after which the thread looks whether it should end


@dataclass(frozen=True)
class Known:
    """What is known of a picture."""

    motion: np.ndarray | None
    """(height, width, 4) to_prev, to_next [px]; None without a source of motion, or alone."""
    depth: np.ndarray | None
    begins: bool
    """No motion leads to it from the picture before: that is of another shot, or of a flash."""
    ends: bool
    """No motion leads from it to the next picture."""
    begins_shot: bool
    ends_shot: bool
    holdout: np.ndarray | None = None
    """(height, width): 1 stays sharp; of pictures with motion."""


class _Finder:
    """Motion and cuts of a video's pictures, from those around each in its own shot."""

    def __init__(
        self,
        footage: Footage,
        device: wgpu.GPUDevice,
        motion: MotionSource | None,
        masks: tuple[str, ...],
    ):
        self._holdout = holdout_of(masks, footage) if motion is not None else None
        self._pictures, self._count = VideoPictures(footage, device), len(footage)
        self._times = footage.times.seconds
        self._kept: OrderedDict[int, Glance | None] = OrderedDict()
        self._motion, self._shot, self._anchor = motion, None, 0
        self._cuts: dict[int, bool] = {}

    def __call__(self, number: int) -> Known:
        """What can be known of a picture."""
        motion = depth = None
        if self._motion is not None and self._picture(number) is not None:
            if self._shot is None or not self._same_shot(self._anchor, number):
                self._anchor = number
                self._shot = self._motion.shot(self._load)
            self._anchor = number
            motion, depth = self._shot(number) or (None, None)
        begins, ends = (self._begins(n) for n in (number, number + 1))
        begins_shot = begins and not self._is_flash(number)
        ends_shot = ends and not self._is_flash(number + 1)
        holdout = None if motion is None else self._holdout
        return Known(motion, depth, begins, ends, begins_shot, ends_shot, holdout)

    def _load(self, number: int) -> np.ndarray | None:
        if not self._same_shot(self._anchor, number):
            return None
        picture = self._picture(number)
        assert picture is not None
        return (
            picture.grey if isinstance(self._motion, Dis) else self._pictures.light(picture.coded)
        )

    def _same_shot(self, a: int, b: int) -> bool:
        """Whether no cut lies between two pictures; those far apart are taken for other shots."""
        near = abs(a - b) <= 2 * FAR
        return near and not any(map(self._begins, range(min(a, b) + 1, max(a, b) + 1)))

    def _is_flash(self, number: int) -> bool:
        """Whether what begins with a picture is a flash, or the end of one (see reel.py)."""
        for first in range(number, max(number - LONGEST, 0), -1):
            before = self._picture(first - 1)
            if not self._within(first, number) or before is None:
                return False
            if not self._begins(first):
                continue
            for last in range(first + 1, min(first + LONGEST, self._count - 1) + 1):
                after = self._picture(last) if self._within(first, last) else None
                if after is None:
                    break
                if not is_cut(before, after):
                    if last >= number:
                        return True
                    break
        return False

    def _within(self, first: int, last: int) -> bool:
        """Whether a flash may last from one picture to another."""
        if last <= first + 1:
            return last < self._count
        return last < self._count and self._times[last] - self._times[first] <= FLASH

    def _begins(self, number: int) -> bool:
        """Whether a cut, a flash, the end of one, or a gap lies before a picture."""
        if number not in self._cuts:
            before, here = self._picture(number - 1), self._picture(number)
            self._cuts[number] = before is None or here is None or is_cut(before, here)
        return self._cuts[number]

    def _picture(self, number: int) -> Glance | None:
        if not 0 <= number < self._count:
            return None
        if number not in self._kept:
            coded = self._pictures.coded(number)
            self._kept[number] = None if coded is None else Glance(coded)
            while len(self._kept) > _PICTURES:
                self._kept.popitem(last=False)
        self._kept.move_to_end(number)
        return self._kept[number]


class MotionMaker:
    """Makes the motion of the pictures that are wanted, the first of them first.

    `masks`: what stays sharp (see io/video_masks.py), found before the first motion. `how`: where
    motion comes from, in words. `problem`: why there will be no more.
    """

    def __init__(
        self,
        path: Path,
        max_mb: float,
        settings: FlowSettings,
        device: wgpu.GPUDevice,
        masks: tuple[str, ...] = (),
    ):
        self._path, self._max_mb, self._masks = path, max_mb, masks
        beside = gpu.second_device(device)
        motion, self.how = settings.source(beside)
        self.problem = ""
        self._known: OrderedDict[int, Known] = OrderedDict()
        self._lock = threading.Lock()
        self._changed = threading.Event()
        self._ended = threading.Event()
        self._wanted: tuple[int, ...] = ()
        self._making: tuple[int, float] | None = None
        work = self._work, (beside, motion)
        self._thread = threading.Thread(target=work[0], args=work[1], name="motion", daemon=True)
        self._thread.start()

    def known(self, number: int) -> Known | None:
        """What is known of a picture; None if nothing is yet."""
        with self._lock:
            if number in self._known:
                self._known.move_to_end(number)
            return self._known.get(number)

    def want(self, numbers: tuple[int, ...]) -> None:
        """Make these next, in this order, instead of what was wanted before."""
        with self._lock:
            if numbers != self._wanted:
                self._wanted = numbers
                self._changed.set()

    @property
    def making(self) -> tuple[int, float] | None:
        """The picture whose motion is being made, and for how long [s]."""
        with self._lock:
            return self._making and (self._making[0], time.perf_counter() - self._making[1])

    def close(self) -> None:
        """Let the thread end with what it is doing."""
        self._ended.set()
        self._changed.set()

    def _work(self, device: wgpu.GPUDevice, motion: MotionSource | None) -> None:
        try:
            footage = Footage(self._path, max_mb=self._max_mb)
            find = _Finder(footage, device, motion, self._masks)
            for number in self._to_do():
                known = find(number)
                with self._lock:
                    self._making = None
                    self._keep(number, known)
        except (Error, OSError, MemoryError, wgpu.GPUError) as error:
            self.problem = " ".join(str(error).split()) or "not enough memory"
        finally:
            self._making = None

    def _to_do(self) -> Iterator[int]:
        """The next picture that is wanted and not known, until the thread is to end."""
        while not self._ended.is_set():
            with self._lock:
                number = next((n for n in self._wanted if n not in self._known), None)
                if number is not None:
                    self._making = number, time.perf_counter()
                self._changed.clear()
            if number is None:
                self._changed.wait(_POLL)
            else:
                yield number

    def _keep(self, number: int, known: Known) -> None:
        self._known[number] = known
        size = sum(a.nbytes for a in (known.motion, known.depth) if a is not None)
        most = max(_MEMORY // max(size, 1), 2 * _PICTURES)
        while len(self._known) > most:
            self._known.popitem(last=False)
