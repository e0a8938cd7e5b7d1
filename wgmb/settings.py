"""User settings as plain values: one dataclass per group, convertible to library objects.

The command line, the viewer and the laboratory share them. The string under a field is its help.
"""

import math
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Literal, Self, TypeVar

from .display import ColorSpace, Display
from .errors import InputError, check_choice
from .io import limits, vectors
from .io.clip import Clip, Passes
from .io.frame_numbers import frame_numbers, is_pattern, readable
from .io.masks import is_file, with_amount
from .io.output import Output
from .io.settled import Settled
from .methods import METHODS, default_method
from .methods.options import Option, options_of
from .pipeline import Blur, checked
from .scene import builtin
from .scene.scene import Scene
from .shutter import CURVES, PHASES, Shutter, read_curve


@dataclass(frozen=True, kw_only=True)
class ShutterSettings:
    """Shutter angle, phase and curve."""

    shutter: float | None = None
    "Shutter angle in degrees; 360 is one frame interval, may be more. Default: 180 or the scene's."
    phase: str = "centre"
    "start (opens at the frame), centre, end (closes at it), or the time of its middle in frames."
    curve: str | None = None
    "box (default), trapezoid, triangle, cosine, gaussian, or a CSV file of time, weight."
    rolling: Literal["up", "down", "left", "right"] | None = None
    "Rolling shutter: direction in which the exposure moves across the image."
    rolling_duration: float = 1.0
    "Rolling shutter: delay from the first row or column to the last, in frame intervals."

    def resolved(self, scene: Scene | None = None, fps: float = 24.0) -> Self:
        """Return a copy with unset fields taken from the scene, or 180 degrees and a box."""
        degrees, curve = 180.0, "box"
        if scene is not None and scene.exposure is not None:
            seconds, curve = scene.exposure
            degrees = round(360 * seconds * fps, 9)
        return replace(
            self,
            shutter=degrees if self.shutter is None else self.shutter,
            curve=curve if self.curve is None else self.curve,
        )

    def curve_read(self) -> str | None:
        """Return the curve's name, and for a file its checksum, as its contents may change."""
        if self.curve is None or self.curve in CURVES:
            return self.curve
        return f"{self.curve} (CRC-32 {zlib.crc32(Path(self.curve).read_bytes()):08x})"

    def make(self) -> Shutter:
        """Return the Shutter these settings describe; call `resolved` first."""
        phase: str | float = self.phase
        if phase not in PHASES:
            try:
                phase = float(phase)
            except ValueError:
                check_choice("phase", phase, ("start", "centre", "end"), " or a number")
        curve = self.curve
        assert self.shutter is not None and curve is not None
        if curve not in CURVES:
            if not readable(Path(curve)):
                check_choice("curve", curve, CURVES, " or a CSV file")
            curve = read_curve(curve)
        return Shutter(self.shutter, phase, curve, self.rolling, self.rolling_duration)


