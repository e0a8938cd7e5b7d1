"""The whole flow in one place: arrays -> textures -> velocity -> one method -> array."""

from __future__ import annotations

import inspect
import weakref
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import wgpu

from . import gpu, shader
from .blur import METHODS
from .cameras import Reprojections
from .errors import InputError
from .frame import PASSES, Frame
from .gbuffer import SceneOnGpu
from .images import Images
from .keep import HoldoutPass
from .shutter import Shutter
from .timing import Clock
from .velocity import Moving, VelocityPass

MOST_SAMPLES = 4096  # lavapipe ends every loop after 65,535 turns an invocation, silently
SAMPLES = 16
AUTO_SAMPLES = 64  # the most that "auto" takes a pixel
AUTO_STRATA = 256  # equal shares of the exposure that times are interpolated in
OUTPUTS = ("rgba32float", "rgba16float")
_PLACES = ("", " 1", " 2")  # frames that are on the GPU, by the end of their textures' names
View = wgpu.GPUTextureView


@dataclass(frozen=True)
class Neighbour:
    """The frame before or after, or the frame itself, as far as a method needs it."""

    offset: int  # -1, 1; 0 is the frame itself [frame intervals]
    color: View  # premultiplied by alpha and by weight
    motion: View
    depth: View | None  # neighbours have one
    normal: View | None
    weight: View | None  # there if the frame itself has one
    token: object | None  # the same as before: the same pixels


@dataclass(frozen=True)
class Inputs:
    """What a method may read while it records one frame."""

    given: gpu.Given
    samples: int
    number: int
    jitter: float
    shutter: Shutter
    color: View  # linear, premultiplied by alpha and by weight
    motion: View  # to_prev, to_next [px]
    depth: View | None
    camera: Reprojections | None
    by_camera: bool  # the motion is the camera's alone: there are no vectors
    normal: View | None  # unit vectors in the world
    weight: View | None  # None: every pixel counts
    neighbours: tuple[Neighbour, ...]
    token: object | None  # of the frame itself, see Neighbour
    none: View  # bound where an input is not there
    linear: wgpu.GPUSampler
    even: bool  # the shutter is a box
    auto: bool  # `samples` is the most a pixel may take
    scene: SceneOnGpu | None
    progress: tuple[int, int]  # samples done before, samples to do now

    @property
    def frames(self) -> tuple[Neighbour, ...]:
        """The frame itself, as the neighbour 0 intervals away; then the others."""
        own = self.color, self.motion, self.depth, self.normal, self.weight, self.token
        return Neighbour(0, *own), *self.neighbours


class _Held:
    """A frame that was uploaded, and the inputs of `encode` that it became."""

    def __init__(self, frame: Frame, inputs: dict):
        self.inputs = inputs
        self._arrays = {name: weakref.ref(array) for name, array in frame.arrays.items()}
        self._rest = frame.camera, frame.object_motion

    def is_of(self, frame: Frame) -> bool:
        """Whether these are the arrays of `frame`, and cannot have changed."""
        given = frame.arrays
        return (
            frame.is_locked
            and given.keys() == self._arrays.keys()
            and all(self._arrays[name]() is array for name, array in given.items())
            and frame.camera is self._rest[0]
            and frame.object_motion == self._rest[1]
        )


