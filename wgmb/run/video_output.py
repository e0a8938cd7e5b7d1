"""Write the pictures made of a video: as a video with the input's other streams, or as frames."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import wgpu

from ..color.coding import CodedPicture, Coding
from ..errors import InputError
from ..gpu.textures import TexturePool
from ..io import atomic, record
from ..output.names import refuse_inputs
from ..output.output import Output
from ..output.result import Result
from ..sequence.frame_file import FrameFile
from ..settings import OutputSettings
from ..settings.video import VideoSettings
from ..shutter import Shutter
from ..threads import Behind
from ..video.clock import Clock
from ..video.exposures import ExposedPicture, VideoBlur
from ..video.output_times import OutputFrame, OutputFrames
from ..video.read.reader import VideoReader
from ..video.write.encoders import SUFFIXES, chosen
from ..video.write.other_streams import OtherStreams
from ..video.write.pictures import CodedVideo
from ..video.write.segments import Segment, Segments, remove_left
from .batch_report import Progress

FIRST = 1  # number of the first frame, where they are image files
_RECORD = "comment", "description", "synopsis"  # texts of a video; the first that is free


class PictureSink(Protocol):
    """Destination of exposures: `take` on the main thread, then `put` in a thread of its own."""

    def take(self, moment: OutputFrame, exposure: ExposedPicture) -> Any:
        """The data of a picture that will be written."""
        ...

    def put(self, taken: Any) -> None:
        """Write it."""
        ...


class VideoSink:
    """Exposures as coded pictures into a video."""

    def __init__(self, video: CodedVideo | Segment, coding: Coding):
        self._video, self._coding = video, coding

    def take(self, moment: OutputFrame, exposure: ExposedPicture) -> tuple[CodedPicture, Fraction]:
        """The picture in the video's own planes."""
        return exposure.coded(self._coding), moment.time

    def put(self, taken: tuple[CodedPicture, Fraction]) -> None:
        """Append it."""
        self._video.add(*taken)


class FramesSink:
    """Exposures as image files, numbered from `first` on."""

    def __init__(self, output: Output, device: wgpu.GPUDevice, channels: int, first: int = 1):
        self._output, self._device, self._channels, self._first = output, device, channels, first
        self._images = TexturePool(device)

    def take(self, moment: OutputFrame, exposure: ExposedPicture) -> tuple[Result, dict[str, str]]:
        """The picture as an array, and what its record says of its own."""
        encoder = self._device.create_command_encoder(label="frame")
        picture = self._images.download(encoder, exposure.light())[..., : self._channels]
        file = FrameFile(self._first + moment.number, Path(), None, {}, {})
        return Result(file, picture), _moment(moment)

    def put(self, taken: tuple[Result, dict[str, str]]) -> None:
        """Write its file."""
        result, made_of = taken
        self._output.write_views([result], made_of)


def put_exposures(
    run: VideoBlur,
    shutter: Shutter,
    wanted: Sequence[OutputFrame],
    sink: PictureSink,
    progress: Progress | None = None,
) -> None:
    """Every exposure of a video into `sink`; the caller closes or abandons what it writes."""
    tell = progress or (lambda number, state: None)
    with Behind(sink.put) as put:
        for moment, exposure in run.exposures(shutter, wanted):
            put(sink.take(moment, exposure))
            tell(moment.number, "done")


class PictureMaker(Protocol):
    """Maker of the pictures of a video, such as VideoBlur."""

    @property
    def reader(self) -> VideoReader:
        """The input."""
        ...

    @property
    def clock(self) -> Clock:
        """The clock that gives output times by input times."""
        ...

    @property
    def device(self) -> Any:
        """The device that holds the pictures."""
        ...


MakePart = Callable[[Sequence[OutputFrame], PictureSink], None]
"""Makes the pictures of some of the moments, and gives them to a sink."""


def write(
    run: PictureMaker,
    output: OutputSettings,
    video: VideoSettings,
    wanted: OutputFrames,
    settings: dict[str, Any],
    make_part: MakePart,
    masks: Sequence[Path] = (),
) -> list[str]:
    """Write the pictures of the moments; returns what the output cannot hold, in lines.

    `masks`: further files that are read, which are never written.
    """
    is_video = Path(output.output).suffix.lower() in SUFFIXES
    to = _write_video if is_video else _write_frames
    inputs, made_of = [run.reader.path, *masks], settings | _made_of(run, masks)
    return to(run, output, video, wanted, made_of, make_part, inputs)


