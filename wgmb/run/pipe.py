"""Videos through pipes, at one end or at both; the length of the input is unknown."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO, Protocol

from ..color.coding import CodedPicture, Coding
from ..errors import InputError
from ..io import atomic
from ..io.pipes import STDIN, STDOUT, PipeWriter, is_pipe
from ..settings import OutputSettings
from ..settings.groups import changed
from ..settings.output import rate_of
from ..settings.video import VideoSettings
from ..video.clock import tick
from ..video.exposures import Exposures
from ..video.holdouts import NONE
from ..video.read.stream_reader import StreamReader, only_pictures
from ..video.write.encoders import FINEST_RATE, SUFFIXES, Encoding, Facts, chosen
from ..video.write.format import VideoFormat
from ..video.write.streamed import MatroskaStream
from ..video.write.writer import VideoWriter
from ..video.y4m import Y4mReader, Y4mWriter, coding_in, lost_in
from . import engine
from .engine import Input
from .pictures import SteadyFrames, steady
from .report import VideoReport
from .video import ExposedFrames, VideoRequest, VideoRun
from .video_sink import Form, PictureWriter, VideoSink, coded_form

_BUFFER = 1 << 20  # bytes
_OF_RANGES = "begin", "end", "speed"  # of VideoSettings
_OF_FILES = "streams", "pitch"  # too; both of sound and other streams
_Y4M = b"YUV4MPEG2"


Reader = Y4mReader | StreamReader


@dataclass(frozen=True)
class StreamHints:
    """Facts that a user states of a stream of pictures, which may not state them itself."""

    fps_in: str | None = None
    """Pictures a second of a stream that states none, or another rate than it states."""
    color_in: str | None = None
    """Its colours, a name in COLORS."""


@dataclass(frozen=True)
class _Source:
    """The input: its exposures, and facts for the output."""

    size: tuple[int, int]
    coding: Coding
    facts: Facts
    rate: Fraction
    space: str
    """The name of the samples in YUV4MPEG2, if they came so."""
    exposures: Exposures
    frames: Callable[[Form], Input[Any, Any]]
    notes: list[str]
    """Lines that a user should know."""
    loss: Callable[[], str]
    """The loss so far, in words."""
    scaling: Callable[[], str] = str
    """Pictures of another size, in words."""

    def format(self, encoding: Encoding, base: Fraction) -> tuple[VideoFormat, list[str]]:
        """The form in which the output is written; and its losses, in words."""
        coding, lost = encoding.coding(self.coding)
        return VideoFormat(encoding, coding, self.size, self.rate, base, self.facts), lost


class _Writer(PictureWriter, Protocol):
    """Writer of the output: how its pictures are coded, and its losses."""

    coding: Coding
    left_out: list[str]


def blur_pipe(
    source: str,
    output: OutputSettings,
    request: VideoRequest,
    *,
    stdout: BinaryIO | None = None,
    device: str | None = None,
    hints: StreamHints = StreamHints(),
    tell: Callable[[str], None] = lambda text: None,
    progress: Callable[[int, str], None] | None = None,
) -> VideoReport:
    """Blur from a pipe, into a pipe, or both; the other end is a video's file.

    `stdout`: the unbuffered stream that STDOUT stands for. `tell` is called with lines that a user
    should know. InputError for settings that a pipe cannot have.
    """
    _check(source, output, request)
    encoding, begun = _encoding(output, request.video), time.perf_counter()
    with ExitStack() as stack:
        reader = None
        if is_pipe(source):  # before the GPU: an empty stream is told at once
            stream = stack.enter_context(_input(source))
            reader = reader_of(stream, _plain(source), request, hints)
        run = request.open(device)
        tell(f"motion: {run.how}")
        if request.shutter.remark:
            tell(request.shutter.remark)
        found = (
            _piped(reader, run, output, hints.fps_in) if reader else _of_file(source, run, output)
        )
        for text in found.notes:
            tell(f"{_plain(source)}: {text}")
        writer = _writer(output, found, encoding, stack, stdout)
        for text in writer.left_out:
            tell(text)
        sink = VideoSink(writer)
        engine.run(
            found.frames(coded_form(writer.coding)), sink, engine.RunOptions(progress=progress)
        )
        loss = found.loss()
        if not sink.count:
            raise InputError(loss or f"{_plain(source)}: holds no pictures")
        report = VideoReport(
            Path(source),
            output.output,
            sink.count,
            time.perf_counter() - begun,
            notes=found.notes,
            left_out=writer.left_out,
            loss=loss,
            scaling=found.scaling(),
        )
        return run.described(report, found.exposures)


def _check(source: str, output: OutputSettings, request: VideoRequest) -> None:
    if output.resume:
        raise InputError("`resume` needs files; nothing of a pipe is kept")
    output.check()
    used = changed(request.video)
    for name in _OF_FILES:
        if name in used:
            raise InputError(f"`{name}` is for files; a pipe carries pictures alone")
    if is_pipe(source):
        ranges = [name for name in used if name in _OF_RANGES]
        if ranges or request.input.frames:
            raise InputError(
                f"`{[*ranges, 'frames'][0]}` is for files; a pipe is read from its beginning"
            )
        if request.blur.holdout not in ((), (NONE,)):
            raise InputError("`holdout` of a video is for files; a pipe is read once")
    elif not is_pipe(output.output):
        raise InputError("neither input nor output is a pipe")


def _encoding(output: OutputSettings, video: VideoSettings) -> Encoding | None:
    """The output's encoding; None for YUV4MPEG2. InputError for one that it cannot have."""
    path = Path(output.output)
    if not is_pipe(output.output):
        if path.suffix.lower() not in SUFFIXES:
            known = " ".join(sorted(SUFFIXES))
            raise InputError(f"a pipe becomes a pipe (-) or a video ({known}), got {path}")
        if path.exists() and not output.overwrite:
            raise InputError(f"{path} exists; `overwrite=True` replaces it")
        return chosen(path, video.codec, video.quality, video.encoder)
    if video.codec not in (None, "ffv1"):
        raise InputError(f"`codec` into a pipe is ffv1 (in Matroska), or none (YUV4MPEG2), got "
                         f"{video.codec}")  # fmt: skip
    if video.codec is None and (video.quality is not None or video.encoder is not None):
        raise InputError("`quality` and `encoder` are for files; YUV4MPEG2 has neither")
    return chosen("-.mkv", "ffv1", video.quality, video.encoder) if video.codec else None


