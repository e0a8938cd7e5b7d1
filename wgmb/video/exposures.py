"""Exposures of pictures in time, and of a video, at the output's own times."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain, islice
from typing import Protocol, TypedDict, Unpack

import numpy as np
import wgpu

from .. import gpu
from ..color.coding import CodedPicture, Coding
from ..errors import InputError
from ..exposure import Cell
from ..gpu.textures import KeptViews, TexturePool
from ..gpu.timing import Clock as PassClock
from ..methods.contract import reach_of
from ..pipeline.blur import Blur
from ..pipeline.exposure_sum import ExposureSum, Part
from ..shots.motion import MotionSource, window
from ..shots.reader import FLASH, Picture, ShotReader, Shots
from ..shutter import Shutter
from .changing_light import ChangingLight, LightChanges
from .clock import Clock
from .gpu_frames import VideoFrames
from .holdouts import Holdout
from .output_times import OutputFrame
from .planes import Average, Planes, averages
from .read.reader import VideoReader
from .thumbnail import Thumbnail, change, is_cut

BEFORE = 14  # pictures decoded before the first exposure, which its motion may depend on


class ExposureKeywords(TypedDict, total=False):
    """Keywords of `Exposures` that those of a video take, too."""

    holdout: Holdout | None
    at_edges: Blur | None
    fill: bool
    cuts: bool
    known_cuts: Collection[int]
    planes: Planes | None


class Exposures:
    """The exposures of pictures in time, one after the other, wherever the pictures come from.

    `motion`: where motion comes from (wgmb/flow); None: pictures are averaged as they are.
    `holdout`: areas that stay sharp. `fill`: repeated pictures are left out, and motion
    goes on over the gap. `at_edges`: blurs the pictures with edges of motion, if not `blur`.
    `cuts`: whether cuts are looked for, beside `known_cuts`, the numbers of pictures that begin a
    shot. `planes`: make their light, which may be expanded for the blur.
    `flash`: how long a flash of several pictures lasts at most [s]. `tolerance`: by how much their
    times may be rounded [s]. InputError where the method takes two frames to either side.
    """

    def __init__(
        self,
        blur: Blur,
        motion: MotionSource | None,
        *,
        holdout: Holdout | None = None,
        at_edges: Blur | None = None,
        fill: bool = False,
        cuts: bool = True,
        known_cuts: Collection[int] = (),
        planes: Planes | None = None,
        flash: float = FLASH,
        tolerance: float = 0.0,
    ):
        if reach_of(blur.method) > 1:
            raise InputError("a `reach` of 2 is for rendered frames, a video takes 1")
        self.holdout = holdout or Holdout(displays=False)
        self._flash, self._tolerance = flash, tolerance
        self._blur, self._motion = blur, motion
        self._at_edges = at_edges
        self._planes = planes or Planes(blur.device)
        self._light, self._average = ExposedLight(self._planes), Average(blur.device)
        self._views = KeptViews()
        self._in_software = blur.device.adapter_info["adapter_type"] == gpu.SOFTWARE
        self._fill, self._cuts, self._known_cuts = fill, cuts, known_cuts
        self._used: set[str] = set()
        self.shots: ShotReader[Thumbnail] | None = None
        self._frames: VideoFrames | None = None

    @property
    def alone(self) -> list[int]:
        """Numbers of the pictures that were copied, as each is alone in its shot; no flashes."""
        if self._frames is None or self.shots is None:
            return []
        return sorted(self._frames.alone.difference(self.shots.flashes))

    @property
    def unfollowed(self) -> list[int]:
        """Numbers of the pictures with a place whose motion was not found; no flashes."""
        if self._frames is None or self.shots is None:
            return []
        return sorted(self._frames.unfollowed.difference(self.shots.flashes))

    @property
    def methods(self) -> list[str]:
        """Names of the methods that blurred pictures so far, the usual one first."""
        blurs = [self._blur, *([self._at_edges] if self._at_edges else [])]
        return [name for name in dict.fromkeys(b.method.name for b in blurs) if name in self._used]

    @property
    def device(self) -> wgpu.GPUDevice:
        """The Blur's."""
        return self._blur.device

    def of(
        self,
        pictures: Iterator[Picture[Thumbnail]],
        shutter: Shutter,
        wanted: Iterable[OutputFrame],
    ) -> Iterator[tuple[OutputFrame, Exposure]]:
        """Every output frame and its exposure, which is valid until the next is asked for.

        `pictures` and `wanted`, in the order of their times, are read as far as is needed.
        """
        begin = list(islice(pictures, 1))
        size = begin[0].content.coded.size if begin else (1, 1)
        self.shots = shots = ShotReader(
            chain(begin, pictures),
            is_cut=is_cut if self._cuts else None,
            known_cuts=self._known_cuts,
            change=change if self._fill else None,
            reach=window(size, self._motion) + (not self._in_software),  # for the next mask
            flash=self._flash,
            tolerance=self._tolerance,
        )
        self._frames = frames = self.frames(shots)
        for frame in wanted:
            cells = shots.cells(float(frame.time), float(frame.interval), shutter)
            yield frame, Exposure(self, frames, cells)

    def frames(self, shots: Shots[Thumbnail]) -> VideoFrames:
        """The textures of pictures, for Exposure."""
        blur, changing = self._at_edges or self._blur, ChangingLight(self.device)
        return VideoFrames(shots, blur, self._motion, self.holdout, self._planes, changing)

    def in_one(self) -> AbstractContextManager[None]:
        """Submit the commands of an output frame together.

        Without a GPU each stage is submitted by itself, so that the adapter works on it while the
        next one is recorded.
        """
        return nullcontext() if self._in_software else gpu.gathered(self.device)

    def light(self, frames: VideoFrames, cells: Sequence[Cell]) -> wgpu.GPUTexture:
        """The exposure of these cells as linear light (rgba32float)."""
        return self._light(frames, cells, self._blurs(frames))

    def coded(self, frames: VideoFrames, cells: Sequence[Cell], coding: Coding) -> CodedPicture:
        """The exposure of these cells in planes."""
        plain = self._motion is None and not self._planes.expansion
        first = frames.shots[cells[0].index].content.coded
        if plain and averages(first.coding, coding):
            pictures = [frames.shots[cell.index].content.coded for cell in cells]
            return self._average(pictures, [cell.share for cell in cells], coding)
        light, changes = self._light.blurred(frames, cells, self._blurs(frames), is_coded=True)
        encoder = gpu.encoder(self.device, "encode")
        return self._planes.encode(encoder, self._views.of(light), coding, changes)

    def _blurs(self, frames: VideoFrames) -> Callable[[Cell], Blur]:
        """The Blur of each cell."""

        def blur_of(cell: Cell) -> Blur:
            blur = frames.blur_of(cell, self._blur, self._at_edges)
            self._used.add(blur.method.name)
            return blur

        return blur_of


