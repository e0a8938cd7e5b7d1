"""Whole sequences: rendered frames through a Blur into files.

Three threads read, blur and write concurrently. At most IN_FLIGHT frames are in memory,
however long the sequence. A failing frame is reported and skipped.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import threading
from collections.abc import Callable

from ..errors import Error, GpuMemoryError, InputError
from ..io.frame_numbers import has_view
from ..output.output import Output
from ..output.vectors import VectorOutput
from ..pipeline.blur import Blur
from ..sequence.clip import Clip
from .batch_report import BatchReport, Progress
from .conversion import RateConversion, RateConversionStages
from .stages import (
    IN_FLIGHT,
    Handover,
    MotionStages,
    ReadFrame,
    Stages,
    StopError,
    reason,
)

HOPELESS = 3  # frames one after the other that cannot be written for the same reason
ON_REQUEST = "on request"  # why a run stopped whose `stop` was set


def blur_sequence(
    clip: Clip,
    blur: Blur,
    output: Output,
    *,
    resume: bool = False,
    confidence: bool = False,
    progress: Progress | None = None,
    stop: threading.Event | None = None,
) -> BatchReport:
    """Blur every frame of `clip` into `output`; `confidence` adds confidence layers.

    `resume` skips frames that are finished (see Output.done). `progress` is called with each
    frame's number and "done", "skipped" or "failed". All views of a stereo frame are blurred, or
    the one for which the clip was opened; an output of one picture gets the default view.

    Frames that cannot be read, blurred or written are in the report's `failed`, with the reason;
    the others are finished. If several successive frames cannot be written for the same reason (a
    full disk, a removed folder), or a video cannot continue, the run stops, and the report's
    `stopped` gives the reason. Once `stop` is set, no further frame is begun; blurred frames are
    written, and `stopped` is "on request". An interruption leaves no half-written file and is
    raised again. InputError, before any frame is blurred, if a mask names an object that no
    Cryptomatte has. Masks by index or id can be checked at the end only: `absent`.
    """
    _check_names(clip, output)
    stages = Stages(clip, blur, confidence, output.takes_views)
    return _Pipeline(stages, output, resume, progress, stop).run()


def convert_sequence(
    clip: Clip,
    blur: Blur,
    output: Output,
    conversion: RateConversion,
    *,
    resume: bool = False,
    progress: Progress | None = None,
    stop: threading.Event | None = None,
) -> BatchReport:
    """Blur `clip` into `output` at another rate; numbers are those of the output's frames.

    Everything else is as for `blur_sequence`; conversion.py tells the inputs of an output frame.
    """
    _check_names(clip, output)
    stages = RateConversionStages(clip, blur, conversion, output.takes_views)
    return _Pipeline(stages, output, resume, progress, stop).run()


def _check_names(clip: Clip, output: Output) -> None:
    """InputError where views or masks do not fit; the output is then abandoned."""
    try:
        _check_names_of_views(clip, output)
        clip.check_names()
    except BaseException:
        output.abandon()
        raise


def _check_names_of_views(clip: Clip, output: Output) -> None:
    """InputError where views in a file each would go into one."""
    apart = has_view(clip.pattern) and len(clip.chosen) > 1
    if apart and output.takes_views and not has_view(output.pattern):
        raise InputError(
            f"output {output.pattern}: the frames have a file for each view, so %V must be in its "
            "name too"
        )


class _Pipeline:
    """Three stages, each in a thread of its own: read, blur (the caller's thread), write."""

    def __init__(
        self,
        stages: Stages,
        output: Output,
        resume: bool,
        progress: Progress | None,
        asked: threading.Event | None = None,
    ):
        self.stages, self.output, self.resume = stages, output, resume
        self.clip = stages.clip
        self.progress = progress or (lambda number, state: None)
        self.report = BatchReport()
        self.stop, self.hopeless = threading.Event(), threading.Event()
        self.asked = asked or threading.Event()
        self.to_blur, self.to_write = Handover(self.stop), Handover(self.stop)
        self.places = Handover(self.stop)
        for _ in range(IN_FLIGHT):
            self.places.put(None)
        self.crash: list[BaseException] = []

    def run(self) -> BatchReport:
        """Do all frames; an interruption or a fault of a thread is raised here."""
        threads = [
            threading.Thread(target=self._guarded, args=(stage,), name=stage.__name__, daemon=True)
            for stage in (self.read, self.write)
        ]
        for thread in threads:
            thread.start()
        report = self.report
        try:
            while (read := self.to_blur.get()) is not None:
                self.blur_one(read)
                del read
            self.to_write.put(None)
            for thread in threads:
                while thread.is_alive():  # a join without limit would hold back Ctrl-C
                    thread.join(0.1)
            if self.asked.is_set() and not report.stopped and self._rest():
                report.stopped = ON_REQUEST
        except StopError:
            pass
        finally:
            broken = any(thread.is_alive() for thread in threads) or self.crash or not report.done
            broken = broken or (self.output.is_video and report.stopped)
            self.stop.set()
            for thread in threads:
                thread.join(0.5)
            if broken:
                self.output.abandon()
        if self.crash:
            raise self.crash[0]
        if not broken:
            try:
                self.output.close()
            except OSError as error:
                report.stopped = str(error)
        if self.output.is_video and report.stopped:  # it is not there at all
            report.done.clear()
        if len(report.done) == len(self.stages.numbers):
            report.absent = self.clip.absent
        return report

    def _rest(self) -> int:
        """The number of frames of which nothing was heard."""
        report = self.report
        known = len(report.done) + len(report.skipped) + len(report.failed)
        return len(self.stages.numbers) - known

    def read(self) -> None:
        """The first stage: files to frames."""
        for number in self.stages.numbers:
            if self.hopeless.is_set():
                break
            self.places.get()
            if self.asked.is_set():
                break
            try:
                self._read_one(number)
            except (Error, OSError, MemoryError) as error:
                self._fail(number, error)
            finally:
                self.stages.forget(number)
        self.to_blur.put(None)

    def _read_one(self, number: int) -> None:
        made_of = self.stages.made_of(number)
        if self.resume and self.output.done(number, made_of):
            self.places.put(None)
            self.report.skipped.append(number)
            self.progress(number, "skipped")
            return
        self.to_blur.put(self.stages.read(number, made_of))

    def blur_one(self, read: ReadFrame) -> None:
        """The second stage, for one frame."""
        if self.asked.is_set():
            self.places.put(None)
            return
        try:
            blurred = self.stages.blur(read)
        except (InputError, GpuMemoryError) as error:
            self._fail(read.number, error)
            return
        if blurred.bad:
            self.report.bad[read.number] = blurred.bad
        self.to_write.put(blurred)

    def write(self) -> None:
        """The third stage: results to files."""
        reasons: list[str] = []
        while (blurred := self.to_write.get()) is not None:
            number = blurred.number
            if self.hopeless.is_set():
                self.places.put(None)
                continue
            try:
                self.output.write_views(blurred.views, blurred.made_of)
            except (Error, OSError, MemoryError, RuntimeError) as error:
                self._fail(number, error)
                reasons.append(self.output.why_hopeless(error))
                if reasons[-1] and (
                    self.output.is_video or reasons[-HOPELESS:] == HOPELESS * reasons[-1:]
                ):
                    self.report.stopped = reasons[-1]
                    self.hopeless.set()
            else:
                reasons.clear()
                self.places.put(None)
                self.report.done.append(number)
                self.progress(number, "done")
            del blurred

    def _fail(self, number: int, error: BaseException) -> None:
        self.places.put(None)
        self.report.failed[number] = reason(error)
        self.progress(number, "failed")

    def _guarded(self, stage: Callable[[], None]) -> None:
        try:
            stage()
        except StopError:
            pass
        except BaseException as error:  # a fault of ours: the main thread raises it
            self.crash.append(error)
            self.stop.set()


def vectors_sequence(
    clip: Clip,
    output: VectorOutput,
    *,
    blur: Blur | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    stop: threading.Event | None = None,
) -> BatchReport:
    """Write the motion of every frame of `clip` into `output`, in the form of another program.

    It is the motion that `blur_sequence` follows: from vectors in any convention, or from depth and
    cameras. Frames without motion are in the report's `failed`; everything else is as for
    `blur_sequence`. `blur`: its device is used, and its `max_blur` limits the motion.
    """
    stages = MotionStages(clip, blur or Blur("tap"), all_views=output.takes_views)
    return _Pipeline(stages, output, resume, progress, stop).run()
