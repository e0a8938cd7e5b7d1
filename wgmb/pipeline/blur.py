"""The pipeline: arrays -> textures -> velocity -> one method -> array."""

from __future__ import annotations

import threading
from collections.abc import Collection
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import Any, Literal, Unpack, overload

import numpy as np
import wgpu
from numpy.typing import NDArray

from .. import gpu
from ..camera import Window
from ..errors import InputError
from ..extent import Extent
from ..frame import Floats, Frame, PassKeywords
from ..gpu import wgsl
from ..gpu.textures import TexturePool, Word, copy_middle
from ..gpu.timing import Clock
from ..gpu_frame.bindings import AUTO_STRATA, FrameConstants
from ..gpu_frame.preparation import Preparation
from ..gpu_frame.residency import Residency
from ..gpu_frame.velocity import VelocityPass
from ..gpu_frame.views import FrameViews, View, check_output, check_view, view_of
from ..methods import METHODS, check_takes_frames
from ..methods.contract import Inputs, Method, PreparedFrame, extent_of, frames_around, reach_of
from ..methods.keywords import Curve, MethodKeywords, MethodName
from ..scene.gbuffer import SceneOnGpu
from ..shutter import Shutter, Weight
from .arguments import checked, method_of, most_samples, shutter_of
from .panorama import PanoramaCanvas, shortest

_NOISES = wgsl.load("common/noise.wgsl").integer("NOISES")


