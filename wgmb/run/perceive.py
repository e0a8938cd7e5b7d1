"""A video as it is perceived: each picture is held until the next, and earlier ones fade."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import wgpu

from ..color.coding import CodedPicture, Coding
from ..cone import Cone
from ..observer import Observer
from ..video.clock import Clock
from ..video.linear_frames import VideoPictures
from ..video.read.reader import VideoReader


@dataclass(frozen=True)
class PerceivedVideo:
    """A video that is looked at; after each picture, what is seen of it."""

    reader: VideoReader
    clock: Clock
    pictures: VideoPictures
    observer: Observer

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

    def perceived(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray, float]]:
        """Pictures with their numbers, and how long each is held [s]: until the next one."""
        times, before = self.reader.times, None
        for number, color in self.pictures.read(first, last):
            if before is not None:
                yield *before, float(times[number] - times[before[0]])
            before = number, color
        if before is not None:
            number = before[0]
            ends = (
                times[number + 1]
                if number + 1 < len(times)
                else times[number] + 1 / self.reader.rate
            )
            yield *before, float(ends - times[number])


def densest_rate(reader: VideoReader, cone: Cone) -> float:
    """Images per second where they are densest, over as long as a cone cell remembers."""
    times = reader.times.seconds
    ends = np.searchsorted(times, times + cone.memory, side="right")
    return float((ends - np.arange(len(times))).max()) / cone.memory
