"""Whole sequences: rendered frames through a Blur into files, and scenes into files.

Three threads read, blur and write concurrently. At most IN_FLIGHT frames are in memory,
however long the sequence. A failing frame is reported and skipped.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .errors import Error, GpuMemoryError, InputError
from .frame import Frame
from .io import exr
from .io.clip import Clip
from .io.frame_file import FrameFile
from .io.frame_numbers import has_view
from .io.output import Output, Result
from .io.vector_output import VectorOutput
from .io.windows import Placement
from .pipeline import Blur
from .render import Render


@dataclass
class BatchReport:
    """Result of a run."""

    done: list[int] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)  # already there (resume)
    failed: dict[int, str] = field(default_factory=dict)
    stopped: str = ""  # why the rest was not tried, or there is no video
    bad: dict[int, dict[str, int]] = field(default_factory=dict)  # pixels not finite, by input
    absent: list[str] = field(default_factory=list)  # masks that no frame has; see Clip.absent


@dataclass
class _Job:
    """One frame, read and to be blurred: every view of it."""

    number: int
    views: list[tuple[FrameFile, Frame, Placement | None]]
    made_of: dict[str, Any]


@dataclass
class _Blurred:
    """One frame, blurred and to be written."""

    number: int
    views: list[Result]
    made_of: dict[str, Any]


IN_FLIGHT = 3  # frames, with all their views: one being read, one on the GPU, one being written
HOPELESS = 3  # frames one after the other that cannot be written for the same reason

Progress = Callable[[int, str], None]
"""Called with a frame's number and "done", "skipped" or "failed"."""


class _StopError(Exception):
    """The other end of a queue is gone."""


class _Handover:
    """A queue whose end notices a stop."""

    def __init__(self, stop: threading.Event):
        self._queue: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._stop = stop
        self.put = self._queue.put

    def get(self) -> Any:
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
    """Blur every frame of `clip` into `output`; `confidence` adds confidence layers.

    Of stereo frames every view is blurred, or the one that the clip was opened for; an output that
    holds one picture gets the default view.

    Frames that cannot be read, blurred or written are in the report's `failed`, with the
    reason; the others are done. Where frame after frame cannot be written for the same reason (a
    full disk, a folder that is gone), or a video cannot go on, the run stops and `stopped`
    says why. Interrupted, nothing half written is left and the interruption goes on.
    InputError, before any frame is blurred, where a mask names an object that no Cryptomatte
    has. What has no name is known at the end: `absent`, if every frame was read.
    """
    try:
        _check_names_of_views(clip, output)
        clip.check_names()
    except BaseException:
        output.abandon()
        raise
    return _Pipeline(clip, blur, output, resume, confidence, progress).run()


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
        clip: Clip,
        blur: Blur,
        output: Output,
        resume: bool,
        confidence: bool,
        progress: Progress | None,
    ):
        self.clip, self.blur, self.output = clip, blur, output
        self.resume, self.confidence = resume, confidence
        self.progress = progress or (lambda number, state: None)
        self.report = BatchReport()
        self.stop, self.hopeless = threading.Event(), threading.Event()
        self.to_blur, self.to_write = _Handover(self.stop), _Handover(self.stop)
        self.places = _Handover(self.stop)
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
            while (job := self.to_blur.get()) is not None:
                self.blur_one(job)
                del job
            self.to_write.put(None)
            for thread in threads:
                while thread.is_alive():  # a join without limit would hold back Ctrl-C
                    thread.join(0.1)
        except _StopError:
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
        if len(report.done) == len(self.clip.numbers):
            report.absent = self.clip.absent
        return report

    def read(self) -> None:
        """The first stage: files to frames."""
        neighbours = "neighbours" in self.blur.method.uses
        for number in self.clip.numbers:
            if self.hopeless.is_set():
                break
            self.places.get()
            try:
                self._read_one(number, neighbours)
            except (Error, OSError, MemoryError) as error:
                self._fail(number, error)
            finally:
                self.clip.forget(number - 1 if neighbours else number)
        self.to_blur.put(None)

    def _read_one(self, number: int, neighbours: bool) -> None:
        made_of = self.clip.made_of(number, neighbours)
        if self.resume and self.output.done(number, made_of):
            self.places.put(None)
            self.report.skipped.append(number)
            self.progress(number, "skipped")
            return
        sources = self.clip.sources(number)
        if not self.output.takes_views:
            del sources[1:]
        views: list[tuple[FrameFile, Frame, Placement | None]] = []
        errors: list[tuple[InputError, FrameFile]] = []
        for source in sources:
            try:
                views.append((source, *self._prepared(source, neighbours)))
            except InputError as error:
                errors.append((error, source))
        if errors:
            error, source = errors[0]
            raise _of_view(error, source, views, self.blur.method.needs)
        if unread := sorted({number - 1, number + 1} & self.clip.unread):
            made_of["unread"] = unread  # so that --resume asks for them again
        self.to_blur.put(_Job(number, views, made_of))

    def _prepared(self, source: FrameFile, neighbours: bool) -> tuple[Frame, Placement | None]:
        normal = "normal" in self.blur.method.uses
        return self.clip.placed(source, self.blur.reach, neighbours, normal)

    def blur_one(self, job: _Job) -> None:
        """The second stage, for one frame."""
        results: list[Result] = []
        for source, frame, placement in job.views:
            try:
                results.append(self._blurred(source, frame, placement))
            except (InputError, GpuMemoryError) as error:
                needs = self.blur.method.needs
                self._fail(job.number, _of_view(error, source, job.views, needs))
                return
            for name, count in frame.bad.items():
                bad = self.report.bad.setdefault(job.number, {})
                bad[name] = bad.get(name, 0) + count
        self.to_write.put(_Blurred(job.number, results, job.made_of))

    def _blurred(self, source: FrameFile, frame: Frame, placement: Placement | None) -> Result:
        if self.confidence:
            return Result(source, *self.blur.with_confidence(frame), placement)
        return Result(source, self.blur(frame), placement=placement)

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
        self.report.failed[number] = _reason(error)
        self.progress(number, "failed")

    def _guarded(self, stage: Callable[[], None]) -> None:
        try:
            stage()
        except _StopError:
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
) -> BatchReport:
    """Write the motion of every frame of `clip` into `output`, in the form of another program.

    It is the motion that `blur_sequence` follows: of vectors in any convention, or of depth and
    cameras. Frames without motion are in the report's `failed`; everything else is as there.
    `blur`: gives the device, and may limit the motion (`max_blur`).
    """
    return _VectorPipeline(clip, blur or Blur("tap"), output, resume, False, progress).run()


