"""The command line's options, as groups that several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from . import sequence, shutter, vectors
from .errors import InputError
from .numbering import frame_numbers
from .pipeline import Blur

_IN = Group("Input", sort_key=1)
_LOOK = Group("Blur", sort_key=2)
_SHUTTER = Group("Shutter", sort_key=3)
_OUT = Group("Output", sort_key=4)


@Parameter(name="*", group=_SHUTTER)
@dataclass(frozen=True, kw_only=True)
class ShutterOptions:
    """When the shutter is open."""

    shutter: float = 180.0
    "Degrees it is open: 360 is one frame interval, more is allowed."
    phase: str = "centre"
    "start (opens at the frame), centre, end (closes at it), or the middle's time in frames."
    curve: str = "box"
    "box, trapezoid, triangle, cosine, gaussian, or a CSV file of time, weight."
    rolling: Literal["up", "down", "left", "right"] | None = None
    "Rolling shutter: the way the exposure runs over the picture."
    rolling_duration: float = 1.0
    "Time from the first row or column to the last, in frame intervals."

    def make(self) -> shutter.Shutter:
        """The Shutter these options describe."""
        phase: str | float = self.phase
        if phase not in shutter.PHASES:
            try:
                phase = float(phase)
            except ValueError:
                raise InputError(
                    f"phase must be start, centre, end or a number, got {phase!r}"
                ) from None
        curve = self.curve
        if curve not in shutter.CURVES:
            if not Path(curve).is_file():
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

    def open(
        self, pattern: str, keep: str | None = None, scale: str | None = None
    ) -> sequence.Clip:
        """The clip these options describe."""
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
            pattern, frames=self.frames, passes=passes, skip_missing=self.skip_missing
        )


@Parameter(name="*", group=_LOOK)
@dataclass(frozen=True, kw_only=True)
class BlurOptions:
    """How to blur."""

    method: str = "tap"
    "tap, tiles, reproject. Scenes: also accumulate, distributed. See the README's table."
    samples: int = 16
    "Taps, pictures or rays a pixel."
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
    form: Literal["shutter", "even", "slices", "published"] | None = None
    "tap (shutter), tiles (even), reproject (slices): published is the form of the paper."
    show: Literal["color", "count", "confidence"] | None = None
    "reproject: count shows how often a pixel was reached. gather: confidence shows how sure it is."
    seed: int | None = None
    "distributed: another seed is other noise."

    def make(self, shutter_: shutter.Shutter, adapter: str | None) -> Blur:
        """The Blur these options describe; an option its method does not have is an error."""
        options = {"path": self.path, "form": self.form, "show": self.show, "seed": self.seed}
        given = {name: value for name, value in options.items() if value is not None}
        return Blur(
            self.method,
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
    "The one picture's time in seconds (0 if there are no --frames either)."
    frames: str | None = None
    "Frames such as 0-99; frame N is at N / fps seconds."
    size: str = "640x360"
    "Width x height in pixels."
    rays: int = 3
    "Antialiasing of what image methods start from: rays a pixel's side, 1 to 8."
    set: tuple[str, ...] = ()
    "A parameter of the scene as NAME=VALUE; may be repeated."

    def settings(self) -> dict[str, str]:
        """The scene's parameters by name."""
        pairs = [text.partition("=") for text in self.set]
        if wrong := [name for name, equals, _ in pairs if not equals]:
            raise InputError(f"--set takes NAME=VALUE, got {wrong[0]!r}")
        return {name: value for name, _, value in pairs}

    def moments(self, fps: float) -> dict[int, float]:
        """Times in seconds by frame number."""
        if self.time is not None and self.frames is not None:
            raise InputError("give --time or --frames, not both")
        if self.frames is None:
            return {0: self.time or 0.0}
        return {n: n / fps for n in frame_numbers(self.frames)}


def size_of(text: str) -> tuple[int, int]:
    """`1920x1080` -> width, height."""
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise InputError(f"size must be like 1920x1080, got {text!r}")
    return int(width), int(height)


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

    @property
    def rate(self) -> Fraction:
        """Frames per second, exactly."""
        try:
            fps = Fraction(self.fps)
        except (ValueError, ZeroDivisionError):
            raise InputError(f"fps must be a number or a fraction, got {self.fps!r}") from None
        if not 0 < fps <= 1000:
            raise InputError(f"fps must be over 0 and at most 1000, got {self.fps}")
        return fps
