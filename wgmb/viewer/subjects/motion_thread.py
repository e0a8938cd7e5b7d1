"""Motion of a video's pictures, made in a thread of its own while the window goes on.

The thread has a device and a reader of its own, so that the window never waits for it. Its
findings about a picture are kept, as far as memory allows.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import wgpu

from ... import gpu
from ...errors import Error
from ...settings.video import FlowSettings
from ...shots.motion import MotionSource
from ...threads import begin
from ...video.read.reader import VideoReader
from .video_motion import MotionRequest, PictureFinder, PictureFinding

_MEMORY = 1 << 30  # bytes of motion kept, if an exposure does not need more
_POLL = 0.2  # seconds after which the thread looks whether it should end


class MotionThread:
    """Makes the motion of the pictures that are wanted, the first of them first.

    Static areas are found before the first motion. `how`: where motion comes from, in words.
    `problem`: why there will be no more.
    """

    def __init__(
        self,
        path: Path,
        max_mb: float,
        settings: FlowSettings,
        device: wgpu.GPUDevice,
        request: MotionRequest,
    ):
        self._path, self._max_mb, self._request = path, max_mb, request
        beside = gpu.borrow_device(device)
        motion, self.how = settings.source(beside)
        self.problem = ""
        self._known: OrderedDict[int, PictureFinding] = OrderedDict()
        self._lock = threading.Lock()
        self._changed = threading.Event()
        self._ended = threading.Event()
        self._wanted: tuple[int, ...] = ()
        self._needed = 0
        self._bytes = 1  # of the largest finding
        self._making: tuple[int, float] | None = None
        self._thread = begin(lambda: self._work(beside, motion), "motion")

    def known(self, number: int) -> PictureFinding | None:
        """The finding about a picture; None until there is one."""
        with self._lock:
            if number in self._known:
                self._known.move_to_end(number)
            return self._known.get(number)

    def want(self, numbers: tuple[int, ...], needed: int) -> None:
        """Make these next, in this order, instead of earlier requests.

        The first ones are `needed`; of the others, as many are made as there is memory for.
        """
        with self._lock:
            if (numbers, needed) != (self._wanted, self._needed):
                self._wanted, self._needed = numbers, needed
                self._changed.set()

    @property
    def making(self) -> tuple[int, float] | None:
        """The picture whose motion is being made, and for how long [s]."""
        with self._lock:
            return self._making and (self._making[0], time.perf_counter() - self._making[1])

    def close(self) -> None:
        """Let the thread end after its current work."""
        self._ended.set()
        self._changed.set()

    def _work(self, device: wgpu.GPUDevice, motion: MotionSource | None) -> None:
        try:
            reader = VideoReader(self._path, max_mb=self._max_mb)
            with closing(PictureFinder(reader, device, motion, self._request)) as find:
                for number in self._to_do():
                    known = find(number)
                    with self._lock:
                        self._making = None
                        self._keep(number, known)
        except (Error, OSError, MemoryError, wgpu.GPUError) as error:
            self.problem = " ".join(str(error).split()) or "not enough memory"
        finally:
            self._making = None
            gpu.give_back(device)

    def _to_do(self) -> Iterator[int]:
        """The next picture that is wanted and not known, until the thread is to end."""
        while not self._ended.is_set():
            with self._lock:
                soon = self._wanted[: self._most]
                number = next((n for n in soon if n not in self._known), None)
                if number is not None:
                    self._making = number, time.perf_counter()
                self._changed.clear()
            if number is None:
                self._changed.wait(_POLL)
            else:
                yield number

    def _keep(self, number: int, known: PictureFinding) -> None:
        self._known[number] = known
        self._bytes = max(self._bytes, known.bytes)
        while len(self._known) > self._most:
            self._known.popitem(last=False)

    @property
    def _most(self) -> int:
        """Findings that are kept."""
        return max(_MEMORY // self._bytes, self._needed)
