"""Subjects of the viewer: a built-in scene or frames on disk, drawn into GPU textures."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...color.spaces import ColorConfig, ColorSpace, Display
from ...extent import EVERYWHERE
from ...frame import Frame
from ...gpu.textures import TexturePool, copy_middle
from ...gpu.timing import Clock
from ...gpu_frame.residency import Residency
from ...methods import METHODS
from ...methods.contract import frames_around, reach_of
from ...pipeline.blur import Blur, uploaded
from ...pipeline.panorama import PanoramaCanvas
from ...render import Render
from ...scene import builtin
from ...scene.scene import Scene
from ...sequence.data_windows import (
    NONE,
    Window,
    placed,
    union,
)
from ...sequence.frame_file import FrameFile
from ...sequence.input_color import space_of, without_pixels
from ...sequence.layers import names
from ...settings import size_of
from ..state.state import BOTH_EYES, State
from .video import VideoSubject

_MEMORY = 1 << 30  # bytes of frames kept, so that going to and fro needs no reading
_FRAMES_KEPT = 2, 16  # but so many at least, at most
_SETS_KEPT = 3  # of a frame's textures: for two images that are compared, and for their previews
# A frame's number, its view, if it is one of a pair, and frames that are read to either side of it.
_Which = tuple[int, str | None, bool, int]
Texture = wgpu.GPUTexture
Budget = tuple[int, float]
"""Samples done before, and seconds to spend on more."""


class SceneSubject:
    """A built-in scene: any size, any moment, every method that it has what to show for."""

    def __init__(self, device: wgpu.GPUDevice):
        self._render = Render(builtin.make(next(iter(builtin.SCENES))), Blur("tap", device=device))
        self._scene_key: tuple[Any, ...] = ()
        self._held = self._render.scene

    def has(self, state: State) -> frozenset[str]:
        """Inputs that a method may ask for; figures are flat: they have no pictures of instants."""
        flat = self._scene(state).figure is not None
        return frozenset({"scene"} if flat else {"color", "motion", "depth", "scene"})

    def methods(self, state: State) -> list[str]:
        """Names of the methods that can draw it."""
        scene, can = self._scene(state), methods_for(self.has(state))
        if scene.figure is not None:
            return ["volume"]
        return can if scene.has_volumes else [name for name in can if name != "volume"]

    def nature(self, state: State) -> str | None:
        """The method that shows it under a shutter of any length, if there is one."""
        scene = self._scene(state)
        if scene.figure is not None:
            perceived = scene.figure.kind in ("NATURAL", "SCREEN")  # already
            return None if perceived else "volume"
        if callable(scene.volumes):  # their speeds are those of a moment
            return None
        return "volume" if scene.volumes and state.method == "volume" else "distributed"

    def size(self, state: State) -> tuple[int, int]:
        """Width and height that give the picture its shape [px]."""
        return size_of(state.scene.size)

    def space(self, config: ColorConfig) -> ColorSpace:
        """The colour space."""
        return config.space_of({})

    def look_at(
        self, state: State, size: tuple[int, int], antialias: int, eye: str | None = None
    ) -> None:
        """Set the content of the next draws."""
        self._render.scene = self._scene(state)
        self._render.size, self._render.antialias, self._render.fps = size, antialias, state.fps
        self._time, self._number = state.frame / state.fps, int(state.frame // 1)

    def _scene(self, state: State) -> Scene:
        seen = state.source, state.scene
        if seen != self._scene_key:
            self._held, self._scene_key = state.scene.make(state.source), seen
        return self._held

    def passes(self) -> dict[str, Texture]:
        """The sharp picture and its layers, by name."""
        return self._render.passes(self._time, self._number)

    def draw(self, blur: Blur, output: Texture, budget: Budget, timing: Clock | None) -> int:
        """Draw with `blur`; samples done, which may be less than it has where it is slow."""
        view, (done, seconds) = output.create_view(), budget
        if "progress" in blur.method.uses:
            return self._render.refine(
                view, self._time, self._number, done=done, seconds=seconds, blur=blur
            )
        self._render.draw(view, self._time, self._number, blur=blur, timing=timing)
        return blur.samples


@dataclass
class _Uploads:
    """A set of textures, and their contents."""

    residency: Residency
    which: tuple[_Which, tuple[int, int]] | None = None
    inputs: dict[str, Any] = field(default_factory=dict)


class ClipSubject:
    """Frames on disk: their own size, their own moments, the methods they have passes for.

    `finding`: the convention of their vectors; the test takes longer than reading a frame.
    """

    def __init__(self, device: wgpu.GPUDevice, state: State, display: Display | None):
        self._device, self._images = device, TexturePool(device)
        blur, space = state.blur, state.color.space(display)
        self._clip = state.input.open(state.source, blur.holdout, blur.scale, space)
        self._headers: dict[tuple[Any, ...], FrameFile] = {}  # what the frames say of their colours
        self._layers: dict[tuple[Any, ...], dict[str, str]] = {}
        self._frames: OrderedDict[_Which, Frame] = OrderedDict()
        self._sharp, self._panorama = Blur("tap", device=device), PanoramaCanvas()
        self._uploads: OrderedDict[tuple[Any, ...], _Uploads] = OrderedDict()
        self._now = self._which(state)

    @cached_property
    def finding(self) -> str:
        """The convention of the vectors, in words."""
        found = f"vectors: {self._clip.finding}"
        if "motion" in self._frame(self._now).has:
            return found
        return f"{found}; shown sharp, `wgmb blur` finds the motion in such frames"

    def light(self) -> np.ndarray | None:
        """The present picture alone, (height, width, 4), as its file has it.

        None of a part of a picture, whose frame is drawn on a canvas of its own, and of pixels that
        are not square.
        """
        source = self._clip.source(*self._now[:2])
        if source.window not in (None, (0, 0, *source.size)) or source.pixel_aspect != 1:
            return None
        return _opaque(source.rgba)

    def has(self, state: State) -> frozenset[str]:
        """Inputs that a method may ask for."""
        return self._frame(self._which(state)).has

    def methods(self, state: State) -> list[str]:
        """Names of the methods that can be fed."""
        return methods_for(self.has(state))

    def nature(self, state: State) -> str | None:
        """The method that shows it under a shutter of any length: nobody knows more than frames."""
        return None

    def size(self, state: State) -> tuple[int, int]:
        """Width and height of the frames [px]."""
        return self._frame(self._which(state)).size

    @property
    def shape(self) -> tuple[float, float]:
        """Width and height in square pixels, as the frame is shown."""
        width, height = self._frame(self._now).size
        return width * float(self._headers[self._now[:2]].pixel_aspect), height

    def space(self, config: ColorConfig) -> ColorSpace:
        """The colour space of the frame; InputError if it is unknown."""
        self._frame(self._now)
        return space_of(self._headers[self._now[:2]], config)

    @property
    def layers(self) -> dict[str, str]:
        """Names of the layers in the frame's file: "picture", and "depth" if it has one."""
        self._frame(self._now)
        return self._layers[self._now[:2]]

    @property
    def eyes(self) -> list[str]:
        """Names of the views, the default one first; none of frames with one picture."""
        views = self._clip.views
        return [*self._clip.chosen, *(v for v in views if v not in self._clip.chosen)]

    def sides(self) -> tuple[str, str]:
        """The views for the left and the right eye: by their names, else the first two."""
        left, right = (
            next((v for v in self.eyes if v.lower() in (word, word[0])), None)
            for word in ("left", "right")
        )
        left = left or next(v for v in self.eyes if v != right)
        return left, right or next(v for v in self.eyes if v != left)

    def look_at(
        self, state: State, size: tuple[int, int], antialias: int, eye: str | None = None
    ) -> None:
        """Set the content of the next draws; `eye`: the view."""
        self._now = self._which(state, eye)

    def _which(self, state: State, eye: str | None = None) -> _Which:
        numbers = self._clip.numbers
        number = max((n for n in numbers if n <= state.frame), default=min(numbers))
        default = self.eyes[0] if self.eyes else None
        eye = eye or (state.eyes if state.eyes in self.eyes else default)
        reach = state.setting("reach")
        is_pair = state.mode in BOTH_EYES and len(self.eyes) > 1
        return number, eye, is_pair, reach if isinstance(reach, int) else 1

    def _frame(self, which: _Which) -> Frame:
        """A frame; of a pair, on a canvas that holds both."""
        number, eye, is_pair, reach = which
        frame = self._kept((number, eye, False, reach))
        if is_pair and which not in self._frames:
            both = [self._kept((number, side, False, reach)) for side in self.sides()]
            self._frames[which] = _on_canvas(frame, union(map(_canvas, both)))
        return self._frames[which] if is_pair else frame

    def _kept(self, key: _Which) -> Frame:
        """A frame, by its number and view, and its neighbours."""
        if key not in self._frames:
            source = self._clip.source(*key[:2])
            frame = self._clip.with_neighbours(source, extent=EVERYWHERE, reach=key[3])
            self._headers[key[:2]] = without_pixels(source)
            self._layers[key[:2]] = _layers(source, self._clip.passes.depth)
            least, most = _FRAMES_KEPT
            around = 2 * key[3] + 1
            kept = min(max(_MEMORY // (around * _bytes(frame)), least), most)
            while len(self._frames) >= kept:
                self._frames.popitem(last=False)
            self._frames[key] = frame
        self._frames.move_to_end(key)
        return self._frames[key]

    def _inputs(self, blur: Blur, is_whole: bool = True) -> dict[str, Any]:
        """The frame's textures, one set for all methods that take the same.

        `is_whole`: a panorama has room beyond its edges for the blur.
        """
        method, frame = blur.method, self._frame(self._now)
        key = method.needs | method.uses, reach_of(method)
        while len(self._uploads) >= _SETS_KEPT and key not in self._uploads:
            self._uploads.popitem(last=False)
        if key not in self._uploads:
            images = TexturePool(self._device)
            self._uploads[key] = _Uploads(Residency(images, key[0], 2 * key[1] + 1))
        self._uploads.move_to_end(key)
        kept = self._uploads[key]
        if is_whole and frame.wrap == "on":
            frame = self._panorama.of(frames_around(frame, method), blur.extent)
        which = self._now, frame.size
        if kept.which != which:
            kept.which = None
            with gpu.reported(frame.size):
                kept.inputs = uploaded(frame, method, kept.residency)
            kept.which = which
        return dict(kept.inputs)

    def passes(self) -> dict[str, Texture]:
        """The sharp picture and its layers, by name; only those that exist."""
        frame, images = self._frame(self._now), self._images
        inputs = self._inputs(self._sharp, is_whole=False)
        color, depth, motion_ = (f"{name} {self._now[1]}" for name in ("color", "depth", "motion"))
        images.upload(color, _opaque(frame.color), "rgba32float")
        found = {"color": images.texture(color, frame.size, "rgba32float")}
        if frame.depth is not None:
            images.upload(depth, frame.depth, "r32float")
            found["depth"] = images.texture(depth, frame.size, "r32float")
        if "motion" in frame.has:
            motion = images.texture(motion_, frame.size, "rgba32float")
            encoder = self._device.create_command_encoder(label="motion")
            self._sharp.encode_motion(encoder, inputs["frame"], motion.create_view())
            gpu.submit(self._device, encoder)
            found["motion"] = motion
        return found

    def draw(self, blur: Blur, output: Texture, budget: Budget, timing: Clock | None) -> int:
        """Draw with `blur`, all its samples."""
        encoder = self._device.create_command_encoder(label="blur")
        inputs = self._inputs(blur)
        size, wide = inputs["frame"].size, output
        if size != tuple(output.size[:2]):
            wide = self._images.texture("wide", size, blur.output)
        blur.encode(encoder, output=wide.create_view(), timing=timing, **inputs)
        if wide is not output:
            copy_middle(encoder, wide, output)
        gpu.submit(self._device, encoder)
        return blur.samples


def _opaque(color: np.ndarray) -> np.ndarray:
    """Colours (height, width, 3 or 4) with alpha, of 1 where they have none."""
    rgba = np.ones((*color.shape[:2], 4), np.float32)
    rgba[..., : color.shape[2]] = color
    return rgba


def _layers(source: FrameFile, wanted_depth: str | None) -> dict[str, str]:
    """Names of the picture's layer and of the depth's channel."""
    picture = next((name for name in source.color if name), "")
    depth = names.find_depth(source.channels, wanted_depth, source.reference_channel)
    found = {"picture": picture.rpartition(".")[0] or ", ".join(filter(None, source.color))}
    return found | ({"depth": depth} if depth else {})


def _canvas(frame: Frame) -> Window:
    """Position of a frame's pixels, counted from the display window's corner."""
    x, y = frame.window[:2] if frame.window else (0, 0)
    return x, y, x + frame.size[0] - 1, y + frame.size[1] - 1


def _on_canvas(frame: Frame, onto: Window) -> Frame:
    """A frame and its neighbours on a canvas that holds them; beyond them is nothing."""
    window = _canvas(frame)
    if window == onto:
        return frame
    near = (f and _on_canvas(f, onto) for f in (frame.prev, frame.next))
    return placed(replace(frame, prev=None, next=None), window, onto, NONE).between(*near)


def _bytes(frame: Frame) -> int:
    arrays = (getattr(frame, f.name) for f in fields(frame))
    return sum(a.nbytes for a in arrays if isinstance(a, np.ndarray))


Subject = SceneSubject | ClipSubject | VideoSubject


def methods_for(has: frozenset[str]) -> list[str]:
    """The methods for which all inputs exist."""
    return [name for name, method in METHODS.items() if method.needs <= has]
