"""The command line's options, as groups that several commands share."""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from . import limits, scenes, sequence, shutter, vectors
from .blur import METHODS, default_method
from .cases import Case, Contender
from .cone import Cone
from .errors import InputError
from .findings import Report
from .numbering import frame_numbers, is_pattern, readable
from .pipeline import Blur
from .scene import Scene

_IN = Group("Input", sort_key=1)
_LOOK = Group("Blur", sort_key=2)
_SHUTTER = Group("Shutter", sort_key=3)
_WHO = Group("Compare", sort_key=2)
_PERCEPTION = Group("Perception", sort_key=4)
_OUT = Group("Output", sort_key=5)


@Parameter(name="*", group=_SHUTTER)
@dataclass(frozen=True, kw_only=True)
class ShutterOptions:
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

    def settled(self, scene: Scene | None = None, fps: float = 24.0) -> ShutterOptions:
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
        if self.curve is None or self.curve in shutter.CURVES:
            return self.curve
        return f"{self.curve} (CRC-32 {zlib.crc32(Path(self.curve).read_bytes()):08x})"

    def make(self) -> shutter.Shutter:
        """The Shutter these options describe, once they are settled."""
        phase: str | float = self.phase
        if phase not in shutter.PHASES:
            try:
                phase = float(phase)
            except ValueError:
                raise InputError(
                    f"phase must be start, centre, end or a number, got {phase!r}"
                ) from None
        curve = self.curve
        assert self.shutter is not None and curve is not None
        if curve not in shutter.CURVES:
            if not readable(Path(curve)):
                known = ", ".join(shutter.CURVES)
                raise InputError(f"curve must be one of {known}, or a CSV file; got {curve!r}")
            curve = shutter.read_curve(curve)
        return shutter.Shutter(self.shutter, phase, curve, self.rolling, self.rolling_duration)


@Parameter(name="*", group=_IN)
@dataclass(frozen=True, kw_only=True)
class InputOptions:
    """Which frames and layers, and what they mean."""

    frames: str | None = None
    "Frames of the pattern, such as 1-100x2 or 1,3,5-8; all that exist by default."
    layer: str | None = None
    "The picture's layer, where its name does not say so."
    vectors: str = "auto"
    "What the motion vectors mean: auto, blender, nuke, arnold, vray, rsmb, plain or none."
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

    def open(
        self, pattern: str, keep: str | None = None, scale: str | None = None
    ) -> sequence.Clip:
        """The clip these options describe; InputError where one of its files must not be read."""
        for name in (keep, scale, *self.also):
            if name and Path(name).suffix and not is_pattern(name):
                readable(Path(name))
        passes = sequence.Passes(
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
            keep=keep,
            scale=scale,
            also=self.also,
        )
        return sequence.Clip(
            pattern,
            frames=self.frames,
            passes=passes,
            skip_missing=self.skip_missing,
            max_mb=self.max_mb,
        )


OWN = ("path", "variant", "show", "facing", "depth_test", "splat", "weights", "alpha_front",
       "alpha_back", "tau", "seed")  # fmt: skip


@Parameter(name="*", group=_LOOK)
@dataclass(frozen=True, kw_only=True)
class BlurOptions:
    """How to blur."""

    method: str | None = None
    "gather (default), tap (no depth), tiles, fusion, reproject, accumulate, distributed, volume."
    samples: int | Literal["auto"] | None = None
    "Taps, pictures or rays a pixel: 16, for fusion 8; auto: one a pixel of a streak, 64 at most."
    jitter: float = 0.0
    "0 to 1: trades bands for noise."
    keep: str | None = None
    "Stays sharp: LAYER (grey), LAYER=VALUE (object index, Cryptomatte) or an image file."
    scale: str | None = None
    "Multiplies the motion, per pixel: a LAYER or an image file."
    max_blur: float | None = None
    "Longest streak in pixels."
    path: Literal["curved", "straight"] | None = None
    "tap: through the previous and the next place (curved), or along the mean velocity."
    variant: Literal["shutter", "even", "slices", "published"] | None = None
    "tap, fusion (shutter), tiles (even), reproject (slices): published is the paper's."
    show: Literal["color", "tiles", "count", "confidence"] | None = None
    "tiles: what each tile follows. reproject: count of samples. gather: confidence."
    facing: bool = False
    "reproject, published: leave out what faces away from the interpolated camera."
    depth_test: bool = False
    "reproject, published: only the nearest of the samples on a pixel."
    splat: Literal["point", "line"] | None = None
    "reproject, published: lines between the steps, or points."
    weights: Literal["normalised", "published"] | None = None
    "fusion: with the sum 1, or as printed."
    alpha_front: float | None = None
    "fusion: factor of faces that lead, 0.02 to 0.10; a greater one blurs them less."
    alpha_back: float | None = None
    "fusion: factor of all other faces."
    tau: float | None = None
    "fusion: weight of a sample over the next newer one's, to 1."
    seed: int | None = None
    "distributed: another seed is other noise."

    def settled(self, scene: Scene | None = None, clip: sequence.Clip | None = None) -> BlurOptions:
        """With a method that suits the scene or what the files hold, if it was left open."""
        suited = "gather" if clip is None else default_method(clip.has)
        if scene is not None and scene.has_volumes:
            suited = "volume"
        return replace(self, method=self.method or suited)

    def make(self, shutter_: shutter.Shutter, adapter: str | None) -> Blur:
        """The Blur these options describe; an option its method does not have is an error."""
        own = {name: getattr(self, name) for name in OWN}
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


