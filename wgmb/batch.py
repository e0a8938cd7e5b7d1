"""Blur a whole sequence: reading, the GPU and writing at the same time.

Three threads pass frames on. At most IN_FLIGHT of them are in memory, however long the
sequence. A frame that fails is reported and passed over.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .errors import Error, GpuMemoryError, InputError
from .frame import Frame
from .io.clip import Clip
from .io.frame_file import FrameFile
from .io.output import Output
from .pipeline import Blur


@dataclass
class BatchReport:
    """What became of a run."""

    done: list[int] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)  # already there (resume)
    failed: dict[int, str] = field(default_factory=dict)
    stopped: str = ""  # why the rest was not tried, or there is no video
    bad: dict[int, dict[str, int]] = field(default_factory=dict)  # pixels not finite, by input


@dataclass
class _Job:
    """One frame, read and to be blurred."""

    source: FrameFile
    frame: Frame
    made_of: dict


@dataclass
class _Blurred:
    """One frame, blurred and to be written."""

    source: FrameFile
    made_of: dict
    picture: np.ndarray
    confidence: dict[str, np.ndarray]


IN_FLIGHT = 3  # frames: one being read, one on the GPU, one being written
HOPELESS = 3  # frames one after the other that cannot be written for the same reason

Progress = Callable[[int, str], None]
"""Called with a frame's number and "done", "skipped" or "failed"."""


class _StopError(Exception):
    """The other end of a queue is gone."""


class _Handover:
    """A queue whose end notices a stop."""

    def __init__(self, stop: threading.Event):
        self._queue: queue.SimpleQueue = queue.SimpleQueue()
        self._stop = stop
        self.put = self._queue.put

    def get(self):
        while not self._stop.is_set():
            try:
                return self._queue.get(timeout=0.05)
            except queue.Empty:
                continue
        raise _StopError


def blur_sequence(
    clip: Clip,
    blur: Blur,
    output: Output,
    *,
    resume: bool = False,
    confidence: bool = False,
    progress: Progress | None = None,
) -> BatchReport:
    """Blur every frame of `clip` into `output`; with `confidence`, as layers beside the picture.

    Frames that cannot be read, blurred or written are in the report's `failed`, with the
    reason; the others are done. Where frame after frame cannot be written for the same reason (a
    full disk, a folder that is gone), or a video cannot go on, the run stops and `stopped`
    says why. Interrupted, nothing half written is left and the interruption goes on.
    """
    report, stop, tell = BatchReport(), threading.Event(), progress or (lambda number, what: None)
    hopeless = threading.Event()
    to_blur, to_write = _Handover(stop), _Handover(stop)
    neighbours = "neighbours" in blur.method.uses
    prepare = clip.with_neighbours if neighbours else clip.frame
    normal = "normal" in blur.method.uses
    places = _Handover(stop)
    for _ in range(IN_FLIGHT):
        places.put(None)
    crash: list[BaseException] = []

    def fail(number: int, error: BaseException) -> None:
        places.put(None)
        report.failed[number] = " ".join(str(error).split()) or type(error).__name__
        tell(number, "failed")

    def read() -> None:
        for number in clip.numbers:
            if hopeless.is_set():
                break
            places.get()
            try:
                made_of = clip.made_of(number, neighbours)
                if resume and output.done(number, made_of):
                    places.put(None)
                    report.skipped.append(number)
                    tell(number, "skipped")
                    continue
                source = clip.source(number)
                frame = prepare(source, normal=normal)
                if unread := sorted({number - 1, number + 1} & clip.unread):
                    made_of["unread"] = unread  # so that --resume asks for them again
                to_blur.put(_Job(source, frame, made_of))
                del source, frame
            except (Error, OSError, MemoryError) as error:
                fail(number, error)
            finally:
                clip.forget(number - 1 if neighbours else number)
        to_blur.put(None)

    def write() -> None:
        reasons: list[str] = []
        while (blurred := to_write.get()) is not None:
            number = blurred.source.number
            if hopeless.is_set():
                places.put(None)
                continue
            try:
                output.write(blurred.picture, blurred.source, blurred.confidence, blurred.made_of)
            except (Error, OSError, MemoryError, RuntimeError) as error:
                fail(number, error)
                reasons.append(output.why_hopeless(error))
                if reasons[-1] and (
                    output.is_video or reasons[-HOPELESS:] == HOPELESS * reasons[-1:]
                ):
                    report.stopped = reasons[-1]
                    hopeless.set()
            else:
                reasons.clear()
                places.put(None)
                report.done.append(number)
                tell(number, "done")
            del blurred

    def guarded(work: Callable[[], None]) -> None:
        try:
            work()
        except _StopError:
            pass
        except BaseException as error:  # a fault of ours: the main thread raises it
            crash.append(error)
            stop.set()

    threads = [
        threading.Thread(target=guarded, args=(work,), name=work.__name__, daemon=True)
        for work in (read, write)
    ]
    for thread in threads:
        thread.start()
    try:
        while (job := to_blur.get()) is not None:
            _blur_one(blur, job, confidence, report, to_write, fail)
            del job
        to_write.put(None)
        for thread in threads:
            while thread.is_alive():  # a join without limit would hold back Ctrl-C
                thread.join(0.1)
    except _StopError:
        pass
    finally:
        broken = any(thread.is_alive() for thread in threads) or crash or not report.done
        broken = broken or (output.is_video and report.stopped)
        stop.set()
        for thread in threads:
            thread.join(0.5)
        if broken:
            output.abandon()
    if crash:
        raise crash[0]
    if not broken:
        try:
            output.close()
        except OSError as error:
            report.stopped = str(error)
    if output.is_video and report.stopped:  # it is not there at all
        report.done.clear()
    return report


def _blur_one(blur: Blur, job: _Job, confidence: bool, report: BatchReport, to_write, fail) -> None:
    told: dict[str, np.ndarray] = {}
    try:
        if confidence:
            picture, told = blur.with_confidence(job.frame)
        else:
            picture = blur(job.frame)
    except (InputError, GpuMemoryError) as error:
        fail(job.source.number, InputError(f"{job.source.path}: {error}"))
        return
    if job.frame.bad:
        report.bad[job.source.number] = job.frame.bad
    to_write.put(_Blurred(job.source, job.made_of, picture, told))