class ExposedLight:
    """Makes the light of exposures of the pictures of VideoFrames, whose light `planes` made."""

    def __init__(self, planes: Planes):
        self._planes, self._device = planes, planes.device
        self._sum, self._images = ExposureSum(planes.device), TexturePool(planes.device)
        self._views = KeptViews()

    def __call__(
        self,
        frames: VideoFrames,
        cells: Sequence[Cell],
        blur_of: Callable[[Cell], Blur],
        timing: PassClock | None = None,
    ) -> wgpu.GPUTexture:
        """The exposure of these cells, each by its Blur, as linear light (rgba32float).

        The next call overwrites it. `timing`: see ExposureSum.
        """
        light, changes = self.blurred(frames, cells, blur_of, timing)
        size, steps = (light.size[0], light.size[1]), []
        if changes is not None:
            steps.append(("changed", frames.changing.add))
        if self._planes.expansion:
            steps.append(("compressed", self._planes.compress))
        for name, step in steps:
            encoder = gpu.encoder(self._device, name)
            output = self._images.texture(name, size, "rgba32float")
            step(encoder, self._views.of(light), self._views.of(output))
            gpu.hand_in(self._device, encoder)
            light = output
        return light

    def blurred(
        self,
        frames: VideoFrames,
        cells: Sequence[Cell],
        blur_of: Callable[[Cell], Blur],
        timing: PassClock | None = None,
        is_coded: bool = False,
    ) -> tuple[wgpu.GPUTexture, LightChanges | None]:
        """The same as it is blurred: expanded, and without changes of light.

        `is_coded`: it will be, and pixels may not be finite.
        """
        changed: list[Cell] = []

        def part(cell: Cell) -> Part:
            blur = blur_of(cell)
            found = frames.in_shot(cell.index, blur)
            if frames.change(cell, not changed):
                changed.append(cell)
            return cell, found, blur

        size = frames.shots[cells[0].index].content.coded.size
        if is_coded and len(cells) == 1:
            light = self._sum.alone(part(cells[0]))
        else:
            light = self._sum.texture(size, map(part, cells), timing)
        return light, frames.changing.changes(size) if changed else None