@dataclass(frozen=True, kw_only=True)
class InputSettings:
    """Input frames, layers and conventions."""

    frames: str | None = None
    "Frame numbers, such as 1-100x2 or 1,3,5-8; by default all existing frames."
    layer: str | None = None
    "Colour layer, if it cannot be found by name."
    vectors: str = "auto"
    "Motion vector convention: auto (detected), none, or a name."
    vector_layer: str | None = None
    "Motion vector layer, if it cannot be found by name."
    vector_scale: float = 1.0
    "Factor applied to the motion vectors."
    vector_offset: float | None = None
    "Value that encodes zero motion, subtracted before scaling (vray, rsmb: 0.5)."
    vector_flip: Literal["x", "y", "xy"] | None = None
    "Reverses the motion vectors along an axis."
    vector_mask: str | None = None
    "Layer that is 1 where the vectors are valid, or none; default: MV_Alpha, or rsmb's alpha."
    object_motion: bool = False
    "The vectors hold object motion only; the camera's motion is added from --camera."
    camera: Path | None = None
    "JSON file with a camera per frame: gives motion from depth where vectors are missing."
    depth: str | None = None
    "Depth layer, if it cannot be found by name."
    depth_kind: Literal["planar", "inverse", "clip"] = "planar"
    "Depth convention: distance along the view axis, its inverse (Nuke), or z after projection."
    far: float = 1e9
    "Depth from which a pixel counts as empty (sky)."
    object_layer: str | None = None
    "Object index layer that identifies the objects of the camera file."
    also: tuple[str, ...] = ()
    "Pattern of files with additional layers of the same frames; may be repeated."
    outside: Literal["auto", "nothing", "edge"] = "auto"
    "Beyond a data window that ends within the image: nothing, or edge (unknown: its edge goes on)."
    cuts: str | None = None
    "Frames that begin a shot: 101,155, cut.edl[@FPS] or cut.otio; only:101,155 detects no others."
    view: str | None = None
    "The only view of stereo frames to use, such as left; by default all are blurred."
    skip_missing: bool = False
    "Skip missing frames instead of stopping with an error."
    max_mb: float = limits.MAX_MB
    "Largest allowed decoded size of an image file in megabytes (as 32-bit floats)."

    def open(
        self,
        pattern: str,
        holdout: tuple[str, ...] = (),
        scale: tuple[str, ...] = (),
        space: ColorSpace | None = None,
        settled: Settled | None = None,
    ) -> Clip:
        """Return the Clip these settings describe; `space` of its pictures (ColorSettings.space).

        `settled`: what was found out about the sequence before (Clip.settle). InputError if a file
        is not readable, or a mask names what no Cryptomatte has.
        """
        files = [name for name in (*holdout, *(with_amount(s)[0] for s in scale)) if is_file(name)]
        for name in (*files, *self.also):
            if Path(name).suffix and not is_pattern(name):
                readable(Path(name))
        passes = Passes(
            color=self.layer,
            vectors=vectors.Vectors(
                self.vectors,
                self.vector_layer,
                self.vector_scale,
                self.vector_offset,
                self.vector_flip or "",
                self.vector_mask,
            ),
            depth=self.depth,
            depth_kind=self.depth_kind,
            far=self.far,
            camera=self.camera,
            object_layer=self.object_layer,
            object_motion=self.object_motion,
            holdout=holdout,
            scale=scale,
            also=self.also,
            outside=self.outside,
        )
        clip = Clip(
            pattern,
            frames=self.frames,
            passes=passes,
            skip_missing=self.skip_missing,
            cuts=self.cuts,
            view=self.view,
            space=space,
            max_mb=self.max_mb,
            settled=settled,
        )
        clip.check_names()
        return clip


def _method_options() -> dict[str, tuple[object, object, str]]:
    """Type, default and help of every option that a method has, by name."""
    merged: dict[str, list[tuple[str, Option]]] = {}
    for method in METHODS.values():
        for name, option in options_of(method.Options).items():
            merged.setdefault(name, []).append((method.name, option))
    return {name: _merged(options) for name, options in merged.items()}


def _merged(options: list[tuple[str, Option]]) -> tuple[object, object, str]:
    """Return one option for all methods that share its name, with the union of their choices."""
    kind: object = options[0][1].kind
    if choices := dict.fromkeys(choice for _, option in options for choice in option.choices):
        kind = Literal[tuple(choices)]
    help_ = "; ".join(f"{method}: {option.help}" for method, option in options)
    return (bool, False, help_) if kind is bool else (kind | None, None, help_)  # pyright: ignore


METHOD_OPTIONS = _method_options()
"""(type, default, help) of the options that only some methods have, by name."""


_Class = TypeVar("_Class", bound=type)


def _with_method_options(settings: _Class) -> _Class:
    """Add METHOD_OPTIONS to the fields of a class that is to be a dataclass."""
    for name, (kind, default, _) in METHOD_OPTIONS.items():
        settings.__annotations__[name] = kind
        setattr(settings, name, default)
    return settings


