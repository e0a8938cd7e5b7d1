"""Blur a whole sequence: reading, the GPU and writing at the same time.

Three threads pass frames on. At most IN_FLIGHT of them are in memory, however long the
sequence. A frame that fails is reported and passed over.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from .errors import Error, InputError
from .frame import Frame
from .output import Output
from .pipeline import Blur
from .sequence import Clip
from .source import Source


@dataclass
class Report:
    """What became of a run."""

    done: list[int] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)  # already there (resume)
    failed: dict[int, str] = field(default_factory=dict)
    bad: dict[int, dict[str, int]] = field(default_factory=dict)  # pixels not finite, by input


IN_FLIGHT = 3  # frames: one being read, one on the GPU, one being written

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
) -> Report:
    """Blur every frame of `clip` into `output`; with `confidence`, as layers beside the picture.

    Frames that cannot be read, blurred or written are in the report's `failed`, with the
    reason; the others are done. Interrupted, nothing half written is left and the
    interruption goes on.
    """
    report, stop, tell = Report(), threading.Event(), progress or (lambda number, what: None)
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
            if resume and output.done(number, clip.files(number)):
                report.skipped.append(number)
                tell(number, "skipped")
                continue
            places.get()
            try:
                source = clip.source(number)
                to_blur.put((source, prepare(source, normal=normal)))
                del source
            except (Error, OSError, MemoryError) as error:
                fail(number, error)
            finally:
                clip.forget(number - 1 if neighbours else number)
        to_blur.put(None)

    def write() -> None:
        while (item := to_write.get()) is not None:
            source, result, told = item
            try:
                output.write(result, source, told)
            except (Error, OSError, MemoryError, RuntimeError) as error:
                fail(source.number, error)
            else:
                places.put(None)
                report.done.append(source.number)
                tell(source.number, "done")
            del item, source, result, told

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
        while (item := to_blur.get()) is not None:
            source, frame = item
            _blur_one(blur, source, frame, confidence, report, to_write, fail)
            del item, source, frame
        to_write.put(None)
        for thread in threads:
            while thread.is_alive():  # a join without limit would hold back Ctrl-C
                thread.join(0.1)
    except _StopError:
        pass
    finally:
        broken = any(thread.is_alive() for thread in threads) or crash or not report.done
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
        except OSError as error:  # a video that cannot be finished is not there at all
            for number in report.done:
                fail(number, error)
            report.done.clear()
    return report


def _blur_one(
    blur: Blur, source: Source, frame: Frame, confidence: bool, report: Report, to_write, fail
) -> None:
    told = {}
    try:
        if confidence:
            result, told = blur.with_confidence(frame)
        else:
            result = blur(frame)
    except InputError as error:
        fail(source.number, InputError(f"{source.path}: {error}"))
        return
    if frame.bad:
        report.bad[source.number] = frame.bad
    to_write.put((source, result, told))