class VideoBlur(Exposures):
    """The exposures of a video. `clock`: the time of its pictures in the output.

    `has_own_times`: output frames have the times of pictures, as the file rounds them.

    All else: see Exposures. InputError for expanded light where the video holds light above white.
    """

    def __init__(
        self,
        reader: VideoReader,
        blur: Blur,
        motion: MotionSource | None,
        *,
        clock: Clock = Clock(),  # noqa: B008  it is frozen
        has_own_times: bool = False,
        **more: Unpack[ExposureKeywords],
    ):
        pace = float(clock.speed)
        tolerance = reader.tolerance / pace
        super().__init__(blur, motion, flash=FLASH / pace, tolerance=tolerance, **more)
        self._planes.expansion.check_video(reader.path, reader.coding)
        self.reader, self.clock = reader, clock
        self._times = reader.times if has_own_times else reader.exact_times

    def pictures(
        self, shutter: Shutter, wanted: Sequence[OutputFrame]
    ) -> Iterator[Picture[Thumbnail]]:
        """The video's pictures from before the first exposure to the end, on the output's clock."""
        times = self._times
        opens = (
            self.clock.back(wanted[0].time)
            + Fraction(shutter.span[0]) * wanted[0].interval * self.clock.speed
        )
        first = int(np.searchsorted(self.reader.times.seconds, float(opens)))
        first, none = max(first - BEFORE, 0), True
        for number, picture in self.reader.pictures(first):
            none = False
            yield Picture(float(self.clock.out(times[number])), Thumbnail(picture), number)
        if none:
            at = float(times[min(first, len(times) - 1)])
            raise InputError(
                f"{self.reader.path}: none of its pictures from {at:.2f} s on can be decoded"
            )


@dataclass(frozen=True)
class Exposure:
    """An output frame, made on request in the requested form."""

    _run: Exposures
    _frames: VideoFrames
    _cells: Sequence[Cell]

    def light(self) -> wgpu.GPUTexture:
        """As linear light (rgba32float)."""
        with self._run.in_one():
            return self._run.light(self._frames, self._cells)

    def coded(self, coding: Coding) -> CodedPicture:
        """In the planes of a video; with a GPU they may be on their way when this returns."""
        with self._run.in_one():
            return self._run.coded(self._frames, self._cells, coding)


class ExposedPicture(Protocol):
    """A picture that is made when it is asked for; an Exposure is one."""

    def light(self) -> wgpu.GPUTexture:
        """As linear light (rgba32float)."""
        ...

    def coded(self, coding: Coding) -> CodedPicture:
        """In the planes of a video."""
        ...