@dataclass(frozen=True, kw_only=True)
@_with_method_options
class BlurSettings:
    """Blur method and options; the fields of METHOD_OPTIONS are added."""

    method: str | None = None
    "Blur method; by default gather if there is depth or motion is searched, else tap."
    samples: int | Literal["auto"] | None = None
    """Taps, images or rays per pixel: 16 (fusion: 8), or auto for motion from pictures;
    auto: 1 per pixel of blur length, at most 64.
    """
    jitter: float = 0.0
    "Jitter of the sample times, 0 to 1: trades banding for noise."
    holdout: tuple[str, ...] = ()
    "Pixels to keep sharp: LAYER (grey), LAYER=VALUE (object index, Cryptomatte) or an image file."
    scale: tuple[str, ...] = ()
    "Motion scale: a LAYER or image file that multiplies it, or LAYER=VALUE:AMOUNT for an object."
    max_blur: float | None = None
    "Maximum blur length in pixels."

    def resolved(self, scene: Scene | None = None, clip: Clip | None = None) -> Self:
        """Return a copy; an unset method is chosen by the scene or the passes in the files."""
        suited = "gather" if clip is None else default_method(clip.has)
        if scene is not None and scene.has_volumes:
            suited = "volume"
        return replace(self, method=self.method or suited)

    def for_pictures(self) -> Self:
        """Return a copy for motion found in pictures, after `resolved`: unset samples are auto."""
        adaptive = self.method in METHODS and getattr(METHODS[self.method], "adaptive", False)
        return replace(self, samples="auto") if adaptive and self.samples is None else self

    def make(self, shutter_: Shutter, adapter: str | None) -> Blur:
        """Return the Blur these settings describe; an option of another method is an error."""
        return Blur(
            self.method or default_method({"motion", "depth"}),
            shutter=shutter_,
            samples=self.samples,
            jitter=self.jitter,
            max_blur=self.max_blur,
            device=adapter,
            **self._method_options(),
        )

    def _method_options(self) -> dict:
        """The method's own options that are set."""
        own = {name: getattr(self, name) for name in METHOD_OPTIONS}
        return {k: v for k, v in own.items() if v is not None and v is not False}

    def settled_samples(self) -> int | str:
        """The samples of the Blur, for a record: a number, or "auto".

        InputError as from `make`, but for what depends on the device; none is opened.
        """
        method, options = self.method or "", self._method_options()
        samples, auto = checked(method, self.samples, self.jitter, self.max_blur, options=options)
        METHODS[method].Options(**options)
        return "auto" if auto else samples


@dataclass(frozen=True, kw_only=True)
class SceneSettings:
    """Times, image size, parameters and camera of a scene."""

    time: float | None = None
    "Time of a single image in seconds, without --frames."
    frames: str | None = None
    "Frames such as 0-99; frame N is at N / fps seconds."
    size: str = "640x360"
    "Width x height in pixels."
    antialias: int = 3
    "Antialiasing of the sharp frames that image methods start from: rays per pixel side, 1 to 8."
    set: tuple[str, ...] = ()
    "Scene parameter as NAME=VALUE; may be repeated."
    orbit: tuple[float, float] = (0.0, 0.0)
    "Orbits the camera around its pivot: degrees to the right, and up."
    pan: tuple[float, float] = (0.0, 0.0)
    "Then moves the camera to the right, and up [scene units]."
    dolly: float = 1.0
    "Scales the camera's distance to the pivot."

    def make(self, name: str) -> Scene:
        """The scene `name` with these parameters and this camera."""
        scene = builtin.make(name, **self.parameters())
        if (self.orbit, self.pan, self.dolly) == ((0.0, 0.0), (0.0, 0.0), 1.0):
            return scene
        aside, up = map(math.radians, self.orbit)
        return scene.seen_from((aside, up), self.pan, self.dolly)

    def parameters(self) -> dict[str, str]:
        """The scene's parameters by name."""
        return parameters_of(self.set)

    def moments(self, fps: float) -> dict[int, float]:
        """Times in seconds by frame number."""
        if self.frames is None:
            return {0: self.time or 0.0}
        return {n: n / fps for n in frame_numbers(self.frames)}


