"""Whole sequences: rendered frames through a Blur into files, and scenes into files.

Three threads read, blur and write concurrently. At most IN_FLIGHT frames are in memory,
however long the sequence. A failing frame is reported and skipped.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from .errors import Error, GpuMemoryError, InputError
from .frame import Frame
from .io import exr
from .io.clip import Clip
from .io.frame_file import FrameFile
from .io.frame_numbers import frame_list, has_view
from .io.output import Output
from .io.vector_output import VectorOutput
from .pipeline import Blur
from .rates import Conversion, ConversionStages
from .render import Render
from .stages import IN_FLIGHT, Handover, MotionStages, ReadFrame, Stages, StopError, reason


@dataclass
class BatchReport:
    """Result of a run."""

    done: list[int] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)  # already there (resume)
    failed: dict[int, str] = field(default_factory=dict)
    stopped: str = ""  # why the rest was not tried, or there is no video
    bad: dict[int, dict[str, int]] = field(default_factory=dict)  # pixels not finite, by input
    absent: list[str] = field(default_factory=list)  # masks that no frame has; see Clip.absent

    def __repr__(self) -> str:
        counts = {"done": self.done, "already there": self.skipped, "failed": self.failed}
        told = [f"{len(numbers)} {word}" for word, numbers in counts.items() if numbers]
        why = f", stopped: {self.stopped[:200]}" if self.stopped else ""
        return f"BatchReport({', '.join(told) or 'nothing done'}{why})"

    def _repr_html_(self) -> str:
        rows = [("done", frame_list(self.done)), ("already there", frame_list(self.skipped))]
        failed = sorted(self.failed.items())
        rows += [(f"frame {number} failed", why) for number, why in failed[:MOST_ROWS]]
        if more := failed[MOST_ROWS:]:
            rows.append(("failed too", frame_list([number for number, _ in more])))
        for number, counts in sorted(self.bad.items())[:MOST_ROWS]:
            what = ", ".join(f"{count} of {name}" for name, count in counts.items())
            rows.append((f"frame {number}: pixels that are not finite", what))
        rows += [("stopped", self.stopped)] + [("in no frame", name) for name in self.absent]
        told = [(head, text) for head, text in rows if text]
        return "<table>{}</table>".format(
            "".join(
                f'<tr><th style="text-align:left">{escape(head)}</th>'
                f'<td style="text-align:left">{escape(text)}</td></tr>'
                for head, text in told or [("done", "nothing")]
            )
        )


MOST_ROWS = 20  # of a report in a notebook, of a kind
HOPELESS = 3  # frames one after the other that cannot be written for the same reason
ON_REQUEST = "on request"  # why a run stopped whose `stop` was set

Progress = Callable[[int, str], None]
"""Called with a frame's number and "done", "skipped" or "failed"."""


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

    Of stereo frames every view is blurred, or the one that the clip was opened for; an output that
    holds one picture gets the default view.

    Frames that cannot be read, blurred or written are in the report's `failed`, with the
    reason; the others are done. Where frame after frame cannot be written for the same reason (a
    full disk, a folder that is gone), or a video cannot go on, the run stops and `stopped`
    says why. Once `stop` is set, no other frame is begun; those that are blurred are written, and
    `stopped` is "on request". Interrupted, nothing half written is left and the interruption goes
    on. InputError, before any frame is blurred, where a mask names an object that no Cryptomatte
    has. What has no name is known at the end: `absent`, if every frame was read.
    """
    _check_names(clip, output)
    stages = Stages(clip, blur, confidence, output.takes_views)
    return _Pipeline(stages, output, resume, progress, stop).run()


def convert_sequence(
    clip: Clip,
    blur: Blur,
    output: Output,
    conversion: Conversion,
    *,
    resume: bool = False,
    progress: Progress | None = None,
    stop: threading.Event | None = None,
) -> BatchReport:
    """Blur `clip` into `output` at another rate; numbers are those of the output's frames.

    Everything else is as for `blur_sequence`; see rates.py for what an output frame is made of.
    """
    _check_names(clip, output)
    stages = ConversionStages(clip, blur, conversion, output.takes_views)
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

    It is the motion that `blur_sequence` follows: of vectors in any convention, or of depth and
    cameras. Frames without motion are in the report's `failed`; everything else is as there.
    `blur`: gives the device, and may limit the motion (`max_blur`).
    """
    stages = MotionStages(clip, blur or Blur("tap"), all_views=output.takes_views)
    return _Pipeline(stages, output, resume, progress, stop).run()


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
        seen = render.frame(time, number, light=True) if passes else None
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
    for layer, light in (("DiffDir", frame.diffuse_light), ("DiffCol", frame.diffuse_color)):
        if light is not None:
            channels |= {f"{layer}.{c}": light[..., i] for i, c in enumerate("RGB")}
    width, height = frame.size
    window = (0, 0, width - 1, height - 1)
    part = exr.Part("", channels, {}, window, window)
    file, origin = exr.Exr(Path(), [part]), {name: (part, name) for name in channels}
    return FrameFile(number, Path(), file, channels, {}, part=part, origin=origin)