class Blur:
    """A compiled blur method. Call it with arrays, or `encode` it into your own command encoder.

    `method`: a name in METHODS, or a class that keeps the contract of a method (see "A method in a
    package of your own"); its own options follow as keywords.
    `shutter`: degrees (180 is open for half a frame interval), or a Shutter. `curve`: with degrees,
    the weight of each instant, a name or a function; see Shutter.
    `samples`: samples per pixel, 1 to 4096 (gather without a GPU: 512); by default 16, or the
    method's own default; "auto" uses one per pixel of blur (gather with a box: two pixels), at
    most 64 (methods with one count for the whole image use 64).
    `jitter`: 0 to 1, trades banding for noise: random shift of a sample within its share of time.
    `max_blur`: maximum blur length [px]; None: unlimited.
    `device`: your own wgpu device, the name of an adapter, or None for the best one.
    `output`: texel format of the result, rgba32float or rgba16float.

    Several threads may call one Blur: they take turns, as its textures are shared. Use one Blur per
    thread to work in parallel. `encode` records and does not wait: callers that encode from
    several threads must order the submissions themselves.
    """

    @overload
    def __init__(
        self,
        method: MethodName = "gather",
        *,
        shutter: Shutter | float = 180,
        curve: Curve | Weight | None = None,
        samples: int | Literal["auto"] | None = None,
        jitter: float = 0.0,
        max_blur: float | None = None,
        device: wgpu.GPUDevice | str | None = None,
        output: Literal["rgba32float", "rgba16float"] = "rgba32float",
        **options: Unpack[MethodKeywords],
    ) -> None: ...

    @overload
    def __init__(self, method: type[Method], **arguments: Any) -> None: ...

    def __init__(
        self,
        method: MethodName | type[Method] = "gather",
        *,
        shutter: Shutter | float = 180,
        curve: Curve | Weight | None = None,
        samples: int | Literal["auto"] | None = None,
        jitter: float = 0.0,
        max_blur: float | None = None,
        device: wgpu.GPUDevice | str | None = None,
        output: Literal["rgba32float", "rgba16float"] = "rgba32float",
        **options: Any,
    ):
        kind = method_of(method)
        samples, self.auto = checked(kind, samples, jitter, max_blur, output, options)
        self._options = kind.Options(**options)
        gpu.claim()
        self.device = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
        if samples > (most := most_samples(kind, self.device)):
            raise InputError(f"{kind.name} takes 1 to {most} samples without a GPU, got {samples}")
        self.method = kind(self.device, self._options, output=output)
        self.samples, self.jitter, self.max_blur, self.output = samples, jitter, max_blur, output
        self._lock = threading.RLock()
        self._panorama = PanoramaCanvas()
        strata = AUTO_STRATA if self.auto else samples
        self._constants = FrameConstants(self.device, samples, strata, jitter, max_blur)
        self._images = TexturePool(self.device)
        wanted = self.method.needs | self.method.uses
        self._residency = Residency(self._images, wanted, 2 * reach_of(self.method) + 1)
        self._linear = self.device.create_sampler(mag_filter="linear", min_filter="linear")
        self._velocity = VelocityPass(self.device)
        self._prepared = Preparation(self._images, self._velocity, max_blur is not None)
        self._steps: int | None = 1
        self._finds: tuple[Word, ...] = ()
        self._tapes = gpu.Tapes()
        self.shutter = shutter_of(shutter, curve)

    def __repr__(self) -> str:
        shutter = self._shutter
        curve = shutter.curve if isinstance(shutter.curve, str) else "own curve"
        words = f"shutter {shutter.degrees:g}{'' if curve == 'box' else f' {curve}'}"
        samples = "auto" if self.auto else self.samples
        gpu_name = self.device.adapter_info["device"]
        return f'Blur("{self.method.name}", {words}, {samples} samples, {gpu_name})'

    @property
    def confidence(self) -> tuple[str, ...]:
        """Names of the `with_confidence` layers; InputError if the method has none."""
        if names := getattr(self.method, "confidence", ()):
            return names
        able = ", ".join(n for n, m in METHODS.items() if hasattr(m, "confidence"))
        raise InputError(f"method {self.method.name!r} cannot report confidence; use {able}")

    @cached_property
    def _judge(self):
        """The same method, compiled to report its confidence."""
        options = replace(self._options, show="confidence")
        return type(self.method)(self.device, options, output=self.output)

    @property
    def extent(self) -> Extent:
        """Distance over which it moves colours, for frames that hold a part of their picture; see
        Clip.with_neighbours."""
        return extent_of(self.method, self._shutter, self.max_blur)

    @property
    def shutter(self) -> Shutter:
        """The current Shutter; can be set between frames, to degrees or a Shutter."""
        return self._shutter

    @shutter.setter
    def shutter(self, shutter: Shutter | float) -> None:
        self._shutter = shutter_of(shutter)
        self._constants.expose(self._shutter)

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        frame: FrameViews,
        output: View,
        *,
        prev: FrameViews | None = None,
        next: FrameViews | None = None,
        prev_prev: FrameViews | None = None,
        next_next: FrameViews | None = None,
        confidence: View | None = None,
        number: int = 0,
        timing: Clock | None = None,
    ) -> None:
        """Record the passes into `encoder`; nothing is submitted or waited for.

        The views refer to your own textures on this Blur's device, with the usage TEXTURE_BINDING
        and one sample per pixel; an InputError names the input that does not fit. Tried are
        `color` as rgba8unorm, rgba8unorm-srgb, bgra8unorm-srgb, rgb10a2unorm, rg11b10ufloat,
        rgba16float and rgba32float (with the feature float32-filterable); vectors as rg16float,
        rg32float, rgba16float and rgba32float; `depth` as r16float, r32float and as the depth
        buffers depth16unorm, depth24plus and depth32float (a view of the aspect "depth-only" where
        there is a stencil); `object_id` as r8uint, r16uint, r32uint and rg32uint; masks also as
        r8unorm. `output`: a texture of this Blur's output format with the usage STORAGE_BINDING.
        `prev`, `next`: the previous and the next frame, for methods that use neighbours,
        with the same inputs as the frame; `prev_prev`, `next_next`: those beyond them, for methods
        that take two to either side. `confidence`: a texture like `output` for the channels
        of `with_confidence`. `number`: frame number, which varies the jitter.

        `timing` takes the time of every pass: `timing.clock(device)`, whose WallClock runs the
        passes at once instead of recording them.
        """
        self._encode(
            encoder,
            frame,
            output,
            prev=prev,
            next=next,
            prev_prev=prev_prev,
            next_next=next_next,
            confidence=confidence,
            number=number,
            timing=timing,
        )

    def _encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        frame: FrameViews,
        output: View,
        *,
        confidence: View | None = None,
        number: int = 0,
        timing: Clock | None = None,
        steps: int | None = None,
        prev: FrameViews | None = None,
        next: FrameViews | None = None,
        prev_prev: FrameViews | None = None,
        next_next: FrameViews | None = None,
    ) -> None:
        """`encode` with the first `steps` of the method; None: all."""
        size, output, confidence = frame.size, view_of(output), view_of(confidence)
        around = {"": (0, frame)}
        near = {"prev.": (-1, prev), "next.": (1, next)}
        # Those beyond a neighbour count only with it, and only if the method reaches so far.
        near |= {"prev.prev.": (-2, prev and prev_prev), "next.next.": (2, next and next_next)}
        reach = reach_of(self.method)
        around |= {w: (o, f) for w, (o, f) in near.items() if f is not None and abs(o) <= reach}
        for name, view in (("output", output), ("confidence", confidence)):
            if view is not None:
                check_view(name, view, self.device, size)
                check_output(name, view, self.output)
        for whose, (_, one) in around.items():
            one.check_fit(self.device, size, whose)
            self._require(one.has, whose)
        bindings = self.frame_bindings(size, number % _NOISES, frame.window)
        encoder = timing.watch(encoder) if timing else encoder
        frames = self._prepared.frames(encoder, bindings, list(around.values()))
        inputs = self._inputs(bindings, number, frames=frames, steps=steps)
        # Without holdouts the method writes the output itself; else they are put back into it.
        if inputs.frame.weight is None:
            self._record(encoder, inputs, output, confidence)
            return
        result = self._images.view("blurred", size, self.output)
        self._record(encoder, inputs, result, confidence)
        self._prepared.put_back(encoder, bindings, frame, result, output, self.output)

    def encode_scene(
        self,
        encoder: wgpu.GPUCommandEncoder,
        scene: SceneOnGpu,
        output: View,
        *,
        progress: tuple[int, int] | None = None,
        number: int = 0,
        timing: Clock | None = None,
    ) -> None:
        """The same for the methods that need a scene instead of a frame.

        Samples may be recorded in portions: `progress` is the number of samples done so far and
        the number to add.
        """
        gpu.check_size(self.device, *scene.size)
        output = view_of(output)
        check_view("output", output, self.device, scene.size)
        check_output("output", output, self.output)
        self._require({"scene"})
        encoder = timing.watch(encoder) if timing else encoder
        bindings = self.frame_bindings(scene.size, number)
        self._record(
            encoder, self._inputs(bindings, number, scene=scene, progress=progress), output
        )

    def _inputs(
        self,
        bindings: gpu.FrameBindings,
        number: int,
        *,
        frames: tuple[PreparedFrame, ...] = (),
        scene: SceneOnGpu | None = None,
        progress: tuple[int, int] | None = None,
        steps: int | None = None,
    ) -> Inputs:
        return Inputs(
            bindings=bindings,
            samples=self.samples,
            number=number,
            jitter=self.jitter,
            shutter=self._shutter,
            frames=frames,
            linear=self._linear,
            even=self._shutter.curve == "box",
            auto=self.auto,
            drawn=scene,
            progress=progress or (0, self.samples),
            steps=steps,
        )

    def _record(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        output: View,
        confidence: View | None = None,
    ) -> None:
        """Record the method's passes, or play the tape of an equal earlier frame.

        Encoders that take the time of passes get each pass by itself.
        """
        repeats = getattr(self.method, "repeats", None)
        plain = isinstance(encoder, wgpu.GPUCommandEncoder | gpu.Gathering)

        def record(tape: Any) -> None:
            self.method.encode(tape, inputs, output)
            tape.finds = getattr(self.method, "finds", ())

        if plain and repeats is not None and repeats(inputs):
            key, views = _tape_key(inputs)
            tape = self._tapes.play(encoder, inputs.bindings, key, (*views, output), record)
            self._finds = tape.finds
        else:
            self.method.encode(encoder, inputs, output)
            self._finds = getattr(self.method, "finds", ())
        if confidence is not None and self.confidence:
            self._judge.encode(encoder, inputs, confidence)

    def __call__(
        self, color: Floats | Frame, to_next: Floats | None = None, **passes: Unpack[PassKeywords]
    ) -> NDArray[np.float32]:
        """Blur one frame: a Frame, or a colour array and its passes (see Frame).

        Returns float32 of color's shape. Raises InputError if inputs are missing or inconsistent.
        Frames with read-only arrays (Frame.locked) are uploaded once, even if they are used
        again as neighbours.
        """
        frame = color if isinstance(color, Frame) else Frame(color, to_next, **passes)
        self._require(frame.has)
        with self._working(frame.size):
            picture = self._picture(frame)
        return picture[..., : frame.color.shape[2]].astype("f4", copy=False)

    def _picture(self, frame: Frame) -> NDArray[np.floating]:
        """The blurred frame, by as many steps of the method as the frame before needed.

        If one that was left out has work, the frame is blurred once more with all.
        """
        output = self._images.view("output", frame.size, self.output)
        while True:
            encoder = self.device.create_command_encoder(label="wgmb")
            done = self._steps
            self._encode_arrays(encoder, frame, {"output": output}, steps=done)
            picture, words = self._images.download_with(encoder, output.texture, self._finds)
            self._steps = 1 + max((k for k, word in enumerate(words, 1) if word), default=0)
            if done is None or self._steps <= done:
                return picture
            self._steps = None

    def draw(self, frame: Frame, output: View, timing: Clock | None = None) -> None:
        """Submit the blur of a frame into `output`, without waiting; all as for `encode`.

        The output of a panorama needs the usage COPY_DST, too.
        """
        self._require(frame.has)
        with self._working(frame.size):
            encoder = self.device.create_command_encoder(label="wgmb")
            self._encode_arrays(encoder, frame, {"output": view_of(output)}, timing)
            gpu.submit(self.device, encoder)

    def _encode_arrays(
        self,
        encoder: wgpu.GPUCommandEncoder,
        frame: Frame,
        outputs: dict[str, View],
        timing: Clock | None = None,
        steps: int | None = None,
    ) -> None:
        """Record the blur of a frame of arrays into its outputs, as `encode` calls them."""
        laid = self._laid(frame)
        wide = {
            name: view
            if laid is frame
            else self._images.view(f"wide {name}", laid.size, self.output)
            for name, view in outputs.items()
        }
        self._encode(encoder, timing=timing, steps=steps, **wide, **self._views(laid))
        if laid is not frame:
            for name, view in outputs.items():
                copy_middle(encoder, wide[name].texture, view.texture)

    def _laid(self, frame: Frame) -> Frame:
        """The frame; a panorama with room beyond its edges."""
        if frame.wrap == "off":
            return frame
        return self._panorama.of(frames_around(frame, self.method), self.extent)

    def with_confidence(
        self, frame: Frame
    ) -> tuple[NDArray[np.float32], dict[str, NDArray[np.float32]]]:
        """Return the blurred frame and the confidence of every pixel, at twice the cost.

        The confidence layers are (height, width) float32, by the names in `confidence`; their
        meaning is documented with the method's `show`.
        """
        names = self.confidence
        self._require(frame.has)
        size, channels = frame.size, frame.color.shape[2]
        with self._working(size):
            output = self._images.view("output", size, self.output)
            sure = self._images.view("confidence", size, self.output)
            encoder = self.device.create_command_encoder(label="wgmb")
            self._encode_arrays(encoder, frame, {"output": output, "confidence": sure})
            picture = self._images.download(encoder, output.texture)[..., :channels]
            told = self._images.download(self.device.create_command_encoder(), sure.texture)
        planes = np.moveaxis(told.astype("f4", copy=False), 2, 0)
        return picture.astype("f4", copy=False), dict(zip(names, planes, strict=True))

    def motion(self, frame: Frame) -> NDArray[np.float32]:
        """The motion that the methods follow: (height, width, 4), to_prev and to_next [px]."""
        if "motion" not in frame.has:
            raise InputError("no motion: pass to_next, to_prev, or depth and a camera")
        with self._working(frame.size):
            encoder = self.device.create_command_encoder(label="wgmb motion")
            frame = shortest(frame) if frame.wrap == "on" else frame
            motion = self._images.view("motion", frame.size, "rgba32float")
            views = self._residency.views_of({0: frame})[0]
            self.encode_motion(encoder, views, motion, frame.number)
            return self._images.download(encoder, motion.texture)

    def encode_motion(
        self, encoder: wgpu.GPUCommandEncoder, frame: FrameViews, output: View, number: int = 0
    ) -> None:
        """Record to_prev and to_next [px] into `output`, rgba32float."""
        output = view_of(output)
        frame.check_fit(self.device, output.size[:2])
        check_view("output", output, self.device, frame.size)
        check_output("output", output, "rgba32float")
        bindings = self.frame_bindings(frame.size, number, frame.window)
        self._prepared.encode_motion(encoder, bindings, frame, output)

    def upload(self, frame: Frame) -> dict[str, Any]:
        """Upload a frame and its neighbours; returns the keywords of `encode`.

        The textures are reused by the next frame. Those of a panorama are flat, as all textures.
        """
        with self._working(frame.size):
            return uploaded(frame, self.method, self._residency)

    @contextmanager
    def _working(self, size: tuple[int, int]):
        """Admit one thread at a time; convert wgpu errors, after which all is uploaded again."""
        with self._lock, gpu.reported(size):
            try:
                yield
            except BaseException:
                self._residency.forget()
                raise

    def _views(self, frame: Frame) -> dict[str, Any]:
        """The frame and the neighbours that the method takes, as keywords of `encode`."""
        return _keywords(frame, self.method, self._residency)

    def _require(self, available: Collection[str], whose: str = "") -> None:
        if missing := self.method.needs - set(available):
            if "scene" in missing:
                check_takes_frames(type(self.method))
            what = " and ".join(whose + name for name in sorted(missing))
            how = ": to_next, or depth and a camera" if {"motion"} == missing else ""
            raise InputError(f"method {self.method.name!r} needs {what}{how}")

    def frame_bindings(
        self, size: tuple[int, int], number: int = 0, window: Window | None = None
    ) -> gpu.FrameBindings:
        """Return the bindings shared by all passes: frame, shutter, times of the samples."""
        return self._constants.bindings(size, number, window)