@Parameter(name="*", group=_IN)
@dataclass(frozen=True, kw_only=True)
class SceneOptions:
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
        scene = scenes.make(name, **self.settings())
        if (self.orbit, self.pan, self.dolly) == ((0.0, 0.0), (0.0, 0.0), 1.0):
            return scene
        aside, up = map(math.radians, self.orbit)
        return scene.seen_from((aside, up), self.pan, self.dolly)

    def settings(self) -> dict[str, str]:
        """The scene's parameters by name."""
        return settings_of(self.set)

    def moments(self, fps: float) -> dict[int, float]:
        """Times in seconds by frame number."""
        if self.frames is None:
            return {0: self.time or 0.0}
        return {n: n / fps for n in frame_numbers(self.frames)}


@Parameter(name="*", group=_WHO)
@dataclass(frozen=True, kw_only=True)
class CompareOptions:
    """Who is compared, and how."""

    methods: str | None = None
    "NAME[:SAMPLES][:OPTION=VALUE]..., separated by commas; all by default."
    reference: str = "distributed:1024"
    "What renders the truth of scenes."
    samples: int = 16
    "Of every method, where samples are equal."
    ladder: str = "4,8,16,32,64"
    "Numbers of samples for the curves."
    budget: float | None = None
    "Milliseconds where time is equal; by default those of the slowest method of pictures."
    shutters: str | None = None
    "Several in degrees, such as 90,180,360, instead of --shutter."
    rounds: int = 3
    "How often everything is timed; the least counts."

    def contenders(self) -> list[Contender]:
        """Who takes part."""
        return [Contender.parse(text) for text in (self.methods or ",".join(METHODS)).split(",")]

    def steps(self) -> list[int]:
        """Numbers of samples."""
        return whole_numbers("ladder", self.ladder)

    def budgets(self) -> Callable[[Report, Case], list[float]] | None:
        """The times that everyone is to fit [s], if they are asked for."""
        if self.budget is None:
            return None
        if not self.budget > 0:
            raise InputError(f"budget must be over 0 ms, got {self.budget}")
        seconds = self.budget / 1e3
        return lambda report, case: [seconds]

    def exposures(
        self, when: ShutterOptions, scene: Scene | None = None
    ) -> dict[str, shutter.Shutter]:
        """The shutters, by what to call them; what is left open is the scene's."""
        settled = when.settled(scene)
        try:
            degrees = [float(d) for d in (self.shutters or str(settled.shutter)).split(",")]
        except ValueError:
            raise InputError(f"shutters must be like 90,180, got {self.shutters!r}") from None
        return {f"{d:g}°": replace(settled, shutter=d).make() for d in degrees}


def whole_numbers(name: str, text: str) -> list[int]:
    """`4,8,16` -> numbers."""
    try:
        return [int(n) for n in text.split(",")]
    except ValueError:
        raise InputError(f"{name} must be like 4,8,16, got {text!r}") from None


@Parameter(name="*", group=_PERCEPTION)
@dataclass(frozen=True, kw_only=True)
class PerceptionOptions:
    """Who looks, and at what."""

    cone_rate: float = 50.0
    "How fast a cone cell's answer to a flash fades, 1/s."
    cone_peak: float = 0.05
    "When it is strongest, seconds after the flash."
    nature: float = 480.0
    "Scenes: pictures a second that stand for a world without frames."
    size: str = "640x360"
    "Scenes: width x height in pixels."
    set: tuple[str, ...] = ()
    "Scenes: a parameter as NAME=VALUE; may be repeated."

    @property
    def cone(self) -> Cone:
        """The cone cell."""
        return Cone(self.cone_rate, self.cone_peak)


def size_of(text: str) -> tuple[int, int]:
    """`1920x1080` -> width, height."""
    sides = re.fullmatch(r"0*([1-9][0-9]{0,8})x0*([1-9][0-9]{0,8})", text)
    if sides is None:
        raise InputError(f"size must be like 1920x1080, got {text!r}")
    return int(sides[1]), int(sides[2])


def settings_of(texts: tuple[str, ...]) -> dict[str, str]:
    """`NAME=VALUE` each -> values by name."""
    pairs = [text.partition("=") for text in texts]
    if wrong := [name for name, equals, _ in pairs if not equals]:
        raise InputError(f"--set takes NAME=VALUE, got {wrong[0]!r}")
    return {name: value for name, _, value in pairs}


@Parameter(name="*", group=_OUT)
@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """Where to."""

    output: Annotated[str, Parameter(alias="-o")]
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