def _write_video(
    run: PictureMaker,
    output: OutputSettings,
    video: VideoSettings,
    wanted: OutputFrames,
    settings: dict[str, Any],
    make_part: MakePart,
    inputs: Sequence[Path],
) -> list[str]:
    """Write a video, with `resume` in segments; returns what it cannot hold, in lines."""
    path, reader = Path(output.output), run.reader
    encoding = chosen(path, video.codec, video.quality, video.encoder)
    coding, lost = encoding.coding(reader.coding)
    facts = reader.facts
    made_of = settings | {"times": wanted.key}
    texts = _texts(reader, made_of)
    there = [path] if os.path.exists(os.path.realpath(path)) else []
    refuse_inputs(path.parent, [path.name], there, inputs)
    is_ours = is_whole = False
    if there and output.resume:
        stated, is_whole = _record_of(path)
        is_ours = stated == json.loads(json.dumps(made_of))
    if is_ours and is_whole:
        remove_left(path)
        return ["is already done"]
    if there and not (output.overwrite or is_ours):
        more = " and was made otherwise" if output.resume else ""
        raise InputError(f"{path} exists{more}; `overwrite=True` replaces it")
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.sweep(path.parent, [path.name])
    shape = encoding, coding, reader.size, 1 / wanted[0].interval, wanted.tick
    others = None
    if video.streams == "all":
        keeps_pitch = video.pitch == "keep"
        others = OtherStreams(reader.path, reader.index, run.clock, keeps_pitch)
    if output.resume and encoding.codec != "gif":  # which has one palette after another
        segments = Segments(path, *shape, wanted.times, made_of, facts)
        try:
            for numbers in segments.to_do():
                part = wanted[numbers.start : numbers.stop]
                _fill(segments.begin(numbers), run, coding, part, make_part)
            return [*lost, *segments.join(texts, others)]
        finally:
            segments.release()
    writer = CodedVideo(
        path, atomic.temporary_name(path), *shape, facts, texts, others, is_new=not there
    )
    _fill(writer, run, coding, wanted, make_part)
    remove_left(path)
    return [*lost, *writer.left_out]


def _fill(
    writer: CodedVideo | Segment,
    run: PictureMaker,
    coding: Coding,
    moments: Sequence[OutputFrame],
    make_part: MakePart,
) -> None:
    """Write pictures and close the file, or leave nothing of it."""
    try:
        make_part(moments, VideoSink(writer, coding))
        writer.close()
    except BaseException:
        writer.abandon()
        raise


def _texts(reader: VideoReader, made_of: dict[str, Any]) -> dict[str, str]:
    """The record of a video, under the first text that its input leaves free."""
    free = next((name for name in _RECORD if name not in reader.metadata), _RECORD[0])
    return {free: record.blank(made_of)}


def _record_of(path: Path) -> tuple[dict[str, Any] | None, bool]:
    """The content of a video's record, and True if the video is whole."""
    try:
        return record.read_file(path)
    except OSError as error:
        raise InputError(f"{path}: {(error.strerror or str(error)).lower()}") from None


def _made_of(run: PictureMaker, masks: Sequence[Path]) -> dict[str, Any]:
    """The files that every picture depends on, and the part of the input that is let through."""
    found, clock = os.stat(run.reader.path), run.clock
    return {
        "input": [run.reader.path.name, found.st_size, found.st_mtime_ns],
        "masks": [_crc(path.read_bytes()) for path in masks],
        "part": [str(clock.first), str(clock.end)],
    }


def _crc(data: bytes) -> str:
    return f"{zlib.crc32(data):08x}"


def _write_frames(
    run: PictureMaker,
    output: OutputSettings,
    video: VideoSettings,
    wanted: OutputFrames,
    settings: dict[str, Any],
    make_part: MakePart,
    inputs: Sequence[Path],
) -> list[str]:
    """Write image files."""
    numbers = list(range(FIRST, FIRST + len(wanted)))
    files = replace(output, fps=None).make(settings, numbers, inputs)
    channels = 4 if run.reader.coding.alpha else 3
    left: Sequence[OutputFrame] = wanted
    if output.resume:
        left = [m for m in wanted if not files.done(FIRST + m.number, _moment(m))]
    try:
        if left:
            make_part(left, FramesSink(files, run.device, channels, FIRST))
        files.close()
    except BaseException:
        files.abandon()
        raise
    if not left:
        return ["is already done"]
    done = len(wanted) - len(left)
    return [f"{done} of {len(wanted)} frames were done before"] if done else []


def _moment(moment: OutputFrame) -> dict[str, str]:
    """The part of a frame's record that is its own."""
    return {"time": str(moment.time), "interval": str(moment.interval)}
