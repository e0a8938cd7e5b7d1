"""Videos through a Blur: pictures in time, their motion, exposures at the output's own times."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import wgpu

from .. import gpu
from ..color.coding import CodedPicture, Coding
from ..color.highlights import check_coding
from ..errors import InputError
from ..exposure import Cell
from ..gpu.textures import TexturePool
from ..methods.contract import reach_of
from ..output.output import Output
from ..output.result import Result
from ..pipeline.blur import Blur
from ..pipeline.exposure_sum import Exposer
from ..sequence.frame_file import FrameFile
from ..shots.motion_source import MotionSource
from ..shots.reader import FLASH, Picture, Reel
from ..shutter import Shutter
from ..threads import Behind, ahead
from ..video.clock import Clock
from ..video.gpu_frames import ReelViews
from ..video.output_times import Moment
from ..video.planes import Average, Planes, averages
from ..video.read.reader import Footage
from ..video.thumbnail import Glance, is_cut, is_double
from ..video.write.pictures import CodedVideo
from ..video.write.segments import Segment
from .batch_report import Progress

_READ_AHEAD = 2  # coded pictures
_BEFORE = 10  # pictures decoded before the first exposure, which its motion may depend on


class FootageBlur:
    """The exposures of a video, one after the other.

    `motion`: where motion comes from (wgmb/flow); None: pictures are averaged as they are.
    `holdout` (height, width): 1 stays sharp. `fill`: repeated pictures are left out, and motion
    goes on over the gap. `cuts`: whether cuts are looked for, beside
    `known_cuts`, the numbers of pictures that begin a shot. `highlights`: times white that white
    counts as while it is blurred; InputError where the video holds light above white, and where
    the method takes two frames to either side.
    """

    def __init__(
        self,
        footage: Footage,
        blur: Blur,
        motion: MotionSource | None,
        *,
        clock: Clock = Clock(),  # noqa: B008  it is frozen
        holdout: np.ndarray | None = None,
        fill: bool = False,
        cuts: bool = True,
        known_cuts: Collection[int] = (),
        highlights: float = 1.0,
    ):
        check_coding(highlights, footage.path, footage.coding)
        if reach_of(blur.method) > 1:
            raise InputError("a `reach` of 2 is for rendered frames, a video takes 1")
        self._highlights = highlights
        self.footage, self.clock, self._holdout = footage, clock, holdout
        self._blur, self._motion = blur, motion
        self._exposer, self._planes = Exposer(blur), Planes(blur.device, highlights)
        self._average, self._images = Average(blur.device), TexturePool(blur.device)
        self._fill, self._cuts, self._known_cuts = fill, cuts, known_cuts
        self.reel: Reel[Glance] | None = None

    @property
    def device(self) -> wgpu.GPUDevice:
        """The Blur's."""
        return self._blur.device

    def exposures(
        self, shutter: Shutter, wanted: Sequence[Moment]
    ) -> Iterator[tuple[Moment, Exposure]]:
        """Every moment and its exposure, which is valid until the next is asked for."""
        self.reel = reel = Reel(
            self._pictures(shutter, wanted),
            is_cut=is_cut if self._cuts else None,
            known_cuts=self._known_cuts,
            is_double=is_double if self._fill else None,
            flash=FLASH / float(self.clock.speed),
        )
        views = ReelViews(reel, self._blur, self._motion, self._holdout, self._highlights)
        for moment in wanted:
            cells = reel.cells(float(moment.time), float(moment.interval), shutter)
            yield moment, Exposure(self, reel, views, cells)

    def light(self, views: ReelViews, cells: Sequence[Cell]) -> wgpu.GPUTexture:
        """The exposure of these cells as linear light (rgba32float)."""
        light = self._light(views, cells)
        if self._highlights == 1:
            return light
        encoder = self.device.create_command_encoder(label="compress")
        output = self._images.texture("compressed", self.footage.size, "rgba32float")
        self._planes.compress(encoder, light.create_view(), output.create_view())
        gpu.submit(self.device, encoder)
        return output

    def coded(
        self, reel: Reel[Glance], views: ReelViews, cells: Sequence[Cell], coding: Coding
    ) -> CodedPicture:
        """The exposure of these cells in planes."""
        plain = self._motion is None and self._highlights == 1
        if plain and averages(self.footage.coding, coding):
            pictures = [reel[cell.index].content.coded for cell in cells]
            return self._average(pictures, [cell.share for cell in cells], coding)
        light = self._light(views, cells)
        encoder = self.device.create_command_encoder(label="encode")
        return self._planes.encode(encoder, light.create_view(), coding)

    def _light(self, views: ReelViews, cells: Sequence[Cell]) -> wgpu.GPUTexture:
        """The same with highlights expanded."""
        parts = ((cell, views.shown(cell.index)) for cell in cells)
        return self._exposer.texture(self.footage.size, parts)

    def _pictures(self, shutter: Shutter, wanted: Sequence[Moment]) -> Iterator[Picture[Glance]]:
        """The video's pictures from before the first exposure to the end, on the output's clock."""
        times = self.footage.times
        opens = (
            self.clock.back(wanted[0].time)
            + Fraction(shutter.span[0]) * wanted[0].interval * self.clock.speed
        )
        first = int(np.searchsorted(times.seconds, float(opens)))
        first, none = max(first - _BEFORE, 0), True
        for number, picture in ahead(self.footage.pictures(first), _READ_AHEAD):
            none = False
            yield Picture(float(self.clock.out(times[number])), Glance(picture), number)
        if none:
            at = float(times[min(first, len(times) - 1)])
            raise InputError(
                f"{self.footage.path}: none of its pictures from {at:.2f} s on can be decoded"
            )


