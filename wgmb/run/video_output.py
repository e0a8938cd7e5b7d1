"""Write the pictures made of a video: as a video with the input's other streams, or as frames."""

from __future__ import annotations

import os
import zlib
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import wgpu

from ..errors import InputError
from ..io import atomic, record
from ..io.pipes import is_pipe
from ..output.finished_videos import is_finished
from ..output.names import beyond, check_suffix, refuse_inputs
from ..settings import OutputSettings
from ..settings.groups import changed
from ..settings.video import VideoSettings
from ..video.clock import Clock
from ..video.output_times import OutputFrame, OutputFrames
from ..video.read.reader import VideoReader
from ..video.write.encoders import SUFFIXES, chosen
from ..video.write.format import VideoFormat
from ..video.write.gif import check_rate
from ..video.write.other_streams import OtherStreams, sounds_in
from ..video.write.segments import Segments, remove_left
from ..video.write.writer import VideoWriter
from .engine import Input, RunOptions, run
from .file_sink import FileSink
from .report import Progress
from .video_sink import Form, LightForm, VideoSink, coded_form, frame_record

_OF_VIDEOS = "codec", "quality", "encoder", "streams", "pitch"  # of VideoSettings
FIRST = 1  # number of the first frame, where they are image files


class VideoSource(Protocol):
    """A video of which pictures are made."""

    @property
    def reader(self) -> VideoReader:
        """The input."""
        ...

    @property
    def clock(self) -> Clock:
        """The clock that gives output times by input times."""
        ...

    @property
    def device(self) -> wgpu.GPUDevice:
        """The device that holds the pictures."""
        ...

    def frames(self, wanted: Sequence[OutputFrame], form: Form) -> Input[Any, Any]:
        """Output frames in a form, as the input of a run."""
        ...


def sounds_kept(reader: VideoReader, output: OutputSettings, video: VideoSettings) -> list[int]:
    """The streams of sound that are written beside the pictures of a video, by their numbers."""
    suffix = Path(output.output).suffix.lower()
    if suffix not in SUFFIXES or video.streams != "all":
        return []
    return sounds_in(reader.path, suffix, is_encoded=video.pace != 1)


def losses(
    reader: VideoReader, output: OutputSettings, video: VideoSettings, clock: Clock, rate: Fraction
) -> list[str]:
    """Lines about losses in the output, known before the run: of its pictures, and of the rest.

    `rate`: frames per second of the output.
    """
    path = Path(output.output)
    if path.suffix.lower() not in SUFFIXES:
        return _beside_frames(reader, video)
    encoding = chosen(path, video.codec, video.quality, video.encoder)
    coding, lost = encoding.coding(reader.coding)
    form = VideoFormat(encoding, coding, reader.size, rate, 1 / rate, reader.facts)
    others = _others(reader, video, clock)
    streams = others.losses(encoding, rate) if others is not None else []
    return [*lost, *form.left_out, *streams]


def _beside_frames(reader: VideoReader, video: VideoSettings) -> list[str]:
    """That files of frames hold pictures alone."""
    if video.streams != "all":
        return []
    names = {"audio": "sound", "subtitle": "subtitles", "video": "other pictures"}
    kinds = [names.get(stream.kind, stream.kind) for stream in reader.streams]
    kinds = list(dict.fromkeys([*kinds, *["chapters"] * bool(reader.chapters)]))
    if not kinds:
        return []
    are = "are" if len(kinds) > 1 or kinds[0].endswith("s") else "is"
    return [f"{', '.join(kinds)} {are} left out: files of frames hold none"]


def _others(reader: VideoReader, video: VideoSettings, clock: Clock) -> OtherStreams | None:
    if video.streams != "all":
        return None
    return OtherStreams(reader.path, reader.index, clock, video.pitch == "keep")


def check_output(output: OutputSettings, video: VideoSettings, source: str | Path) -> None:
    """InputError for an output that cannot be made of a video, before that is opened.

    This covers checks that need no look at the input: the kind of file, its codec, a rate that is
    set, and an output that is the input.
    """
    output.check()
    if is_pipe(output.output):
        return
    path = Path(output.output)
    check_suffix(path)
    if path.suffix.lower() not in SUFFIXES:
        for name in changed(video):
            if name in _OF_VIDEOS:
                raise InputError(f"`{name}` needs a video as output, got {path}")
    else:
        chosen(path, video.codec, video.quality, video.encoder)
        if path.suffix.lower() == ".gif" and output.fps not in (None, "source"):
            check_rate(path, output.rate)
    there = [path] if os.path.exists(os.path.realpath(path)) else []
    refuse_inputs(path.parent, [path.name], there, [Path(source)])


