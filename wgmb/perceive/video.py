"""A video as it is perceived: each picture is held until the next, and earlier ones fade."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..color.coding import CodedPicture, Coding
from ..cone import Cone
from ..errors import InputError
from ..observer import Observer
from ..run.engine import Blurred, Input, IsDone
from ..run.report import Progress, VideoReport
from ..run.video import check_fits
from ..run.video_output import check_output, sounds_kept, write
from ..run.video_sink import Form
from ..settings import BlurSettings, InputSettings, OutputSettings
from ..settings.record import record
from ..settings.video import VideoSettings
from ..video.clock import Clock
from ..video.linear_frames import VideoPictures
from ..video.output_times import OutputFrame, OutputFrames
from ..video.planes import Planes
from ..video.read.reader import VideoReader
from .settings import PerceptionSettings


@dataclass(frozen=True)
class PerceivedVideo:
    """A video that is looked at; after each picture, the perceived one. Call it to write it."""

    reader: VideoReader
    clock: Clock
    pictures: VideoPictures
    observer: Observer
    output: OutputSettings
    wanted: OutputFrames
    settings: dict[str, Any]

    @property
    def device(self) -> wgpu.GPUDevice:
        """The device that holds the pictures."""
        return self.observer.device

    def light(self) -> wgpu.GPUTexture:
        """The perceived image in the middle of the last picture's time, as linear light
        (rgba32float)."""
        return self.observer.texture()

    def coded(self, coding: Coding) -> CodedPicture:
        """The same in the planes of a video."""
        encoder = self.device.create_command_encoder(label="encode")
        return self.pictures.planes.encode(encoder, self.light().create_view(), coding)

    def frames(self, wanted: Sequence[OutputFrame], form: Form) -> Input[Any, Any]:
        """Output frames in a form, as the input of a run."""
        return PerceivedPictures(self, wanted, form)

    def __call__(self, progress: Progress | None = None) -> VideoReport:
        """Write the perceived video, or its frames."""
        begun = time.perf_counter()
        left_out = write(
            self, self.output, VideoSettings(), self.wanted, self.settings, progress=progress
        )
        return VideoReport(
            self.reader.path,
            self.output.output,
            len(self.wanted),
            time.perf_counter() - begun,
            notes=self.reader.notes,
            left_out=left_out,
            loss=self.reader.loss(),
        )


class PerceivedPictures:
    """Pictures of a video, each shown for its own time."""

    ahead = 3

    def __init__(self, video: PerceivedVideo, wanted: Sequence[OutputFrame], form: Form):
        self._video, self._wanted, self._form = video, wanted, form
        self.total = len(wanted)
        times, clock = video.reader.times, video.clock
        self._first = next(n for n, t in enumerate(times) if clock.out(t) == wanted[0].time)

    def read(self, is_done: IsDone) -> Iterator[tuple[int, CodedPicture]]:
        """Decode the pictures; those that cannot be decoded are left out."""
        return self._video.reader.pictures(self._first, self._first + len(self._wanted) - 1)

    def blur(self, read: Iterator[tuple[int, CodedPicture]]) -> Iterator[Blurred]:
        """Show them."""
        for number, light, held in self._held(read):
            self._video.observer.present(light, held)
            yield self._form(self._wanted[number - self._first], self._video)

    def _held(
        self, read: Iterator[tuple[int, CodedPicture]]
    ) -> Iterator[tuple[int, np.ndarray, float]]:
        """Pictures with their numbers, and how long each is held [s]: until the next one."""
        reader, before = self._video.reader, None
        times = reader.times
        for number, coded in read:
            light = self._video.pictures.light(coded)
            if before is not None:
                yield *before, float(times[number] - times[before[0]])
            before = number, light
        if before is not None:
            number = before[0]
            is_last = number + 1 == len(times)
            ends = times[number] + 1 / reader.rate if is_last else times[number + 1]
            yield *before, float(ends - times[number])


def perceive_video(
    path: str,
    output: OutputSettings,
    input: InputSettings,
    perception: PerceptionSettings,
    device: wgpu.GPUDevice | str | None = None,
) -> PerceivedVideo:
    """A video as it is perceived; InputError for settings that do not fit."""
    check_fits(input, BlurSettings())
    perception.check(of_scene=False)
    check_output(output, VideoSettings(), path)
    if output.fps is not None:
        raise InputError("`fps` is for frames, the pictures of a video have their own times")
    reader = VideoReader(path, max_mb=input.max_mb)
    video = VideoSettings()
    clock = video.clock(reader, input.frames, sounds_kept(reader, output, video))
    wanted = OutputFrames(reader, clock, None)
    opened = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
    cone = perception.cone
    observer = Observer(densest_rate(reader, cone), cone, device=opened)
    pictures = VideoPictures(reader, Planes(opened))
    return PerceivedVideo(reader, clock, pictures, observer, output, wanted, record(perception))


def densest_rate(reader: VideoReader, cone: Cone) -> float:
    """Images per second where they are densest, over as long as a cone cell remembers."""
    times = reader.times.seconds
    ends = np.searchsorted(times, times + cone.memory, side="right")
    return float((ends - np.arange(len(times))).max()) / cone.memory
