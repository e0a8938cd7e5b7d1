"""Frames of a video on their way: the form in which a sink takes them, and the sink of a video."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import wgpu

from ..color.coding import CodedPicture, Coding
from ..gpu.textures import TexturePool
from ..output.result import Result
from ..sequence.frame_file import FrameFile
from ..video.exposures import ExposedPicture
from ..video.output_times import OutputFrame
from .engine import Blurred
from .file_sink import BlurredFrame


@dataclass
class CodedFrame:
    """One frame in the planes of a video."""

    number: int
    picture: CodedPicture
    time: Fraction
    """The time at which it is shown [s]."""
    failed: str = ""
    bad: dict[str, int] = field(default_factory=dict)


class PictureWriter(Protocol):
    """Writer of a video, or of a part of one."""

    def add(self, picture: CodedPicture, time: Fraction) -> None:
        """Append a picture that is shown at `time` [s]."""
        ...

    def close(self) -> None:
        """Complete it."""
        ...

    def abandon(self) -> None:
        """Leave nothing behind."""
        ...


class VideoSink:
    """Coded frames into a video, or a segment of one."""

    is_whole = True

    def __init__(self, writer: PictureWriter):
        self._writer, self.count = writer, 0
        self.close, self.abandon = writer.close, writer.abandon

    def done(self, number: int, made_of: dict[str, Any]) -> bool:
        """False: a video is complete or not there."""
        return False

    def put(self, frame: CodedFrame) -> None:
        """Append a frame."""
        self._writer.add(frame.picture, frame.time)
        self.count += 1

    def why_hopeless(self, error: BaseException) -> str:
        """Any error ends a video."""
        return str(error)


Form = Callable[[OutputFrame, ExposedPicture], Blurred]
"""Converts an exposure for a sink; it runs on the thread of the GPU."""


def coded_form(coding: Coding) -> Form:
    """For a VideoSink: the planes of a video."""
    return lambda frame, exposure: CodedFrame(frame.number, exposure.coded(coding), frame.time)


class LightForm:
    """For a FileSink: linear light as an array, in files that are numbered from `first` on."""

    def __init__(self, device: wgpu.GPUDevice, channels: int, first: int):
        self._device, self._channels, self._first = device, channels, first
        self._images = TexturePool(device)

    def __call__(self, frame: OutputFrame, exposure: ExposedPicture) -> BlurredFrame:
        """Bring a picture down from the GPU."""
        encoder = self._device.create_command_encoder(label="frame")
        picture = self._images.download(encoder, exposure.light())[..., : self._channels]
        file = FrameFile(self._first + frame.number, Path(), None, {}, {})
        return BlurredFrame(frame.number, [Result(file, picture)], frame_record(frame))


def frame_record(frame: OutputFrame) -> dict[str, str]:
    """The part of a frame's record that is its own: its time in the video."""
    return {"time": str(frame.time), "interval": str(frame.interval)}
