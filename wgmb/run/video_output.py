"""Write the pictures made of a video: as a video with the input's other streams, or as frames."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from ..color.coding import Coding
from ..errors import InputError
from ..io import atomic
from ..output.names import refuse_inputs
from ..settings import OutputSettings
from ..settings.video import VideoSettings
from ..video.clock import Clock, tick
from ..video.output_times import Moment
from ..video.read.reader import Footage
from ..video.write.encoders import SUFFIXES, chosen
from ..video.write.other_streams import OtherStreams
from ..video.write.pictures import CodedVideo
from ..video.write.segments import Segment, Segments, remove_left
from .video import FramesSink, Sink, VideoSink

FIRST = 1  # number of the first frame, where they are image files
_RECORD = "comment", "description", "synopsis"  # texts of a video; the first that is free


class Made(Protocol):
    """Maker of the pictures of a video, such as FootageBlur."""

    @property
    def footage(self) -> Footage:
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


MakePart = Callable[[Sequence[Moment], Sink], None]
"""Makes the pictures of some of the moments, and gives them to a sink."""


def write(
    run: Made,
    output: OutputSettings,
    video: VideoSettings,
    wanted: list[Moment],
    settings: dict[str, Any],
    make_part: MakePart,
) -> list[str]:
    """Write the pictures of the moments; returns what the output cannot hold, in lines."""
    is_video = Path(output.output).suffix.lower() in SUFFIXES
    to = _write_video if is_video else _write_frames
    return to(run, output, video, wanted, settings, make_part)


def _write_video(
    run: Made,
    output: OutputSettings,
    video: VideoSettings,
    wanted: list[Moment],
    settings: dict[str, Any],
    make_part: MakePart,
) -> list[str]:
    """Write a video, with `resume` in segments; returns what it cannot hold, in lines."""
    path, footage = Path(output.output), run.footage
    encoding = chosen(path, video.codec, video.quality, video.encoder)
    coding, lost = encoding.coding(footage.coding)
    facts = footage.facts
    found = os.stat(footage.path)
    made_of = settings | {"input": [footage.path.name, found.st_size, found.st_mtime_ns]}
    texts = _texts(footage, made_of)
    there = [path] if os.path.exists(os.path.realpath(path)) else []
    refuse_inputs(path.parent, [path.name], there, [footage.path])
    if there and output.resume and texts.items() <= Footage(path).metadata.items():
        remove_left(path)
        return ["is already done"]
    if there and not output.overwrite:
        more = " and was made otherwise" if output.resume else ""
        raise InputError(f"{path} exists{more}; `overwrite=True` replaces it")
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.sweep(path.parent, [path.name])
    times, rate = [moment.time for moment in wanted], 1 / wanted[0].interval
    base = tick(*times, wanted[0].interval)
    shape = encoding, coding, footage.size, rate, base
    others = None
    if video.streams == "all":
        keeps_pitch = video.pitch == "keep"
        others = OtherStreams(footage.path, footage.index, run.clock, keeps_pitch)
    if output.resume:
        segments = Segments(path, *shape, times, made_of, facts)
        try:
            for numbers in segments.to_do():
                part = wanted[numbers.start : numbers.stop]
                _fill(segments.begin(numbers), run, coding, part, make_part)
            return [*lost, *segments.join(texts, others)]
        finally:
            segments.release()
    writer = CodedVideo(path, atomic.temporary_name(path), *shape, facts, texts, others)
    _fill(writer, run, coding, wanted, make_part)
    remove_left(path)
    return [*lost, *writer.left_out]


def _fill(
    writer: CodedVideo | Segment,
    run: Made,
    coding: Coding,
    moments: Sequence[Moment],
    make_part: MakePart,
) -> None:
    """Write pictures and close the file, or leave nothing of it."""
    try:
        make_part(moments, VideoSink(writer, coding))
        writer.close()
    except BaseException:
        writer.abandon()
        raise


def _texts(footage: Footage, made_of: dict[str, Any]) -> dict[str, str]:
    """The record of a video, under the first text that its input leaves free."""
    free = next((name for name in _RECORD if name not in footage.metadata), _RECORD[0])
    return {free: f"wgmb {json.dumps(made_of, sort_keys=True)}"}


def _write_frames(
    run: Made,
    output: OutputSettings,
    video: VideoSettings,
    wanted: list[Moment],
    settings: dict[str, Any],
    make_part: MakePart,
) -> list[str]:
    """Write image files."""
    numbers = [FIRST + moment.number for moment in wanted]
    files = replace(output, fps=None).make(settings, numbers, [run.footage.path])
    channels = 4 if run.footage.coding.alpha else 3
    try:
        make_part(wanted, FramesSink(files, run.device, channels, FIRST))
        files.close()
    except BaseException:
        files.abandon()
        raise
    return []
