"""Facts of files that a State depends on: frames there are, and the times of a video's pictures.

Each file is read once, and again when it has changed. One that has vanished counts as unchanged.
"""

from __future__ import annotations

import os
from collections import OrderedDict
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

from ...io import frame_numbers
from ...sequence.frame_file import is_video
from ...settings.video import VideoSettings
from ...video.clock import Clock
from ...video.output_times import OutputFrames
from ...video.read.reader import VideoReader

_VIDEOS = 8  # that are remembered

_known: OrderedDict[tuple[str, float], tuple[int, VideoReader]] = OrderedDict()


@lru_cache(maxsize=64)
def is_video_file(source: str) -> bool:
    """True if a file is a video."""
    return is_video(source)


def reader_of(source: str, max_mb: float) -> VideoReader:
    """The video in a file; the same object as long as the file does not change."""
    key, held = (source, max_mb), _known.get((source, max_mb))
    try:
        changed = os.stat(source).st_mtime_ns
    except OSError:
        if held is None:
            raise
        return held[1]
    if held is None or held[0] != changed:
        _known[key] = held = changed, VideoReader(source, max_mb=max_mb)
        while len(_known) > _VIDEOS:
            _known.popitem(last=False)
    return held[1]


@dataclass(frozen=True)
class VideoOutput:
    """The output frames of a video, and the clock that they are on."""

    clock: Clock
    frames: OutputFrames


@lru_cache(maxsize=32)
def output_of(
    reader: VideoReader, frames: str | None, settings: VideoSettings, fps: Fraction | None
) -> VideoOutput:
    """The output of a video at a rate, or, where it is None, at the times of its own pictures."""
    clock = settings.clock(reader, frames)
    return VideoOutput(clock, OutputFrames(reader, clock, fps))


def frames_of(source: str, max_mb: float) -> str:
    """All frames, or pictures, as numbers."""
    if is_video_file(source):
        return f"0-{len(reader_of(source, max_mb)) - 1}"
    if not frame_numbers.is_pattern(source):
        return str(frame_numbers.number_in(Path(source)))
    return frame_numbers.frame_range(frame_numbers.numbers_on_disk(source))