def write(
    source: VideoSource,
    output: OutputSettings,
    video: VideoSettings,
    wanted: OutputFrames,
    settings: dict[str, Any],
    *,
    masks: Sequence[Path] = (),
    progress: Progress | None = None,
) -> list[str]:
    """Write the selected frames; returns the losses of the output, in lines.

    `masks`: further files that are read, which are never written.
    """
    is_video = Path(output.output).suffix.lower() in SUFFIXES
    to = _write_video if is_video else _write_frames
    inputs, made_of = [source.reader.path, *masks], settings | _made_of(source, masks)
    return to(source, output, video, wanted, made_of, inputs, progress)


def _write_video(
    source: VideoSource,
    output: OutputSettings,
    video: VideoSettings,
    wanted: OutputFrames,
    settings: dict[str, Any],
    inputs: Sequence[Path],
    progress: Progress | None,
) -> list[str]:
    """Write a video, with `resume` in segments; returns its losses, in lines."""
    path, reader = Path(output.output), source.reader
    encoding = chosen(path, video.codec, video.quality, video.encoder)
    coding, lost = encoding.coding(reader.coding)
    made_of = settings | {"times": wanted.key}
    there = [path] if os.path.exists(os.path.realpath(path)) else []
    refuse_inputs(path.parent, [path.name], there, inputs)
    if is_finished(path, made_of, resume=output.resume, overwrite=output.overwrite):
        remove_left(path)
        return ["is already done"]
    encoding.check_pause(path, wanted.longest, wanted.tick)
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.sweep(path.parent, [path.name])
    mode = atomic.mode_of(path.parent, inputs)
    rate, tick = 1 / wanted[0].interval, wanted.tick
    form = VideoFormat(encoding, coding, reader.size, rate, tick, reader.facts)
    others = _others(reader, video, source.clock)
    coded = coded_form(coding)
    if output.resume and encoding.codec != "gif":  # which has one palette after another
        segments = Segments(path, form, wanted.times, made_of, mode)
        try:
            for numbers in segments.to_do():
                part = source.frames(wanted[numbers.start : numbers.stop], coded)
                run(part, VideoSink(segments.begin(numbers)), RunOptions(progress=progress))
            return [*lost, *segments.join(record.blank(made_of), others)]
        finally:
            segments.release()
    said, temporary = record.blank(made_of), atomic.temporary_name(path)
    writer = VideoWriter(
        path, temporary, form, None, others, record=said, is_new=not there, mode=mode
    )
    run(source.frames(wanted, coded), VideoSink(writer), RunOptions(progress=progress))
    remove_left(path)
    return [*lost, *writer.left_out]


def _made_of(source: VideoSource, masks: Sequence[Path]) -> dict[str, Any]:
    """The files that every picture depends on, and the part of the input that is let through."""
    found, clock = os.stat(source.reader.path), source.clock
    return {
        "input": [source.reader.path.name, found.st_size, found.st_mtime_ns],
        "masks": [_crc(path.read_bytes()) for path in masks],
        "part": [str(clock.first), str(clock.end)],
    }


def _crc(data: bytes) -> str:
    return f"{zlib.crc32(data):08x}"


def _write_frames(
    source: VideoSource,
    output: OutputSettings,
    video: VideoSettings,
    wanted: OutputFrames,
    settings: dict[str, Any],
    inputs: Sequence[Path],
    progress: Progress | None,
) -> list[str]:
    """Write image files."""
    numbers = list(range(FIRST, FIRST + len(wanted)))
    files = replace(output, fps=None).make(settings, numbers, inputs)
    left: Sequence[OutputFrame] = wanted
    if output.resume:
        left = [
            frame for frame in wanted if not files.done(FIRST + frame.number, frame_record(frame))
        ]
    said = _beside_frames(source.reader, video)
    remain = list(filter(None, [*said, beyond(output.output, numbers[-1])]))
    if not left:
        return ["is already done", *remain]
    channels = 4 if source.reader.coding.alpha else 3
    form = LightForm(source.device, channels, FIRST)
    run(source.frames(left, form), FileSink(files), RunOptions(progress=progress))
    done = len(wanted) - len(left)
    return [f"{done} of {len(wanted)} frames were done before", *remain] if done else remain