def reader_of(
    stream: BinaryIO,
    name: str,
    request: VideoRequest,
    hints: StreamHints = StreamHints(),
) -> Reader:
    """The reader for a buffered input stream; see blur_pipe."""
    most = request.input.max_mb
    beginning = stream.peek(len(_Y4M))[: len(_Y4M)]  # pyright: ignore[reportAttributeAccessIssue]
    if not beginning:
        raise InputError(f"{name}: holds no pictures")
    if _Y4M.startswith(beginning):
        return Y4mReader(stream, name, hints.color_in, most)
    pause = request.video.longest_pause
    return StreamReader(
        stream, name, hints.color_in, most, keeps_time=not hints.fps_in, pause=pause
    )


def _input(source: str) -> BinaryIO:
    if source == STDIN:
        return os.fdopen(os.dup(0), "rb", _BUFFER)
    return open(source, "rb", _BUFFER)


def _named(pipe: str) -> BinaryIO:
    return open(pipe, "wb", 0)


def _plain(name: str) -> str:
    return {STDIN: "stdin", STDOUT: "stdout"}.get(name, name)


def _piped(reader: Reader, run: VideoRun, output: OutputSettings, fps_in: str | None) -> _Source:
    rate = rate_of(fps_in, "fps_in") if fps_in else reader.rate
    if rate is None:
        raise InputError(f"{reader.name}: does not say its rate; set `fps_in`")
    fps = rate if output.fps in (None, "source") else output.rate_or(rate)
    fps = fps.limit_denominator(FINEST_RATE)
    run = run.at(fps)
    made, shutter = steady(run, rate, fps), run.request.shutter.make()

    def frames(form: Form) -> SteadyFrames:
        return SteadyFrames(reader.pictures(), made, shutter, form)

    space = reader.space if isinstance(reader, Y4mReader) else ""
    return _Source(
        reader.size, reader.coding, reader.facts, fps, space, made.exposures, frames, reader.notes,
        lambda: reader.loss,
    )  # fmt: skip


def _of_file(source: str, run: VideoRun, output: OutputSettings) -> _Source:
    plan = run.plan(source, output)
    run = run.at(plan.fps)
    reader, exposures = plan.reader, run.exposures(plan)
    if reader.is_variable and output.fps in (None, "source"):
        raise InputError(f"{source}: its rate is variable, that of a pipe cannot be; set `fps`")
    shutter = run.request.shutter.make()

    def frames(form: Form) -> ExposedFrames:
        return ExposedFrames(exposures, shutter, plan.wanted, form)

    rate = 1 / plan.wanted[0].interval
    kinds = [stream.kind for stream in reader.streams] + ["chapters"] * (reader.chapters > 0)
    notes = plan.notes + ([only_pictures(kinds)] if kinds else [])
    return _Source(
        reader.size, reader.coding, reader.facts, rate, "", exposures, frames, notes, reader.loss,
        reader.scaling,
    )  # fmt: skip


def _writer(
    output: OutputSettings,
    source: _Source,
    encoding: Encoding | None,
    stack: ExitStack,
    stdout: BinaryIO | None,
) -> _Writer:
    if not is_pipe(output.output):
        assert encoding is not None
        return _ToFile(Path(output.output), source, encoding)
    stream = stdout if output.output == STDOUT else None
    stream = stream or stack.enter_context(_named(output.output))
    if encoding is not None:
        return _ToMatroska(stream, source, encoding)
    return _ToY4m(stream, source)


class _ToY4m:
    def __init__(self, stream: BinaryIO, source: _Source):
        self.coding = coding_in(source.coding)
        aspect = source.facts.pixel_aspect
        self._writer = Y4mWriter(
            stream, source.size, source.rate, self.coding, source.space, aspect
        )
        self.left_out = lost_in(source.size, source.coding, source.facts)

    def add(self, picture: CodedPicture, time: Fraction) -> None:
        self._writer.add(picture)

    def close(self) -> None:
        pass

    def abandon(self) -> None:
        pass


class _ToMatroska:
    def __init__(self, stream: BinaryIO, source: _Source, encoding: Encoding):
        form, lost = source.format(encoding, 1 / source.rate)
        self.coding, self.left_out = form.coding, [*lost, *form.left_out]
        self._writer = MatroskaStream(PipeWriter(stream), form)
        self.close, self.abandon = self._writer.close, self._writer.abandon

    def add(self, picture: CodedPicture, time: Fraction) -> None:
        self._writer.add(picture)


class _ToFile:
    def __init__(self, path: Path, source: _Source, encoding: Encoding):
        form, lost = source.format(encoding, tick(1 / source.rate))
        is_new = not path.exists()
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = atomic.temporary_name(path)
        self._video = VideoWriter(path, temporary, form, is_new=is_new)
        self.coding, self.left_out = form.coding, [*lost, *self._video.left_out]
        self.add, self.close, self.abandon = self._video.add, self._video.close, self._video.abandon
