"""A video as the viewer's subject: pictures at once, their blur once their motion is known."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...color.coding import Coding
from ...color.highlights import Expansion
from ...color.spaces import ColorConfig, ColorSpace
from ...exposure import Cell
from ...gpu.textures import TexturePool
from ...gpu.timing import Clock
from ...methods import METHODS
from ...pipeline.blur import Blur
from ...shutter import Shutter
from ...video.exposures import ExposedLight
from ...video.gpu_frames import VideoFrames
from ...video.holdouts import STATIC, holdout_of
from ...video.planes import Planes
from ..state.allowed import check_video
from ..state.files import reader_of
from ..state.state import State
from ..state.video_time import described, output, output_frame
from .motion_thread import MotionThread
from .video_exposure import (
    ClockedTimes,
    Knowledge,
    KnownHoldout,
    KnownMotion,
    KnownShots,
    VideoExposure,
    exposure_of,
    reach,
)
from .video_motion import MotionRequest

_PASSES = frozenset({"color", "motion", "depth"})
_AHEAD = 48  # pictures whose motion is made while playing


class VideoSubject:
    """A video: its output frames, which wgmb/video exposes as for `wgmb blur`.

    Where the motion of a picture is not known yet the picture is shown as it is; `stamp` changes
    when more is known. `finding`: the source of motion, and peculiarities of the file. `at_edges`:
    blurs pictures whose motion has edges, if not the Blur of `draw`.
    """

    def __init__(self, device: wgpu.GPUDevice, state: State):
        check_video(state)
        max_mb, masks, settings = state.input.max_mb, state.blur.holdout, state.video
        self._device, self._images = device, TexturePool(device)
        self._reader = reader_of(state.source, max_mb)
        holdout_of([mask for mask in masks if mask != STATIC], self._reader)  # says what is wrong
        self._is_filled = settings.duplicates == "fill"
        request = MotionRequest(masks, self._is_filled, state.input.cuts or "")
        self._maker = MotionThread(self._reader.path, max_mb, settings, device, request)
        self._moves = settings.flow != "none"
        self.finding = "\n".join([f"motion: {self._maker.how}", *self._reader.notes])
        self._shots = KnownShots(self._reader, self._times(state), self._maker.known)
        self._motion = KnownMotion(device, self._maker.known) if self._moves else None
        self._plain = Blur("tap", device=device)
        self.at_edges: Blur | None = None
        self._expand(Expansion())
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
        beside = self._moves * (int(neighbours) + self._is_filled)
        known = lru_cache(maxsize=None)(self._maker.known)  # the same throughout: a thread adds
        asked: dict[int, None] = {}
        stamps, lacking = [], []
        for state in states:
            found = self._exposure(state, shutter, known)
            of_motion = [n for cell in found.cells for n in _near(cell.index, beside, known)]
            needed = [*found.lacking, *of_motion]
            first, last = reach(self._times(state), output_frame(state), shutter)
            soon = range(max(first - beside, 0), min(last + beside + 1, len(self._reader)))
            asked |= dict.fromkeys([*needed, *sorted(soon, key=lambda n: abs(n - found.here))])
            lacking += [n for n in needed if known(n) is None]
            stamps.append(tuple(n for n in needed if known(n) is not None))
        count = len(asked)
        if states[0].playing and asked:
            newest = max(asked)
            asked |= dict.fromkeys(range(newest, min(newest + _AHEAD, len(self._reader))))
        self._maker.want(tuple(asked), count)
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
        times, frame = self._times(state), output_frame(state)
        return exposure_of(times, frame, shutter, known or self._maker.known, self._is_filled)

    def _times(self, state: State) -> ClockedTimes:
        """The times of its pictures in the output."""
        reader, made = self._reader, output(state)
        own = reader.times if made.frames.has_own_times else reader.exact_times
        return ClockedTimes(own, made.clock, reader.tolerance / float(made.clock.speed))

    # ---- drawing --------------------------------------------------------------------------

    def look_at(
        self, state: State, size: tuple[int, int], antialias: int, eye: str | None = None
    ) -> None:
        """Set the content of the next draws."""
        self._state = state
        expansion = state.video.expansion
        if expansion != self._planes.expansion:
            expansion.check_video(self._reader.path, self.coding)
            self._expand(expansion)
        self._shots.retime(self._times(state))
        self._exposed = self._exposure(state, Shutter(0))

    def _expand(self, expansion: Expansion) -> None:
        """Make all light anew, expanded so."""
        self._planes = planes = Planes(self._device, expansion)
        held = KnownHoldout(known=self._maker.known)
        self._frames = VideoFrames(
            self._shots, self._plain, holdout=held, planes=planes, known_motion=self._motion
        )
        self._light = ExposedLight(planes)

    def passes(self) -> dict[str, wgpu.GPUTexture]:
        """The sharp picture and its layers; 0 everywhere as long as they are unknown."""
        assert self._exposed is not None
        here = self._exposed.here
        light = self._light(self._frames, [Cell(here, 1.0, Shutter(0))], lambda _: self._plain)
        views, (width, height, _) = self._frames.views(here, depth=True), light.size
        found = {"color": self._copy("color", light)}
        for name, view, texel, channels in (
            ("motion", views.motion, "rgba32float", 4),
            ("depth", views.depth, "r32float", 1),
        ):
            if view is None:
                none = np.zeros((height, width, channels), np.float32)
                self._images.upload(name, none, texel)
                found[name] = self._images.texture(name, (width, height), texel)
            else:
                found[name] = self._copy(name, view.texture)
        return found

    def _copy(self, name: str, texture: wgpu.GPUTexture) -> wgpu.GPUTexture:
        """A copy of a texture that others will use."""
        size = texture.size[0], texture.size[1]
        return self._put(texture, self._images.texture(name, size, texture.format))

    def _put(self, texture: wgpu.GPUTexture, target: wgpu.GPUTexture) -> wgpu.GPUTexture:
        encoder = self._device.create_command_encoder(label="copy")
        encoder.copy_texture_to_texture({"texture": texture}, {"texture": target}, texture.size)
        gpu.submit(self._device, encoder)
        return target

    def draw(
        self,
        blur: Blur,
        target: wgpu.GPUTexture,
        budget: tuple[int, float],
        timing: Clock | None,
    ) -> int:
        """Draw the exposure of the present output frame with `blur`, all its samples."""
        shutter = blur.shutter
        cells = self._exposure(self._state, shutter).cells

        def blur_of(cell: Cell) -> Blur:
            return self._frames.blur_of(cell, blur, self.at_edges)

        try:
            light = self._light(self._frames, cells, blur_of, timing)
            self._put(light, target)
        finally:
            blur.shutter = shutter
        return blur.samples


def _near(number: int, reach: int, known: Knowledge) -> list[int]:
    """A picture, and those that its motion leads to in `reach` steps."""
    numbers, ends = [number], [number]
    for _ in range(reach):
        found = [finding for n in ends if (finding := known(n)) is not None]
        before = [one.before for one in found if not one.begins]
        after = [one.after for one in found if not one.ends]
        ends = [n for n in (*before, *after) if n is not None and n not in numbers]
        numbers += ends
    return numbers
