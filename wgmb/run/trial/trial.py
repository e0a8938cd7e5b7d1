"""A trial of the settings of a video: some places of it, each beside the original."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import wgpu

from ...errors import InputError
from ...gpu.textures import TexturePool
from ...output.result import Result
from ...sequence.frame_file import FrameFile
from ...video.exposures import VideoBlur
from ...video.output_times import OutputFrame, OutputFrames
from ...video.planes import Planes
from ...video.write.encoders import SUFFIXES
from ..engine import IsDone, RunOptions
from ..file_sink import BlurredFrame, run_into
from ..report import BatchReport, Progress
from ..video import VideoPlan, VideoRun

MOST = 20  # places of a trial
_LENGTH = Fraction(1)  # of a place in a video [s]
_GAP = 4  # px between the original and the result, and between rows

Place = tuple[VideoPlan, Sequence[OutputFrame]]


class Trial:
    """The original and the result side by side, at `count` places of a video.

    Into a video, a second of each place; into an image file, one frame of each, one below the
    other. InputError for another number of places than 1 to MOST.
    """

    def __init__(self, run: VideoRun, plan: VideoPlan, count: int):
        if not 1 <= count <= MOST:
            raise InputError(f"`try` must be 1 to {MOST}, got {count}")
        run = run.at(plan.fps)
        is_video = Path(plan.name).suffix.lower() in SUFFIXES
        rate, parts = plan.output.rate_or(plan.reader.rate), []
        for begin, end in places(plan, count, _LENGTH if is_video else 1 / rate):
            clock = replace(plan.clock, start=begin, origin=Fraction(0), first=begin, end=end)
            part = replace(plan, clock=clock, wanted=OutputFrames(plan.reader, clock, rate))
            middle = len(part.wanted) // 2
            parts.append((part, part.wanted[:] if is_video else part.wanted[middle : middle + 1]))
        self._frames = (TriedFrames if is_video else TriedSheet)(run, parts)
        numbers, output = range(1, self.total + 1), replace(plan.output, fps=str(rate))
        settings = run.settings | {"try": count}
        self._output = output.make(settings, list(numbers), [plan.reader.path])

    @property
    def total(self) -> int:
        """Number of frames that are written."""
        return self._frames.total

    def __call__(self, progress: Progress | None = None) -> BatchReport:
        """Write them."""
        numbers = range(1, self.total + 1)
        return run_into(self._output, self._frames, numbers, RunOptions(progress=progress))


class TriedFrames:
    """Output frames at some places, each beside the picture that it is made of."""

    ahead = 1

    def __init__(self, run: VideoRun, parts: Sequence[Place]):
        self._run, self._parts = run, parts
        self._shutter = run.request.shutter.make()
        device: wgpu.GPUDevice = run.blur.device
        self._plain, self._images = Planes(device), TexturePool(device)
        self.total = sum(len(wanted) for _, wanted in parts)

    def read(self, is_done: IsDone) -> Iterator[Place]:
        """The places; their pictures are decoded where they are blurred."""
        return iter(self._parts)

    def blur(self, read: Iterator[Place]) -> Iterator[BlurredFrame]:
        """Make the frames."""
        for number, image in enumerate(self.images(read), 1):
            yield _as_frame(number, image)

    def images(self, read: Iterator[Place]) -> Iterator[np.ndarray]:
        """(height, width, 3) linear light: the original, a gap, and the result."""
        for plan, wanted in read:
            exposures = self._run.exposures(plan)
            pictures = exposures.pictures(self._shutter, wanted)
            for frame, exposure in exposures.of(pictures, self._shutter, wanted):
                after = self._down(exposure.light())
                before = self._original(exposures, frame)
                yield np.concatenate([before, np.zeros_like(after[:, :_GAP]), after], axis=1)

    def _original(self, exposures: VideoBlur, frame: OutputFrame) -> np.ndarray:
        shots = exposures.shots
        assert shots is not None
        coded = shots[shots.at(float(frame.time))].content.coded
        texture = self._images.texture("original", coded.size, self._plain.texel(coded.coding))
        self._plain.draw(coded, texture)
        return self._down(texture)

    def _down(self, texture: wgpu.GPUTexture) -> np.ndarray:
        encoder = self._run.blur.device.create_command_encoder(label="trial")
        return self._images.download(encoder, texture)[..., :3].astype(np.float32)


class TriedSheet(TriedFrames):
    """The same as one image: a row for every frame."""

    def __init__(self, run: VideoRun, parts: Sequence[Place]):
        super().__init__(run, parts)
        self.total = 1

    def blur(self, read: Iterator[Place]) -> Iterator[BlurredFrame]:
        """Make the image."""
        rows = list(self.images(read))
        gap = np.zeros_like(rows[0][:_GAP])
        sheet = [part for row in rows for part in (gap, row)][1:]
        yield _as_frame(1, np.concatenate(sheet))


def _as_frame(number: int, image: np.ndarray) -> BlurredFrame:
    return BlurredFrame(number, [Result(FrameFile(number, Path(), None, {}, {}), image)])


# ---- places of a video at which settings are tried --------------------------------------------


def places(plan: VideoPlan, count: int, length: Fraction) -> list[tuple[Fraction, Fraction]]:
    """Begin and end in the input [s] of parts of a `length`, evenly spaced in the selected part.

    The whole of it if the parts would meet.
    """
    reader, clock = plan.reader, plan.clock
    begin = reader.times[0] if clock.first is None else max(clock.first, reader.times[0])
    end = reader.until if clock.end is None else min(clock.end, reader.until)
    if end - begin <= count * length:
        return [(begin, end)]
    middles = (begin + (end - begin) * (2 * k + 1) / (2 * count) for k in range(count))
    return [(middle - length / 2, middle + length / 2) for middle in middles]
