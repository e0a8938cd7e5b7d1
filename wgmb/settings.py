"""What a user can set, as plain values: one dataclass a group, each made into the library's words.

The command line, the viewer and the laboratory share them. The string under a field is its help.
"""

import math
import re
import zlib
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Literal, Self, TypeVar

from .errors import InputError
from .io import limits, vectors
from .io.clip import Clip, Passes
from .io.frame_numbers import frame_numbers, is_pattern, readable
from .methods import METHODS, default_method
from .methods.options import Option, options_of
from .pipeline import Blur
from .scene import builtin
from .scene.scene import Scene
from .shutter import CURVES, PHASES, Shutter, read_curve


@dataclass(frozen=True, kw_only=True)
class ShutterSettings:
    """When the shutter is open."""

    shutter: float | None = None
    "Degrees it is open: 360 is one frame interval, more is allowed. 180, or what a scene asks for."
    phase: str = "centre"
    "start (opens at the frame), centre, end (closes at it), or the middle's time in frames."
    curve: str | None = None
    "box (default), trapezoid, triangle, cosine, gaussian, or a CSV file of time, weight."
    rolling: Literal["up", "down", "left", "right"] | None = None
    "Rolling shutter: the way the exposure runs over the picture."
    rolling_duration: float = 1.0
    "Time from the first row or column to the last, in frame intervals."

    def resolved(self, scene: Scene | None = None, fps: float = 24.0) -> Self:
        """What was left open taken from the scene, or 180 degrees and a box."""
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
        """The curve's name; of a file also its checksum, as a file may change."""
        if self.curve is None or self.curve in CURVES:
            return self.curve
        return f"{self.curve} (CRC-32 {zlib.crc32(Path(self.curve).read_bytes()):08x})"

    def make(self) -> Shutter:
        """The Shutter these options describe, once they are settled."""
        phase: str | float = self.phase
        if phase not in PHASES:
            try:
                phase = float(phase)
            except ValueError:
                raise InputError(
                    f"phase must be start, centre, end or a number, got {phase!r}"
                ) from None
        curve = self.curve
        assert self.shutter is not None and curve is not None
        if curve not in CURVES:
            if not readable(Path(curve)):
                known = ", ".join(CURVES)
                raise InputError(f"curve must be one of {known}, or a CSV file; got {curve!r}")
            curve = read_curve(curve)
        return Shutter(self.shutter, phase, curve, self.rolling, self.rolling_duration)


