"""Videos through pipes: YUV4MPEG2 in, out, or both; nothing is known of the end."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import BinaryIO

from ..color.coding import Coding
from ..errors import InputError
from ..io import atomic
from ..io.pipes import STDIN, STDOUT, is_pipe
from ..settings import OutputSettings
from ..settings.output import rate_of
from ..settings.video import VideoSettings
from ..shots.cut_list import CutList
from ..video.clock import tick
from ..video.exposures import Exposure, Exposures
from ..video.output_times import OutputFrame
from ..video.write.encoders import FINEST_RATE, SUFFIXES, chosen
from ..video.write.pictures import CodedVideo
from ..video.y4m import Y4mReader, Y4mWriter, coding_in
from .pictures import SteadyExposures
from .video import VideoRequest, VideoRun

_BUFFER = 1 << 20  # bytes
_OF_FILES = "begin", "end", "speed"  # of VideoSettings


@dataclass
class PipeReport:
    """Result of a run through a pipe."""

    frames: int = 0
    """Number of output frames."""
    loss: str = ""
    """The loss at the end of an input that is cut off, in words."""
    cuts: list[int] = field(default_factory=list)
    """Numbers of the input's pictures that begin a shot."""


@dataclass(frozen=True)
class _Source:
    """The input: its exposures, and facts for the output."""

    size: tuple[int, int]
    coding: Coding
    rate: Fraction
    space: str
    exposures: Exposures
    frames: Iterator[tuple[OutputFrame, Exposure]]
    reader: Y4mReader | None


def blur_pipe(
    source: str,
    output: OutputSettings,
    request: VideoRequest,
    *,
    stdout: BinaryIO | None = None,
    device: str | None = None,
    fps_in: str | None = None,
    color_in: str | None = None,
    tell: Callable[[str], None] = lambda text: None,
    progress: Callable[[int, str], None] | None = None,
) -> PipeReport:
    """Blur from a pipe, into a pipe, or both; the other end is a video's file.

    `stdout`: the unbuffered stream that STDOUT stands for. `fps_in`: pictures a second of a stream
    that does not say, or another rate than it says. `color_in`: its colours (y4m.COLORS). `tell` is
    called with lines that a user should know. InputError for settings that a pipe cannot have.
    """
    _check(source, output, request)
    with ExitStack() as stack:
        reader = None
        if is_pipe(source):  # before the GPU: an empty stream is told at once
            stream = stack.enter_context(_input(source))
            reader = Y4mReader(stream, _plain(source), color_in, request.input.max_mb)
        run = request.open(device)
        tell(f"motion: {run.how}")
        found = _piped(reader, run, output, fps_in) if reader else _of_file(source, run, output)
        for text in reader.notes if reader else ():
            tell(f"{_plain(source)}: {text}")
        report = PipeReport()
        put, close, abandon = _output(output, found, request.video, stack, stdout)
        try:
            for moment, exposure in found.frames:
                put(moment, exposure)
                report.frames += 1
                if progress:
                    progress(moment.number, "done")
            close()
        except BaseException:
            abandon()
            raise
        reel = found.exposures.reel
        report.cuts = sorted(reel.cuts) if reel else []
        report.loss = reader.loss if reader else ""
        if reader and not report.frames:
            raise InputError(reader.loss or f"{_plain(source)}: holds no pictures")
        return report


def _check(source: str, output: OutputSettings, request: VideoRequest) -> None:
    plain = VideoSettings()
    if output.resume:
        raise InputError("`resume` needs files; nothing of a pipe is kept")
    if is_pipe(source):
        used = [name for name in _OF_FILES if getattr(request.video, name) != getattr(plain, name)]
        if used or request.input.frames:
            raise InputError(
                f"`{[*used, 'frames'][0]}` is for files; a pipe is read from its beginning"
            )
        if request.blur.holdout:
            raise InputError("`holdout` of a video is for files; a pipe is read once")
    elif not is_pipe(output.output):
        raise InputError("neither input nor output is a pipe")
    if not is_pipe(output.output) and Path(output.output).suffix.lower() not in SUFFIXES:
        known = " ".join(sorted(SUFFIXES))
        raise InputError(f"a pipe becomes a pipe (-) or a video ({known}), got {output.output}")


def _input(source: str) -> BinaryIO:
    if source == STDIN:
        return os.fdopen(os.dup(0), "rb", _BUFFER)
    return open(source, "rb", _BUFFER)


def _named(pipe: str) -> BinaryIO:
    return open(pipe, "wb", 0)


def _plain(name: str) -> str:
    return {STDIN: "stdin", STDOUT: "stdout"}.get(name, name)


def _piped(reader: Y4mReader, run: VideoRun, output: OutputSettings, fps_in: str | None) -> _Source:
    rate = rate_of(fps_in, "fps_in") if fps_in else reader.rate
    if rate is None:
        raise InputError(f"{reader.name}: does not say its rate; set `fps_in`")
    request, cuts = run.request, CutList(run.request.input.cuts or "")
    exposures = Exposures(
        run.blur,
        run.motion,
        fill=request.video.duplicates == "fill",
        cuts=cuts.is_search,
        known_cuts=cuts.frames(0),
        highlights=request.video.highlights,
    )
    fps = rate if output.fps in (None, "source") else output.rate_or(rate)
    fps = fps.limit_denominator(FINEST_RATE)
    frames = SteadyExposures(exposures, rate, fps).of(reader.pictures(), request.shutter.make())
    return _Source(reader.size, reader.coding, fps, reader.space, exposures, frames, reader)


def _of_file(source: str, run: VideoRun, output: OutputSettings) -> _Source:
    plan = run.plan(source, output)
    reader, exposures = plan.reader, run.exposures(plan)
    if reader.is_variable and output.fps in (None, "source"):
        raise InputError(f"{source}: its rate is variable, that of a pipe cannot be; set `fps`")
    frames = exposures.exposures(run.request.shutter.make(), plan.wanted)
    rate = 1 / plan.wanted[0].interval
    return _Source(reader.size, coding_in(reader.coding), rate, "", exposures, frames, None)


def _output(
    output: OutputSettings,
    found: _Source,
    video: VideoSettings,
    stack: ExitStack,
    stdout: BinaryIO | None,
) -> tuple[Callable[[OutputFrame, Exposure], None], Callable[[], None], Callable[[], None]]:
    """Functions that take an exposure, close the output, and leave nothing of it."""
    if is_pipe(output.output):
        stream = stdout if output.output == STDOUT else None
        stream = stream or stack.enter_context(_named(output.output))
        writer = Y4mWriter(stream, found.size, found.rate, found.coding, found.space)
        return (
            lambda _, exposure: writer.add(exposure.coded(found.coding)),
            lambda: None,
            lambda: None,
        )
    path = Path(output.output)
    if (is_there := path.exists()) and not output.overwrite:
        raise InputError(f"{path} exists; `overwrite=True` replaces it")
    encoding = chosen(path, video.codec, video.quality, video.encoder)
    coding, _ = encoding.coding(found.coding)
    path.parent.mkdir(parents=True, exist_ok=True)
    made = CodedVideo(
        path, atomic.temporary_name(path), encoding, coding, found.size, found.rate,
        tick(1 / found.rate), is_new=not is_there,
    )  # fmt: skip
    return (lambda moment, e: made.add(e.coded(coding), moment.time), made.close, made.abandon)