@dataclass(frozen=True)
class Exposure:
    """An output frame, made when it is asked for as what is wanted."""

    _run: FootageBlur
    _reel: Reel[Glance]
    _views: ReelViews
    _cells: Sequence[Cell]

    def light(self) -> wgpu.GPUTexture:
        """As linear light (rgba32float)."""
        return self._run.light(self._views, self._cells)

    def coded(self, coding: Coding) -> CodedPicture:
        """In the planes of a video."""
        return self._run.coded(self._reel, self._views, self._cells, coding)


class Seen(Protocol):
    """A picture that is made when it is asked for; an Exposure is one."""

    def light(self) -> wgpu.GPUTexture:
        """As linear light (rgba32float)."""
        ...

    def coded(self, coding: Coding) -> CodedPicture:
        """In the planes of a video."""
        ...


class Sink(Protocol):
    """Destination of exposures: `take` on the main thread, then `put` in a thread of its own."""

    def take(self, moment: Moment, exposure: Seen) -> Any:
        """The data of a picture that will be written."""
        ...

    def put(self, taken: Any) -> None:
        """Write it."""
        ...


class VideoSink:
    """Exposures as coded pictures into a video."""

    def __init__(self, video: CodedVideo | Segment, coding: Coding):
        self._video, self._coding = video, coding

    def take(self, moment: Moment, exposure: Seen) -> tuple[CodedPicture, Fraction]:
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

    def take(self, moment: Moment, exposure: Seen) -> Result:
        """The picture as an array."""
        encoder = self._device.create_command_encoder(label="frame")
        picture = self._images.download(encoder, exposure.light())[..., : self._channels]
        return Result(FrameFile(self._first + moment.number, Path(), None, {}, {}), picture)

    def put(self, taken: Result) -> None:
        """Write its file."""
        self._output.write_views([taken])


def blur_footage(
    run: FootageBlur,
    shutter: Shutter,
    wanted: Sequence[Moment],
    sink: Sink,
    progress: Progress | None = None,
) -> None:
    """Every exposure of a video into `sink`; the caller closes or abandons what it writes."""
    tell = progress or (lambda number, state: None)
    with Behind(sink.put) as put:
        for moment, exposure in run.exposures(shutter, wanted):
            put(sink.take(moment, exposure))
            tell(moment.number, "done")