def size_of(text: str) -> tuple[int, int]:
    """`1920x1080` -> width, height."""
    sides = re.fullmatch(r"0*([1-9][0-9]{0,8})x0*([1-9][0-9]{0,8})", text)
    if sides is None:
        raise InputError(f"size must be like 1920x1080, got {text!r}")
    return int(sides[1]), int(sides[2])


def parameters_of(texts: tuple[str, ...]) -> dict[str, str]:
    """`NAME=VALUE` each -> values by name."""
    pairs = [text.partition("=") for text in texts]
    if wrong := [name for name, equals, _ in pairs if not equals]:
        raise InputError(f"`set` takes NAME=VALUE, got {wrong[0]!r}")
    return {name: value for name, _, value in pairs}


@dataclass(frozen=True, kw_only=True)
class OutputSettings:
    """Output files."""

    output: str
    "Pattern or file: .exr .png .jpg .tif, or a video .mp4 .mov .mkv .webm .gif."
    bits: int = 8
    "Bits per sample of PNG and TIFF: 8 or 16."
    fps: str | None = None
    "Frames per second, such as 60 or 30000/1001; default: 24, or the rate of an input video."
    overwrite: bool = False
    "Replace existing files."
    resume: bool = False
    "Keep finished frames; render those again whose settings or inputs have changed."
    layers: Literal["all", "picture"] = "all"
    "EXR to EXR: copy all layers of the input, or write the picture only (faster)."
    compression: str = "zip"
    "EXR: none, rle, zips, zip, piz; lossy: pxr24, b44, b44a, dwaa, dwab; or same (as the input)."
    window: Literal["grow", "keep"] = "grow"
    "EXR: the data window grows with the streaks, or keeps the input's size."

    @property
    def is_exr(self) -> bool:
        """True if the output keeps linear light, instead of showing it to people."""
        return self.output.lower().endswith(".exr")

    @property
    def looks(self) -> dict:
        """Return the settings that change the contents of the files."""
        shown = ("bits", "layers", "compression", "window")
        return {name: getattr(self, name) for name in shown}

    def make(
        self,
        settings: dict,
        numbers: list[int],
        inputs: Iterable[Path] = (),
        views: Sequence[str] = (),
        display: Display | None = None,
        since: int | None = None,
    ) -> Output:
        """The Output for frames of these `numbers`; see there for the others."""
        return Output(
            self.output,
            settings=settings,
            numbers=numbers,
            bits=self.bits,
            fps=self.rate,
            inputs=inputs,
            overwrite=self.overwrite,
            resume=self.resume,
            layers=self.layers,
            compression=self.compression,
            views=views,
            display=display,
            window=self.window,
            since=since,
        )

    @property
    def rate(self) -> Fraction:
        """Frames per second, exactly."""
        return self.rate_or(Fraction(24))

    def rate_or(self, rate: Fraction) -> Fraction:
        """Frames per second, exactly; `rate` unless another is set."""
        return rate if self.fps is None else rate_of(self.fps)


def rate_of(text: str, name: str = "fps") -> Fraction:
    """`24`, `23.976`, `30000/1001` -> frames per second, exactly; 0.001 to 1000.

    `name`: of the setting, for messages.
    """
    try:
        if re.search(r"e[+-]?[\d_]{4}", text, re.IGNORECASE):  # would be worked out in full
            raise ValueError
        fps = Fraction(text)
    except (ValueError, ZeroDivisionError):
        raise InputError(f"{name} must be a number or a fraction, got {text!r}") from None
    if not Fraction(1, 1000) <= fps <= 1000:
        raise InputError(f"{name} must be 0.001 to 1000, got {text}")
    return fps


def plain(options) -> dict:
    """The options by name, as JSON can hold them."""
    return {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items()}