class Blur:
    """A compiled method. Call it with arrays, or `encode` it into your own frame.

    `method`: a name in METHODS; its own options follow as keywords.
    `shutter`: degrees (180 is open for half a frame interval), or a Shutter.
    `samples`: taps a pixel, 1 to 4096 (gather without a GPU: 512); 16, or what the method's
    source says, by default; "auto" takes one a pixel of a streak, 64 at most (methods that
    cannot tell pixels apart take 64).
    `jitter`: 0 to 1, trades bands for noise: how far a tap may move within its share of time.
    `max_blur`: longest streak [px]; None leaves it free.
    `device`: a wgpu device of yours, the name of an adapter, or None for the best.
    `output`: texel format of the result, rgba32float or rgba16float.
    """

    def __init__(
        self,
        method: str = "tap",
        *,
        shutter: Shutter | float = 180,
        samples: int | str | None = None,
        jitter: float = 0.0,
        max_blur: float | None = None,
        device: wgpu.GPUDevice | str | None = None,
        output: str = "rgba32float",
        **options,
    ):
        if method not in METHODS:
            raise InputError(f"unknown method {method!r}, one of {', '.join(METHODS)}")
        self.auto = samples == "auto" and getattr(METHODS[method], "adaptive", False)
        if samples is None:
            samples = getattr(METHODS[method], "samples", SAMPLES)
        samples = AUTO_SAMPLES if samples == "auto" else samples
        if not isinstance(samples, (int, np.integer)) or not 1 <= samples <= MOST_SAMPLES:
            raise InputError(f"samples must be 1 to {MOST_SAMPLES} or auto, got {samples!r}")
        if not 0 <= jitter <= 1:
            raise InputError(f"jitter must be 0 to 1, got {jitter}")
        if max_blur is not None and not max_blur >= 0:
            raise InputError(f"max_blur must be 0 or more pixels, got {max_blur}")
        if output not in OUTPUTS:
            raise InputError(f"output must be one of {', '.join(OUTPUTS)}, got {output!r}")
        known = set(inspect.signature(METHODS[method]).parameters) - {"device", "output"}
        if unknown := options.keys() - known:
            raise InputError(
                f"method {method!r} has no option {', '.join(sorted(unknown))}; "
                f"it has {', '.join(sorted(known)) or 'none'}"
            )
        self.device = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
        if samples > (most := most_samples(method, self.device)):
            raise InputError(f"{method} takes 1 to {most} samples without a GPU, got {samples}")
        self.method = METHODS[method](self.device, output=output, **options)
        self._options = options
        self.samples, self.jitter, self.max_blur, self.output = samples, jitter, max_blur, output
        self._images = Images(self.device)
        self._held: dict[str, _Held] = {}
        self._linear = self.device.create_sampler(mag_filter="linear", min_filter="linear")
        self._none = self._images.view("none", (1, 1), gpu.texel(self.device, 4))
        no_object = self._images.view("no object", (1, 1), "r32uint")
        self._velocity = VelocityPass(self.device, self._none, no_object)
        self._keep = HoldoutPass(self.device, self._images, self._none)
        self.shutter = shutter

    @property
    def confidence(self) -> tuple[str, ...]:
        """What `with_confidence` tells of every pixel; InputError where a method cannot tell."""
        if names := getattr(self.method, "confidence", ()):
            return names
        able = ", ".join(n for n, m in METHODS.items() if hasattr(m, "confidence"))
        raise InputError(f"method {self.method.name!r} has no confidence; {able} has")

    @cached_property
    def _judge(self):
        """The method once more, telling how sure it is."""
        options = self._options | {"show": "confidence"}
        return METHODS[self.method.name](self.device, output=self.output, **options)

    @property
    def shutter(self) -> Shutter:
        """When the shutter is open; may be set between frames, to degrees or a Shutter."""
        return self._shutter

    @shutter.setter
    def shutter(self, shutter: Shutter | float) -> None:
        if not isinstance(shutter, Shutter):
            try:
                degrees = float(shutter)
            except (TypeError, ValueError):
                wanted = "degrees or a Shutter"
                raise InputError(f"shutter must be {wanted}, got {shutter!r}") from None
            shutter = Shutter(degrees)
        self._shutter = shutter
        data = np.zeros((), shader.load("common/shutter.wgsl").dtype("Shutter"))
        opens, closes = self._shutter.span
        data["span"] = opens, closes
        data["step"] = (closes - opens) / self.samples
        data["rolling"] = self._shutter.delay
        create = self.device.create_buffer_with_data
        self._group0 = {
            "shutter": create(label="shutter", data=data, usage=wgpu.BufferUsage.UNIFORM),
            "strata": create(
                label="strata",
                data=self._shutter.strata(AUTO_STRATA if self.auto else self.samples),
                usage=wgpu.BufferUsage.STORAGE,
            ),
        }

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        *,
        size: tuple[int, int],
        output: View,
        color: View | None = None,
        scene: SceneOnGpu | None = None,
        progress: tuple[int, int] | None = None,
        neighbours: dict[int, dict] | None = None,
        keep: View | None = None,
        normal: View | None = None,
        confidence: View | None = None,
        check: bool = False,
        token: object | None = None,
        number: int = 0,
        timing: Clock | None = None,
        **moving,
    ) -> None:
        """Record the passes into `encoder`; nothing is submitted or waited for.

        Views are of your textures: `color` filterable float (rgba16float always is), `keep`
        0..1, `normal` unit vectors in the world, `output` a storage texture of the format that
        Blur was made for, `confidence` another one for what `with_confidence` tells. `moving` are
        the inputs of velocity.Moving: `to_next` and `to_prev` with the displacement [px] in
        x and y, or `motion` with to_prev and to_next together, which saves a pass; or
        `camera` and `depth`. `check` gives pixels that are not finite no weight, at the
        price of three small passes.

        `neighbours`: -1 and 1, each with `color`, its own `moving` inputs and depth, and
        `keep`, `normal`, `check` and `token` as above, for methods that use them.

        `token`: any object that stands for what is in the views of one frame. While the same
        one is given again, as the frame's or a neighbour's, what a method made of these views
        alone is not made again; the commands that made it must have been submitted.

        `scene` instead of `color`, for the methods that need one, which may be recorded
        bit by bit: `progress` is how many samples were done before, and are to be done now.

        `timing` takes the time of every pass: `timing.clock(device)`, whose WallClock runs the
        passes at once instead of recording them.
        """
        gpu.check_size(self.device, *size)
        motions = _moving(moving)
        views = {"output": output, "color": color, "keep": keep, "normal": normal}
        views["confidence"] = confidence
        _check_views(size, views | moving)
        given_inputs = {"color": color, "motion": motions.known or None, "depth": motions.depth}
        given_inputs["scene"] = scene
        self._require({name for name, input_ in given_inputs.items() if input_ is not None})
        given = self.given(size, number)
        encoder = timing.watch(encoder) if timing else encoder
        motion, limited = motions.motion, self.max_blur is not None
        if motions.known and (not motions.ready or limited or check):
            motion = self._images.view("motion", size, "rgba32float")
            self._velocity.encode(encoder, given, motions, limited, motion)
        around = (neighbours or {}) if "neighbours" in self.method.uses else {}
        if wrong := around.keys() - {-1, 1}:
            raise InputError(f"neighbours must be frames -1 and 1, got {min(wrong)}")
        masked = keep is not None or check
        masked |= any(n.get("keep") is not None or n.get("check") for n in around.values())
        near = tuple(
            self._neighbour(encoder, given, offset, dict(inputs), masked)
            for offset, inputs in sorted(around.items())
        )
        weight, result, own = None, output, color
        if color is not None and masked:
            color, weight = self._keep.before(encoder, given, color, keep)
            result = self._images.view("blurred", size, self.output)
        inputs = Inputs(
            given=given,
            samples=self.samples,
            number=number,
            jitter=self.jitter,
            shutter=self._shutter,
            color=color or self._none,
            motion=motion or self._none,
            depth=motions.depth,
            camera=motions.camera,
            by_camera=motions.camera is not None and not motions.has_vectors,
            normal=normal,
            weight=weight,
            neighbours=near,
            token=token,
            none=self._none,
            linear=self._linear,
            even=self._shutter.curve == "box",
            auto=self.auto,
            scene=scene,
            progress=progress or (0, self.samples),
        )
        self.method.encode(encoder, inputs, result)
        if confidence is not None and self.confidence:
            self._judge.encode(encoder, inputs, confidence)
        if weight and own:
            self._keep.after(encoder, given, own, keep, result, output, self.output)

    def __call__(self, color: np.ndarray | Frame, to_next=None, **passes) -> np.ndarray:
        """Blur one frame: a Frame, or a colour array and its passes (see Frame).

        Returns float32 of color's shape. `InputError` says what is missing or does not fit.
        Frames whose arrays cannot be written to (Frame.locked) are uploaded once, even if they
        come again as neighbours.
        """
        frame = color if isinstance(color, Frame) else Frame(color, to_next, **passes)
        self._require(frame.has)
        output = self._images.texture("output", frame.size, self.output)
        encoder = self.device.create_command_encoder(label="wgmb")
        with self._forgetting():
            self.encode(encoder, output=output.create_view(), **self._upload(frame))
            picture = self._images.download(encoder, output)
        return picture[..., : frame.color.shape[2]].astype("f4", copy=False)

    def with_confidence(self, frame: Frame) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """The blurred frame, and how sure the method is of every pixel, at twice the cost.

        The second by the names in `confidence`, each (height, width) float32; what they mean
        is said where the method says what it can `show`.
        """
        names = self.confidence
        self._require(frame.has)
        size, channels = frame.size, frame.color.shape[2]
        output = self._images.texture("output", size, self.output)
        sure = self._images.texture("confidence", size, self.output)
        encoder = self.device.create_command_encoder(label="wgmb")
        views = {"output": output.create_view(), "confidence": sure.create_view()}
        with self._forgetting():
            self.encode(encoder, **views, **self._upload(frame))
            picture = self._images.download(encoder, output)[..., :channels]
        told = self._images.download(self.device.create_command_encoder(), sure)
        planes = np.moveaxis(told.astype("f4", copy=False), 2, 0)
        return picture.astype("f4", copy=False), dict(zip(names, planes, strict=True))

    def motion(self, frame: Frame) -> np.ndarray:
        """What the methods are given to follow: (height, width, 4) to_prev, to_next [px]."""
        if "motion" not in frame.has:
            raise InputError("there is no motion: give to_next, to_prev, or depth and a camera")
        encoder = self.device.create_command_encoder(label="wgmb motion")
        motion = self._images.texture("motion", frame.size, "rgba32float")
        self._held.clear()
        moving = self._upload_moving(frame)
        self.encode_motion(encoder, frame.size, motion.create_view(), frame.number, **moving)
        return self._images.download(encoder, motion)

    def encode_motion(
        self,
        encoder: wgpu.GPUCommandEncoder,
        size: tuple[int, int],
        output: View,
        number: int = 0,
        **moving,
    ) -> None:
        """Record to_prev and to_next [px] into `output`, rgba32float; `moving` as in `encode`."""
        given = self.given(size, number)
        limited = self.max_blur is not None
        self._velocity.encode(encoder, given, _moving(moving), limited, output)

    def upload(self, frame: Frame) -> dict:
        """The frame's arrays as textures, under the names that `encode` takes.

        They are kept: the next frame's go into the same textures.
        """
        self._held.clear()
        inputs = self._upload(frame)
        for one in (inputs, *inputs["neighbours"].values()):
            one["token"] = None  # these views may be encoded again, and all is to be done again
        self._held.clear()
        return inputs

    @contextmanager
    def _forgetting(self):
        """What was uploaded is uploaded again, if what was recorded may not have been done."""
        try:
            yield
        except BaseException:
            self._held.clear()
            raise

    def _upload(self, frame: Frame) -> dict:
        """What `encode` takes, with tokens; only frames that are not there yet are uploaded."""
        around = {0: frame}
        if "neighbours" in self.method.uses:
            near = {-1: frame.prev, 1: frame.next}
            needs = self.method.needs
            around |= {o: f for o, f in near.items() if f is not None and f.has >= needs}
        wanted = [self._place_of(one) for one in around.values()]
        free = [place for place in _PLACES if place not in wanted]
        inputs = {}
        for offset, one in around.items():
            place = self._place_of(one)
            if place is None:
                place = free.pop(0)
                self._held.pop(place, None)
                inputs[offset] = self._upload_one(one, place)
                if one.is_locked:
                    self._held[place] = _Held(one, inputs[offset] | {"token": object()})
            if place in self._held:
                inputs[offset] = self._held[place].inputs
        own = inputs.pop(0)
        return {"size": frame.size, "number": frame.number, "neighbours": inputs, **own}

    def _place_of(self, frame: Frame) -> str | None:
        """Where a frame has been uploaded to."""
        return next((place for place, held in self._held.items() if held.is_of(frame)), None)

    def _upload_one(self, frame: Frame, which: str = "") -> dict:
        """What there is of one frame, the frame itself or a neighbour."""
        rgba, four = self._rgba(frame)
        return {
            "color": self._images.upload("color" + which, rgba, four),
            "keep": self._view("keep" + which, frame.keep, "r32float"),
            "normal": self._normal(frame, which),
            "check": bool(frame.bad.keys() - {"depth"}),
            **self._upload_moving(frame, which),
        }

    def _rgba(self, frame: Frame) -> tuple[np.ndarray, str]:
        """The colour with alpha, and the texture format for it."""
        rgba = frame.color
        if rgba.shape[2] == 3:
            rgba = np.ones((*rgba.shape[:2], 4), rgba.dtype)
            rgba[..., :3] = frame.color
        return rgba, "rgba16float" if rgba.dtype == np.float16 else gpu.texel(self.device, 4)

    def _upload_moving(self, frame: Frame, which: str = "") -> dict:
        deep = frame.camera is not None or "depth" in self.method.needs | self.method.uses
        return {
            "to_next": self._view("to_next" + which, frame.to_next, "rg32float"),
            "to_prev": self._view("to_prev" + which, frame.to_prev, "rg32float"),
            "motion": self._view("to_prev, to_next" + which, frame.motion, "rgba32float"),
            "depth": self._view("depth" + which, frame.depth if deep else None, "r32float"),
            "camera": frame.camera,
            "object_id": self._view("object" + which, frame.object_id, "r32uint"),
            "scale": self._view("scale" + which, frame.scale, "r32float"),
            "object_motion": frame.object_motion,
        }

    def _view(self, name: str, array: np.ndarray | None, format: str) -> View | None:
        return None if array is None else self._images.upload(name, array, format)

    def _normal(self, frame: Frame, which: str = "") -> View | None:
        if frame.normal is None or "normal" not in self.method.uses:
            return None
        four = np.zeros((*frame.normal.shape[:2], 4), np.float32)
        four[..., :3] = frame.normal
        return self._images.upload("normal" + which, four, "rgba32float")

    def _neighbour(self, encoder, given, offset: int, inputs: dict, masked: bool) -> Neighbour:
        color, normal = inputs.pop("color"), inputs.pop("normal", None)
        keep, check = inputs.pop("keep", None), inputs.pop("check", False)
        token = inputs.pop("token", None)
        _check_views(given.size, {"color": color, "normal": normal, "keep": keep, **inputs})
        moving = _moving(inputs)
        motion, limited = moving.motion, self.max_blur is not None
        if not moving.known or moving.depth is None:
            raise InputError("a neighbouring frame needs color, motion and depth")
        if motion is None or not moving.ready or limited or check:
            motion = self._images.view(f"motion {offset}", given.size, "rgba32float")
            self._velocity.encode(encoder, given, moving, limited, motion)
        weight = None
        if masked:
            color, weight = self._keep.before(encoder, given, color, keep, f" {offset}")
        return Neighbour(offset, color, motion, moving.depth, normal, weight, token)

    def _require(self, there) -> None:
        if missing := self.method.needs - there:
            raise InputError(f"method {self.method.name!r} needs {', '.join(sorted(missing))}")

    def given(self, size: tuple[int, int], number: int = 0) -> gpu.Given:
        """What every pass of a frame is given: frame, shutter, times of the samples."""
        data = np.zeros((), shader.load("common/frame.wgsl").dtype("Frame"))
        data["size"], data["samples"], data["jitter"] = size, self.samples, self.jitter
        data["index"] = number % 2**32
        data["max_blur"] = np.inf if self.max_blur is None else self.max_blur
        frame = self.device.create_buffer_with_data(
            label="frame", data=data, usage=wgpu.BufferUsage.UNIFORM
        )
        return gpu.Given(size, {"frame": frame, **self._group0})


