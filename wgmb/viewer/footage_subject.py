"""A video as the viewer's subject: pictures at once, their blur once their motion is known."""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import Any

import numpy as np
import wgpu

from ..coding import Coding
from ..display import ColorConfig, ColorSpace
from ..errors import InputError
from ..exposure import Cell, cells, evened
from ..frame import Frame
from ..gpu.textures import TexturePool
from ..gpu.timing import TimestampClock
from ..io import limits
from ..io.footage import Footage
from ..io.video_masks import STATIC, holdout_of
from ..methods import METHODS
from ..pipeline import Blur
from ..shutter import Shutter
from ..video_pictures import VideoPictures
from ..video_settings import FlowSettings
from .cell_sum import CellSum
from .motion_maker import Known, MotionMaker
from .state import State

_MEMORY = 1 << 29  # bytes of pictures kept
_FEWEST = 12  # pictures kept at least
_PASSES = frozenset({"color", "motion", "depth"})
_AHEAD = 48  # pictures whose motion is made while playing


class FootageSubject:
    """A video: the exposures of its own pictures, as `wgmb blur` makes them.

    Where the motion of a picture is not known yet the picture is shown as it is; `stamp` changes
    when more is known. `finding`: where motion comes from.
    """

    def __init__(self, device: wgpu.GPUDevice, state: State):
        given: dict[str, Any] = dict(state.given)
        max_mb, masks = given.pop("max_mb", limits.MAX_MB), given.pop("holdout", ())
        if "cuts" in given:
            raise InputError(
                "--cuts is for `wgmb blur`: the viewer finds the cuts of videos itself"
            )
        if given:
            option = next(iter(given)).replace("_", "-")
            raise InputError(f"--{option} is for rendered frames, a video has no layers")
        self._device, self._images = device, TexturePool(device)
        self._footage = Footage(state.source, max_mb=max_mb)
        self._pictures = VideoPictures(self._footage, device)
        self._times = self._footage.times.seconds
        asked: dict[str, Any] = {"flow": state.flow, "flow_quality": state.flow_quality}
        settings = FlowSettings(**asked)
        holdout_of([mask for mask in masks if mask != STATIC], self._footage)  # says what is wrong
        self._maker = MotionMaker(self._footage.path, max_mb, settings, device, masks)
        self._moves = settings.flow != "none"
        self.finding = f"motion: {self._maker.how}"
        if masks and not self._moves:
            self.finding += "; averages hold nothing out"
        self._colors: OrderedDict[int, np.ndarray] = OrderedDict()
        self._frames: OrderedDict[int, tuple[Known | None, Frame]] = OrderedDict()
        self._sums: dict[int, CellSum] = {}
        self._now, self._interval = 0, 1.0
        self._lacking: list[int] = []

    # ---- what can be shown -----------------------------------------------------------------

    def has(self, state: State) -> frozenset[str]:
        """What a method may ask for."""
        return _PASSES if self._moves else frozenset({"color"})

    def methods(self, state: State) -> list[str]:
        """Names of the methods that can be fed; all are the same where pictures are averaged."""
        return [name for name, method in METHODS.items() if method.needs <= _PASSES]

    def nature(self, state: State) -> str | None:
        """The method that shows it under a shutter of any length: there is none."""
        return None

    def size(self, state: State) -> tuple[int, int]:
        """Width and height of the pictures [px]."""
        return self._footage.size

    @property
    def coding(self) -> Coding:
        """The coding of its colours; its light is linear in these primaries."""
        return self._footage.coding

    def space(self, config: ColorConfig) -> ColorSpace:
        """The colour space of the pictures that VideoLight makes: linear Rec. 709."""
        return config.space_of({})

    # ---- what is known --------------------------------------------------------------------

    def stamp(self, state: State, shutter: Shutter, neighbours: bool) -> tuple:
        """What is known of the pictures that the present one is exposed from.

        The motion that lacks is asked for, and while playing also that of the pictures to come.
        """
        number = self._number(state)
        first, last = self._reach(number, state.tempo / state.fps, shutter)
        beside = 1 if neighbours and self._moves else 0
        near = sorted(range(first - beside, last + beside + 1), key=lambda n: abs(n - number))
        wanted = [n for n in near if 0 <= n < len(self._footage)]
        if state.playing:
            wanted += range(number + 1, min(number + _AHEAD, len(self._footage)))
        self._maker.want(tuple(wanted))
        self._lacking = [n for n in wanted[: len(near)] if self._maker.known(n) is None]
        return tuple(n for n in wanted[: len(near)] if self._maker.known(n) is not None)

    @property
    def busy(self) -> bool:
        """True while what is shown lacks motion that is being made."""
        return bool(self._lacking) and not self._maker.problem

    @property
    def waiting(self) -> str:
        """What is shown instead of the blur, and why; '' if all is there."""
        if not self._lacking:
            return ""
        if self._maker.problem:
            return f"sharp: {self._maker.problem}"
        making = self._maker.making
        number, took = making or (self._lacking[0], 0.0)
        what = "the motion" if self._moves else "the shot"
        since = f" since {took:.0f} s" if took >= 1 else ""
        sharp = "sharp: " if self._now in self._lacking else ""
        return f"{sharp}{what} of picture {number} is being found{since}"

    def close(self) -> None:
        """Let the search for motion end."""
        self._maker.close()

    def _number(self, state: State) -> int:
        return min(max(math.ceil(state.frame - 0.5), 0), len(self._footage) - 1)

    def _reach(self, number: int, interval: float, shutter: Shutter) -> tuple[int, int]:
        """First and last picture whose cells are exposed with one, if no cut lies between."""
        times = self._times
        opens, closes = (times[number] + interval * t for t in shutter.span)
        first = last = number
        while first > 0 and (times[first] + times[first - 1]) / 2 > opens:
            first -= 1
        while last + 1 < len(times) and (times[last] + times[last + 1]) / 2 < closes:
            last += 1
        return first, last

    # ---- drawing --------------------------------------------------------------------------

    def look_at(
        self, state: State, size: tuple[int, int], antialias: int, eye: str | None = None
    ) -> None:
        """What the next draws are of."""
        self._now, self._interval = self._number(state), state.tempo / state.fps

    def passes(self) -> dict[str, wgpu.GPUTexture]:
        """The sharp picture and what lies under it; 0 everywhere as long as it is not known."""
        frame, images = self._frame(self._now), self._images
        width, height = frame.size
        motion = frame.motion if frame.motion is not None else np.zeros((height, width, 4), "f4")
        depth = frame.depth if frame.depth is not None else np.zeros((height, width), "f4")
        rgba = np.ones((height, width, 4), np.float32)
        rgba[..., : frame.color.shape[2]] = frame.color
        found = {}
        for name, array in (("color", rgba), ("motion", motion), ("depth", depth)):
            texel = "r32float" if name == "depth" else "rgba32float"
            images.upload(name, array, texel)
            found[name] = images.texture(name, frame.size, texel)
        return found

    def draw(
        self,
        blur: Blur,
        output: wgpu.GPUTexture,
        budget: tuple[int, float],
        timing: TimestampClock | None,
    ) -> int:
        """Draw the exposure of the present picture with `blur`, all its samples."""
        shutter = blur.shutter
        try:
            self._sum(blur).draw(self._parts(shutter, blur), output)
        finally:
            blur.shutter = shutter
        return blur.samples

    def _sum(self, blur: Blur) -> CellSum:
        held = self._sums.get(id(blur))
        if held is None or held.blur is not blur:
            while len(self._sums) >= 4:
                del self._sums[next(iter(self._sums))]
            held = self._sums[id(blur)] = CellSum(blur)
        return held

    def _parts(self, shutter: Shutter, blur: Blur) -> list[tuple[Cell, Frame]]:
        """The cells of the exposure, as far as what lies around is known."""
        number, times = self._now, self._times
        first, last = self._reach(number, self._interval, shutter)
        low = high = number
        while low > max(first - 1, 0) and self._same_shot(low):
            low -= 1
        while high < min(last + 1, len(times) - 1) and self._same_shot(high + 1):
            high += 1
        found = cells(times[low : high + 1].tolist(), times[number], self._interval, shutter)
        neighbours = "neighbours" in blur.method.uses
        return [(cell, self._between(low + cell.index, neighbours)) for cell in found]

    def _same_shot(self, number: int) -> bool:
        """Whether it is known that a picture and the one before belong to one shot."""
        before, here = self._maker.known(number - 1), self._maker.known(number)
        if here is not None:
            return not here.begins_shot
        return before is not None and not before.ends_shot

    def _moves_on(self, number: int) -> bool:
        """Whether it is known that motion leads from the picture before to this one."""
        before, here = self._maker.known(number - 1), self._maker.known(number)
        if here is not None:
            return not here.begins
        return before is not None and not before.ends

    def _between(self, number: int, neighbours: bool) -> Frame:
        """The picture with its motion, between its neighbours as far as their motion is known."""
        frame = self._frame(number)
        if not neighbours or "motion" not in frame.has:
            return frame
        before, after = (
            self._frame(n)
            if 0 <= n < len(self._footage) and self._moves_on(max(n, number))
            else None
            for n in (number - 1, number + 1)
        )
        return frame.between(before, after)

    def _frame(self, number: int) -> Frame:
        known = self._maker.known(number)
        held = self._frames.get(number)
        if held is None or held[0] is not known:
            held = self._frames[number] = known, self._made(number, known)
            most = max(_MEMORY // (3 * held[1].color.nbytes), _FEWEST)
            while len(self._frames) > most:
                self._frames.popitem(last=False)
        self._frames.move_to_end(number)
        return held[1]

    def _made(self, number: int, known: Known | None) -> Frame:
        color = self._color(number)
        if known is None or known.motion is None:
            return Frame(color, number=number).locked()
        first, last = number - (not known.begins_shot), number + (not known.ends_shot)
        there = not known.begins, not known.ends
        back, ahead = evened(self._times[first : last + 1], number - first, there)
        motion = known.motion
        if (back, ahead) != (1.0, 1.0):
            motion = motion * np.array([back, back, ahead, ahead], np.float32)
        held_out = known.holdout
        made = Frame(color, motion=motion, depth=known.depth, holdout=held_out, number=number)
        return made.locked()

    def _color(self, number: int) -> np.ndarray:
        """A picture; the nearest one before, if it cannot be decoded."""
        if number not in self._colors:
            color = self._pictures.at(number)
            if color is None:
                if number == 0:
                    raise InputError(f"{self._footage.path}: its first picture cannot be decoded")
                return self._color(number - 1)
            self._colors[number] = color
            while len(self._colors) > max(_MEMORY // color.nbytes, _FEWEST):
                self._colors.popitem(last=False)
        self._colors.move_to_end(number)
        return self._colors[number]