@dataclass(frozen=True, kw_only=True)
class InputSettings:
    """Which frames and layers, and what they mean."""

    frames: str | None = None
    "Frames of the pattern, such as 1-100x2 or 1,3,5-8; all that exist by default."
    layer: str | None = None
    "The picture's layer, where its name does not say so."
    vectors: str = "auto"
    "What the motion vectors mean: auto, none, or a convention."
    vector_layer: str | None = None
    "The vectors' layer, where its name does not say so."
    vector_scale: float = 1.0
    "Multiplies the vectors."
    vector_offset: float | None = None
    "What stands for no motion, taken away first (vray, rsmb: 0.5)."
    vector_flip: Literal["x", "y", "xy"] | None = None
    "Turns the vectors round along an axis."
    object_motion: bool = False
    "The vectors leave the camera's motion out: add it from --camera."
    camera: Path | None = None
    "JSON with a camera for every frame: motion from depth where there are no vectors."
    depth: str | None = None
    "The depth layer, where its name does not say so."
    depth_kind: Literal["planar", "inverse", "clip"] = "planar"
    "Distance along the view axis, 1 / that (Nuke), or z after projection."
    far: float = 1e9
    "Depth from which on nothing is there (sky)."
    object_layer: str | None = None
    "Index layer that tells the camera file's objects apart."
    also: tuple[str, ...] = ()
    "Pattern of files with further layers of the same frames; may be repeated."
    skip_missing: bool = False
    "Leave out frames that are not there instead of refusing."
    max_mb: float = limits.MAX_MB
    "Megabytes that a picture file may unpack to (as 32-bit floats); a larger one is refused."

    def open(self, pattern: str, holdout: str | None = None, scale: str | None = None) -> Clip:
        """The clip these options describe; InputError where one of its files must not be read."""
        for name in (holdout, scale, *self.also):
            if name and Path(name).suffix and not is_pattern(name):
                readable(Path(name))
        passes = Passes(
            color=self.layer,
            vectors=vectors.Vectors(
                self.vectors,
                self.vector_layer,
                self.vector_scale,
                self.vector_offset,
                self.vector_flip or "",
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
        )
        return Clip(
            pattern,
            frames=self.frames,
            passes=passes,
            skip_missing=self.skip_missing,
            max_mb=self.max_mb,
        )


def _method_options() -> dict[str, tuple[object, object, str]]:
    """Type, default and help of every option that a method has, by name."""
    merged: dict[str, list[tuple[str, Option]]] = {}
    for method in METHODS.values():
        for name, option in options_of(method.Options).items():
            merged.setdefault(name, []).append((method.name, option))
    return {name: _merged(options) for name, options in merged.items()}


def _merged(options: list[tuple[str, Option]]) -> tuple[object, object, str]:
    """One option for all methods that have one of this name: any of their choices."""
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
    """How to blur; beside these, METHOD_OPTIONS."""

    method: str | None = None
    "How; gather where there is depth, else tap, if it is not given."
    samples: int | Literal["auto"] | None = None
    "Taps, pictures or rays a pixel: 16, for fusion 8; auto: one a pixel of a streak, 64 at most."
    jitter: float = 0.0
    "0 to 1: trades bands for noise."
    holdout: str | None = None
    "Stays sharp: LAYER (grey), LAYER=VALUE (object index, Cryptomatte) or an image file."
    scale: str | None = None
    "Multiplies the motion, per pixel: a LAYER or an image file."
    max_blur: float | None = None
    "Longest streak in pixels."

    def resolved(self, scene: Scene | None = None, clip: Clip | None = None) -> Self:
        """With a method that suits the scene or what the files hold, if it was left open."""
        suited = "gather" if clip is None else default_method(clip.has)
        if scene is not None and scene.has_volumes:
            suited = "volume"
        return replace(self, method=self.method or suited)

    def make(self, shutter_: Shutter, adapter: str | None) -> Blur:
        """The Blur these options describe; an option its method does not have is an error."""
        own = {name: getattr(self, name) for name in METHOD_OPTIONS}
        given = {
            name: value for name, value in own.items() if value is not None and value is not False
        }
        return Blur(
            self.method or default_method({"motion", "depth"}),
            shutter=shutter_,
            samples=self.samples,
            jitter=self.jitter,
            max_blur=self.max_blur,
            device=adapter,
            **given,
        )


@dataclass(frozen=True, kw_only=True)
class SceneSettings:
    """Which moments of a scene, and how large."""

    time: float | None = None
    "The one picture's time in seconds, where there are no --frames."
    frames: str | None = None
    "Frames such as 0-99; frame N is at N / fps seconds."
    size: str = "640x360"
    "Width x height in pixels."
    rays: int = 3
    "Antialiasing of what image methods start from: rays a pixel's side, 1 to 8."
    set: tuple[str, ...] = ()
    "A parameter of the scene as NAME=VALUE; may be repeated."
    orbit: tuple[float, float] = (0.0, 0.0)
    "Turn the camera round what it looks at: degrees to the right, and up."
    pan: tuple[float, float] = (0.0, 0.0)
    "Then move it to the right, and up [scene units]."
    dolly: float = 1.0
    "Times its distance to what it looks at."

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
        raise InputError(f"--set takes NAME=VALUE, got {wrong[0]!r}")
    return {name: value for name, _, value in pairs}


@dataclass(frozen=True, kw_only=True)
class OutputSettings:
    """Where to."""

    output: str
    "Pattern or file: .exr .png .jpg .tif, or a video .mp4 .mov .mkv .webm .gif."
    bits: int = 8
    "Bits a sample of PNG and TIFF: 8 or 16."
    fps: str = "24"
    "Frames per second of a video, such as 24 or 30000/1001."
    overwrite: bool = False
    "Replace files that exist."
    resume: bool = False
    "Keep frames that are done; redo those whose settings or inputs differ."
    layers: Literal["all", "picture"] = "all"
    "EXR to EXR: all layers of the input beside the picture, or the picture only (faster)."
    compression: str = "zip"
    "EXR: none, rle, zips, zip, piz; lossy: pxr24, b44, b44a, dwaa, dwab; same as the input's."

    @property
    def looks(self) -> dict:
        """What of these changes the files' content."""
        return {"bits": self.bits, "layers": self.layers, "compression": self.compression}

    @property
    def rate(self) -> Fraction:
        """Frames per second, exactly."""
        return rate_of(self.fps)


def rate_of(text: str) -> Fraction:
    """`24`, `23.976`, `30000/1001` -> frames per second, exactly; over 0, at most 1000."""
    try:
        if re.search(r"e[+-]?[\d_]{4}", text, re.IGNORECASE):  # would be worked out in full
            raise ValueError
        fps = Fraction(text)
    except (ValueError, ZeroDivisionError):
        raise InputError(f"fps must be a number or a fraction, got {text!r}") from None
    if not 0 < fps <= 1000:
        raise InputError(f"fps must be over 0 and at most 1000, got {text}")
    return fps


def plain(options) -> dict:
    """The options by name, as JSON can hold them."""
    return {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items()}