def most_samples(method: str, device: wgpu.GPUDevice) -> int:
    """The most samples that a pixel may take on the device."""
    if device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        return MOST_SAMPLES
    return getattr(METHODS[method], "most_in_software", MOST_SAMPLES)


def _moving(given: dict) -> Moving:
    known = {f.name for f in fields(Moving)}
    if unknown := given.keys() - known:
        raise InputError(
            f"encode has no input {', '.join(sorted(unknown))}; it has {', '.join(sorted(known))}"
        )
    moving = Moving(**given)
    if moving.camera is not None and moving.depth is None:
        raise InputError("motion from a camera needs depth")
    if moving.motion is not None and not (moving.to_next is None and moving.to_prev is None):
        raise InputError("motion stands instead of to_next and to_prev: give one or the other")
    return moving


def _check_views(size: tuple[int, int], views: dict) -> None:
    for name, view in views.items():
        if isinstance(view, View) and view.size[:2] != tuple(size):
            width, height = view.size[:2]
            raise InputError(f"{name} is {width} x {height}, the image {size[0]} x {size[1]}")


def blur(
    color: np.ndarray,
    to_next: np.ndarray | None = None,
    *,
    method: str = "tap",
    shutter: Shutter | float = 180,
    samples: int | str | None = None,
    **more,
) -> np.ndarray:
    """Blur one frame: linear colour in, linear colour out, motion in pixels per frame.

    `more` are the passes of Frame (to_prev, depth, camera, keep, ...) and the options of
    Blur (jitter, max_blur, device, and those of the method).
    """
    passes = {name: more.pop(name) for name in PASSES if name in more}
    return Blur(method, shutter=shutter, samples=samples, **more)(color, to_next, **passes)