class _VectorPipeline(_Pipeline):
    """Motion instead of blurred pictures."""

    def _prepared(self, source: FrameFile, neighbours: bool) -> tuple[Frame, None]:
        frame = self.clip.frame(source, picture=False, normal=False)
        if "motion" not in frame.has:
            raise InputError("no motion: neither vectors nor a camera")
        return frame, None

    def _blurred(self, source: FrameFile, frame: Frame, placement: Placement | None) -> Result:
        return Result(source, self.blur.motion(frame))


def _of_view(
    error: Error,
    source: FrameFile,
    views: list[tuple[FrameFile, Frame, Placement | None]],
    needs: frozenset[str],
) -> InputError:
    """The error with the name of the file, and of those of its `views` that can be blurred."""
    text = str(error) if source.name in str(error) else f"{source.name}: {error}"
    others = [str(o.view) for o, frame, _ in views if o is not source and frame.has >= needs]
    return InputError(text + (f"; choose a view: {', '.join(others)}" if others else ""))


def _reason(error: BaseException) -> str:
    """The error in one line that names the file it is about."""
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename}: {error.strerror.lower()}"
    return " ".join(str(error).split()) or type(error).__name__


def render_frames(
    render: Render,
    moments: dict[int, float],
    output: Output,
    sharp: bool,
    passes: bool,
    confidence: bool,
    resume: bool,
    progress: Progress | None,
) -> int:
    """Render every moment into `output`; returns how many were there already (`resume`).

    `sharp`: without blur. `passes`: EXR with all that `wgmb blur` can use. `confidence`: EXR
    with how sure the method is.
    """
    progress, skipped = progress or (lambda number, state: None), 0
    for number, time in moments.items():
        if resume and output.done(number):
            skipped += 1
            progress(number, "skipped")
            continue
        seen = render.frame(time, number) if passes else None
        planes = {}
        if confidence:
            result, planes = render.with_confidence(time, number)
        else:
            result = render.sharp(time) if sharp else render(time, number)
        source = (
            _with_passes(render, seen, number)
            if passes and seen
            else FrameFile(number, Path(), None, {}, {})
        )
        output.write(result, source, planes)
        progress(number, "done")
    output.close()
    return skipped


def _with_passes(render: Render, frame: Frame, number: int) -> FrameFile:
    """A frame's passes as layers that io/clip.py finds by their names."""
    motion = render.blur.motion(frame)
    assert frame.depth is not None and frame.normal is not None and frame.object_id is not None
    channels = {name: frame.color[..., i] for i, name in enumerate("RGBA")}
    channels |= {"Z": frame.depth, "object_id.X": frame.object_id}
    channels |= {f"normal.{c}": frame.normal[..., i] for i, c in enumerate("XYZ")}
    names = ("to_prev.x", "to_prev.y", "to_next.x", "to_next.y")
    channels |= {name: motion[..., i] for i, name in enumerate(names)}
    width, height = frame.size
    window = (0, 0, width - 1, height - 1)
    part = exr.Part("", channels, {}, window, window)
    file, origin = exr.Exr(Path(), [part]), {name: (part, name) for name in channels}
    return FrameFile(number, Path(), file, channels, {}, part=part, origin=origin)