def _tape_key(inputs: Inputs) -> tuple[object, list[View]]:
    """All that a method that `repeats` depends on: values, and views of textures.

    What a shutter is, its constants hold.
    """
    shutter = [inputs.bindings.resources[name].uid for name in ("shutter", "strata")]
    key: list[object] = [inputs.bindings.size, inputs.bindings.window, *shutter, inputs.steps]
    views: list[View] = []
    for frame in inputs.frames:
        textures = {name: one for name, one in vars(frame).items() if isinstance(one, View)}
        key.append((frame.offset, frame.by_camera, *textures))
        views += textures.values()
    return tuple(key), views


def uploaded(frame: Frame, method: Method, residency: Residency) -> dict[str, Any]:
    """Keywords of `encode` for a frame and its neighbours, which are uploaded anew.

    The textures are those of `residency`, and reused by the next frame.
    """
    residency.forget()
    inputs = _keywords(frame, method, residency)
    residency.forget()
    # These views may be encoded again, and all is to be done again.
    return {
        name: replace(value, key=None) if isinstance(value, FrameViews) else value
        for name, value in inputs.items()
    }


def _keywords(frame: Frame, method: Method, residency: Residency) -> dict[str, Any]:
    """The frame and the neighbours that a method takes, as keywords of `encode`."""
    names = {0: "frame", -1: "prev", 1: "next", -2: "prev_prev", 2: "next_next"}
    views = residency.views_of(frames_around(frame, method))
    return {"number": frame.number} | {names[offset]: one for offset, one in views.items()}
