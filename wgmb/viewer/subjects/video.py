"""A video as the viewer's subject: pictures at once, their blur once their motion is known."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...color.coding import Coding
from ...color.spaces import ColorConfig, ColorSpace
from ...errors import InputError
from ...exposure import Cell, evened
from ...frame import Frame
from ...gpu.textures import TexturePool
from ...gpu.timing import Clock
from ...gpu_frame.residency import padded
from ...methods import METHODS
from ...pipeline.blur import Blur
from ...pipeline.exposure_sum import ExposureSum
from ...shutter import Shutter
from ...video.changing_light import ChangingLight, Surroundings, shares_of
from ...video.holdouts import STATIC, holdout_of
from ...video.linear_frames import VideoPictures
from ...video.planes import Planes
from ...video.read.reader import VideoReader
from ..state.allowed import check_video
from ..state.files import reader_of
from ..state.state import State
from ..state.video_time import described, output, output_frame
from .motion_thread import MotionThread
from .video_exposure import Knowledge, VideoExposure, exposure_of, reach
from .video_motion import MotionRequest, PictureFinding

_PASSES = frozenset({"color", "motion", "depth"})
_LIGHTS = "light before", "light here", "light after"  # names of textures
_AHEAD = 48  # pictures whose motion is made while playing


class VideoSubject:
    """A video: its output frames, as `wgmb blur` makes them.

    Where the motion of a picture is not known yet the picture is shown as it is; `stamp` changes
    when more is known. `finding`: the source of motion, and peculiarities of the file.
    """

    def __init__(self, device: wgpu.GPUDevice, state: State):
        check_video(state)
        max_mb, masks, settings = state.input.max_mb, state.blur.holdout, state.video
        self._device, self._images = device, TexturePool(device)
        self._reader = reader_of(state.source, max_mb)
        self._times = self._reader.times
        holdout_of([mask for mask in masks if mask != STATIC], self._reader)  # says what is wrong
        request = MotionRequest(masks, settings.duplicates == "fill", state.input.cuts or "")
        self._maker = MotionThread(self._reader.path, max_mb, settings, device, request)
        self._moves = settings.flow != "none"
        self.finding = "\n".join([f"motion: {self._maker.how}", *self._reader.notes])
        self._planes = Planes(device)
        self._frames = PictureFrames(self._reader, self._planes, self._maker.known)
        self._changing = ChangingLight(device)
        self._lit: dict[str, np.ndarray] = {}  # what textures of _LIGHTS hold
        self._sum = ExposureSum(device)
        self._state = state
        self._exposed: VideoExposure | None = None
        self._lacking: list[int] = []

    # ---- what can be shown -----------------------------------------------------------------

    def has(self, state: State) -> frozenset[str]:
        """Inputs that a method may ask for."""
        return _PASSES if self._moves else frozenset({"color"})

    def methods(self, state: State) -> list[str]:
        """Names of the methods that can be fed; all are the same where pictures are averaged."""
        return [name for name, method in METHODS.items() if method.needs <= _PASSES]

    def nature(self, state: State) -> str | None:
        """The method that shows it under a shutter of any length: there is none."""
        return None

    def size(self, state: State) -> tuple[int, int]:
        """Width and height of the pictures [px]."""
        return self._reader.size

    @property
    def shape(self) -> tuple[float, float]:
        """Width and height in square pixels, as a picture is shown."""
        width, height = self._reader.size
        return width * float(self._reader.pixel_aspect), height

    @property
    def coding(self) -> Coding:
        """The coding of its colours; its light is linear in these primaries."""
        return self._reader.coding

    def space(self, config: ColorConfig) -> ColorSpace:
        """The colour space of the pictures that VideoLight makes: linear Rec. 709."""
        return config.space_of({})

    # ---- what is known --------------------------------------------------------------------

    def stamp(
        self, states: Sequence[State], shutter: Shutter, neighbours: bool
    ) -> list[tuple[Any, ...]]:
        """Findings about the pictures that contribute to the output frames, one entry for each.

        Missing motion is requested, that of the first output frame first, and while playing also
        that of the pictures to come.
        """
        beside = 1 if neighbours and self._moves else 0
        known = lru_cache(maxsize=None)(self._maker.known)  # the same throughout: a thread adds
        asked: dict[int, None] = {}
        stamps, lacking = [], []
        for state in states:
            found = self._exposure(state, shutter, known)
            of_motion = [n for cell in found.cells for n in _near(cell.index, beside, known)]
            needed = [*found.lacking, *of_motion]
            first, last = reach(self._times, output(state).clock, output_frame(state), shutter)
            soon = range(max(first - beside, 0), min(last + beside + 1, len(self._times)))
            asked |= dict.fromkeys([*needed, *sorted(soon, key=lambda n: abs(n - found.here))])
            lacking += [n for n in needed if known(n) is None]
            stamps.append(tuple(n for n in needed if known(n) is not None))
        if states[0].playing and asked:
            newest = max(asked)
            asked |= dict.fromkeys(range(newest, min(newest + _AHEAD, len(self._times))))
        self._maker.want(tuple(asked))
        self._lacking = list(dict.fromkeys(lacking))
        return stamps

    @property
    def busy(self) -> bool:
        """True while motion of the picture shown is being made."""
        return bool(self._lacking) and not self._maker.problem

    @property
    def waiting(self) -> str:
        """Name of the picture that is shown instead of the blur, and the reason; '' if all is
        ready."""
        if not self._lacking:
            return ""
        if self._maker.problem:
            return f"sharp: {self._maker.problem}"
        making = self._maker.making
        if making is None or making[0] not in self._lacking:
            making = self._lacking[0], 0.0
        number, took = making
        what = "the motion" if self._moves else "the shot"
        since = f" ({took:.0f} s)" if took >= 1 else ""
        here = self._exposed and self._exposed.here
        sharp = "sharp: " if here in self._lacking else ""
        return f"{sharp}finding {what} of picture {number}{since}"

    def frame_of(self, state: State) -> str:
        """The output frame of `state`, and the pictures that share its exposure, in words."""
        exposure = self._exposure(state, state.shutter.make())
        return described(state, [cell.index for cell in exposure.cells])

    @property
    def draft(self) -> str:
        """Source of motion that is quick rather than right; '' for the best."""
        how = self._maker.how
        return f"draft motion: {how}" if how.startswith("dense inverse search") else ""

    def close(self) -> None:
        """Let the search for motion end."""
        self._maker.close()

    def _exposure(
        self, state: State, shutter: Shutter, known: Knowledge | None = None
    ) -> VideoExposure:
        clock = output(state).clock
        return exposure_of(
            self._times, clock, output_frame(state), shutter, known or self._maker.known
        )

    # ---- drawing --------------------------------------------------------------------------

    def look_at(
        self, state: State, size: tuple[int, int], antialias: int, eye: str | None = None
    ) -> None:
        """Set the content of the next draws."""
        self._state = state
        expansion = state.video.expansion
        if expansion != self._planes.expansion:
            expansion.check_video(self._reader.path, self.coding)
            self._planes = Planes(self._device, expansion)
            self._frames = PictureFrames(self._reader, self._planes, self._maker.known)
            self._changing = ChangingLight(self._device)
        self._exposed = self._exposure(state, Shutter(0))

    def passes(self) -> dict[str, wgpu.GPUTexture]:
        """The sharp picture and its layers; 0 everywhere as long as they are unknown."""
        assert self._exposed is not None
        frame, images = self._frames(self._exposed.here), self._images
        width, height = frame.size
        motion = frame.motion if frame.motion is not None else np.zeros((height, width, 4), "f4")
        depth = frame.depth if frame.depth is not None else np.zeros((height, width), "f4")
        found = {"color": self._sharp(frame)}
        for name, array in (("motion", motion), ("depth", depth)):
            texel = "r32float" if name == "depth" else "rgba32float"
            images.upload(name, array, texel)
            found[name] = images.texture(name, frame.size, texel)
        return found

    def _sharp(self, frame: Frame) -> wgpu.GPUTexture:
        self._images.upload("color", padded(frame.color, 4, 1), "rgba32float")
        color = self._images.texture("color", frame.size, "rgba32float")
        if not self._planes.expansion:
            return color
        shown = self._images.texture("shown", frame.size, "rgba32float")
        self._compress(color, shown)
        return shown

    def draw(
        self,
        blur: Blur,
        target: wgpu.GPUTexture,
        budget: tuple[int, float],
        timing: Clock | None,
    ) -> int:
        """Draw the exposure of the present output frame with `blur`, all its samples."""
        shutter, light = blur.shutter, target
        if self._planes.expansion:
            size = target.size[0], target.size[1]
            light = self._images.texture("light", size, "rgba32float")
        neighbours = "neighbours" in blur.method.uses
        found = self._exposure(self._state, shutter).cells
        moving = [cell for cell in found if self._moves_in(cell)]
        exposed = light
        if moving:
            exposed = self._images.texture("exposed", light.size[:2], "rgba32float")
        try:
            parts = ((cell, self._frames(cell.index, neighbours), blur) for cell in found)
            self._sum.draw(parts, exposed, timing)
        finally:
            blur.shutter = shutter
        if moving:
            self._change_light(moving, exposed, light)
        if light is not target:
            self._compress(light, target)
        return blur.samples

    def _moves_in(self, cell: Cell) -> bool:
        return cell.shutter.degrees > 0 and "motion" in self._frames(cell.index).has

    def _change_light(
        self, cells: Sequence[Cell], exposed: wgpu.GPUTexture, output: wgpu.GPUTexture
    ) -> None:
        """Add changes of light in the pictures of these cells to the exposure."""
        for cell in cells:
            indices, factors = self._frames.surroundings(cell.index)
            frame, names = self._frames(cell.index), dict(zip(indices, _LIGHTS, strict=True))

            def light(index: int, names: Mapping[int | None, str] = names) -> wgpu.GPUTexture:
                other, name = self._frames(index), names[index]
                if self._lit.get(name) is not other.color:
                    self._images.upload(name, padded(other.color, 4, 1), "rgba32float")
                    self._lit[name] = other.color
                return self._images.texture(name, other.size, "rgba32float")

            holdout = frame.holdout
            assert frame.motion is not None
            held = None if holdout is None else self._images.upload("held", holdout, "r32float")
            motion = self._images.upload("moving", frame.motion, "rgba32float")
            encoder = self._device.create_command_encoder(label="changing light")
            self._changing.encode(
                encoder,
                light,
                Surroundings(indices, factors, motion, held),
                shares_of(cell.shutter, factors),
                cell.share,
                cell is cells[0],
            )
            gpu.submit(self._device, encoder)
        encoder = self._device.create_command_encoder(label="changing light")
        self._changing.add(encoder, exposed.create_view(), output.create_view())
        gpu.submit(self._device, encoder)

    def _compress(self, light: wgpu.GPUTexture, output: wgpu.GPUTexture) -> None:
        """Make expanded light as it was."""
        encoder = self._device.create_command_encoder(label="compress")
        self._planes.compress(encoder, light.create_view(), output.create_view())
        gpu.submit(self._device, encoder)


def _near(number: int, reach: int, known: Knowledge) -> list[int]:
    """A picture, and with `reach` 1 those that its motion leads to."""
    found = known(number)
    if found is None or not reach:
        return [number]
    before = None if found.begins else found.before
    after = None if found.ends else found.after
    return [n for n in (number, before, after) if n is not None]


# ---- frames of a video's pictures, with their motion as far as it is known; the last ones are kept


_MEMORY = 1 << 29  # bytes of pictures kept
_FEWEST = 12  # pictures kept at least


class PictureFrames:
    """Pictures of a video as Frames; `known` tells of their motion.

    `planes`: make their light.
    """

    def __init__(self, reader: VideoReader, planes: Planes, known: Knowledge):
        self._reader, self._known = reader, known
        self._pictures = VideoPictures(reader, planes)
        self._times = reader.times.seconds
        self._colors: OrderedDict[int, np.ndarray] = OrderedDict()
        self._frames: OrderedDict[int, tuple[PictureFinding | None, Frame]] = OrderedDict()

    def __call__(self, number: int, neighbours: bool = False) -> Frame:
        """A picture with its motion; with `neighbours` between them, where motion leads there."""
        frame, known = self._frame(number), self._known(number)
        if not neighbours or known is None or "motion" not in frame.has:
            return frame
        before = None if known.begins or known.before is None else self._frame(known.before)
        after = None if known.ends or known.after is None else self._frame(known.after)
        return frame.between(
            *(one if one is not None and "motion" in one.has else None for one in (before, after))
        )

    def surroundings(
        self, number: int
    ) -> tuple[tuple[int | None, int, int | None], tuple[float, float]]:
        """Numbers of a picture, of those its motion leads to, and of those that `evened` it."""
        known = self._known(number)
        if known is None:
            return (None, number, None), (1.0, 1.0)
        before = None if known.begins else known.before
        after = None if known.ends else known.after
        return (before, number, after), self._factors(number, known)

    def _factors(self, number: int, known: PictureFinding) -> tuple[float, float]:
        """See evened(); of the motion to the previous and the next picture."""
        before = None if known.begins_shot else known.before
        after = None if known.ends_shot else known.after
        near = [n for n in (before, number, after) if n is not None]
        known_ways = not known.begins, not known.ends
        tolerance = self._reader.tolerance
        return evened(self._times[near], near.index(number), known_ways, tolerance)

    def _frame(self, number: int) -> Frame:
        known = self._known(number)
        held = self._frames.get(number)
        if held is None or held[0] is not known:
            held = self._frames[number] = known, self._build(number, known)
            most = max(_MEMORY // (3 * held[1].color.nbytes), _FEWEST)
            while len(self._frames) > most:
                self._frames.popitem(last=False)
        self._frames.move_to_end(number)
        return held[1]

    def _build(self, number: int, known: PictureFinding | None) -> Frame:
        color = self._color(number)
        if known is None or known.motion is None:
            return Frame(color, number=number).locked()
        back, ahead = self._factors(number, known)
        motion = known.motion
        if (back, ahead) != (1.0, 1.0):
            motion = motion * np.array([back, back, ahead, ahead], np.float32)
        held_out = known.holdout
        made = Frame(color, motion=motion, depth=known.depth, holdout=held_out, number=number)
        return made.locked()

    def _color(self, number: int) -> np.ndarray:
        """A picture; the nearest one before, or after, if it cannot be decoded."""
        if number not in self._colors:
            color = self._pictures.at(number)
            near = range(number - 1, -1, -1), range(number + 1, len(self._reader))
            for other in (n for some in near for n in some):
                if color is not None:
                    break
                color = self._colors.get(other)
                color = self._pictures.at(other) if color is None else color
            if color is None:
                raise InputError(f"{self._reader.path}: its pictures cannot be decoded any more")
            self._colors[number] = color
            while len(self._colors) > max(_MEMORY // color.nbytes, _FEWEST):
                self._colors.popitem(last=False)
        self._colors.move_to_end(number)
        return self._colors[number]
