"""Option groups shared by several commands, with help texts from the registries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar, get_type_hints

from cyclopts import Parameter, Token

from ..io import exr
from ..io.suffixes import STILLS, VIDEOS
from ..methods import METHODS, frame_methods
from ..methods.options import options_of
from ..scene import builtin
from ..sequence.layers.vectors import CONVENTIONS
from ..settings import (
    METHOD_OPTIONS,
    BlurSettings,
    InputSettings,
    OutputSettings,
    SceneSettings,
    ShutterSettings,
)
from ..settings.color import ColorSettings, DisplaySettings
from ..settings.video import VideoSettings
from ..shutter import CURVES, PHASES
from .help import BLUR, COLOR, INPUT, MAIN, METHOD, OUTPUT, RUN, SHUTTER, VIDEO

_FRAME_METHODS = frame_methods()
_SCENE_METHODS = [name for name in METHODS if name not in _FRAME_METHODS]
_OF_FRAMES = {name for method in _FRAME_METHODS for name in options_of(METHODS[method].Options)}
_OF_SCENES = METHOD_OPTIONS.keys() - _OF_FRAMES  # options that only methods for scenes have

_Settings = TypeVar("_Settings", bound=type)


def _with_help(settings: _Settings) -> _Settings:
    """Add the help texts of method-specific options."""
    for name, (kind, default, text) in METHOD_OPTIONS.items():
        about = Parameter(help=f"{text}.", group=METHOD)
        settings.__annotations__[name] = Annotated[kind, about]
        setattr(settings, name, default)
    return settings


def _with(parameter: Parameter, *names: str) -> Callable[[_Settings], _Settings]:
    """Add a Parameter to fields of settings."""

    def add(settings: _Settings) -> _Settings:
        # All types as objects: their names mean nothing in this module.
        hints = get_type_hints(settings, include_extras=True)
        for name, hint in hints.items():
            settings.__annotations__[name] = Annotated[hint, parameter] if name in names else hint
            if hasattr(settings, name):
                setattr(settings, name, getattr(settings, name))
        return settings

    return add


def _main(*names: str) -> Callable[[_Settings], _Settings]:
    """Put fields into the panel MAIN."""
    return _with(Parameter(group=MAIN), *names)


def _without(*names: str) -> Callable[[_Settings], _Settings]:
    """Leave fields out of the help of a command that has no use for them."""
    return _with(Parameter(show=False), *names)


@dataclass(frozen=True, kw_only=True)
@_main("method", "samples", "holdout")
@_with_help
class BlurOptions(BlurSettings):
    """Blur method and options."""

    holdout: Annotated[
        tuple[str, ...],
        Parameter(
            help="Pixels that stay sharp: LAYER (grey), LAYER=VALUE (object index, Cryptomatte; "
            "names may have wildcards), an image file; for videos also static, or none, as "
            "displays are found; may be repeated.",
        ),
    ] = ()

    scale: Annotated[
        tuple[str, ...],
        Parameter(
            help="Scale of the motion: a LAYER or image file that multiplies it, or "
            "LAYER=VALUE:AMOUNT for the pixels of an object; may be repeated.",
        ),
    ] = ()

    method: Annotated[
        str | None,
        Parameter(
            help=f"{', '.join(_FRAME_METHODS)}, for scenes also {', '.join(_SCENE_METHODS)}; "
            "by default the one that suits the input."
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
@_without(*_OF_SCENES)
class FrameBlurOptions(BlurOptions):
    """Blur method and options, for rendered frames and videos."""

    method: Annotated[
        str | None,
        Parameter(
            help=f"{', '.join(_FRAME_METHODS)}; default: gather with depth or searched motion, "
            "else tiles.",
            group=MAIN,
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
@_without("holdout", "scale")
class SceneBlurOptions(BlurOptions):
    """Blur method and options, for built-in scenes."""


@dataclass(frozen=True, kw_only=True)
@_main("shutter")
class ShutterOptions(ShutterSettings):
    """Shutter angle, phase and curve."""

    phase: Annotated[
        str,
        Parameter(
            help=f"Position of the frame's instant in the exposure: {', '.join(PHASES)}; "
            "or the time of the exposure's middle in frame intervals."
        ),
    ] = "centre"
    curve: Annotated[
        str | None,
        Parameter(help=f"{', '.join(CURVES)}, or a CSV file of time, weight; default: box."),
    ] = None


def _one_or_two(_: object, tokens: Sequence[Token]) -> float | tuple[float, float]:
    """A number, or two with a comma between them."""
    match [float(part) for part in tokens[0].value.split(",")]:
        case [both]:
            return both
        case [x, y]:
            return x, y
    raise ValueError("must be a number, or two such as 1920,1080")


@dataclass(frozen=True, kw_only=True)
@_main("frames", "vectors")
class InputOptions(InputSettings):
    """Input frames, layers and conventions."""

    vectors: Annotated[
        str,
        Parameter(
            help="Motion vector convention: auto (detected), none, or that of "
            f"{', '.join(CONVENTIONS)}."
        ),
    ] = "auto"
    vector_scale: Annotated[
        float | tuple[float, float],
        Parameter(
            help="Factor applied to the motion vectors, or X,Y: one for x and one for y.",
            converter=_one_or_two,
            n_tokens=1,
        ),
    ] = 1.0


@dataclass(frozen=True, kw_only=True)
@_main("output", "fps", "resume", "overwrite")
class OutputOptions(OutputSettings):
    """Output files."""

    output: Annotated[
        str,
        Parameter(
            alias="-o",
            help=f"Pattern or file: .exr {' '.join(STILLS)}, or a video {' '.join(VIDEOS)}.",
        ),
    ]
    compression: Annotated[
        str,
        Parameter(help=f"EXR compression: {', '.join(exr.COMPRESSIONS)}, or same (as the input)."),
    ] = "zip"


@dataclass(frozen=True, kw_only=True)
@_without("resume")
class PerceivedOutputOptions(OutputOptions):
    """Output files whose every frame depends on the previous ones."""


@dataclass(frozen=True, kw_only=True)
@_main("frames")
class SceneOptions(SceneSettings):
    """Times, image size, parameters and camera of a scene."""


@dataclass(frozen=True, kw_only=True)
@_main("begin", "end")
class VideoOptions(VideoSettings):
    """Motion, time and encoding of videos."""


Inputs = Annotated[InputOptions, Parameter(name="*", group=INPUT)]
SceneTimes = Annotated[SceneOptions, Parameter(name="*", group=INPUT)]
Blurs = Annotated[BlurOptions, Parameter(name="*", group=BLUR)]
FrameBlurs = Annotated[FrameBlurOptions, Parameter(name="*", group=BLUR)]
SceneBlurs = Annotated[SceneBlurOptions, Parameter(name="*", group=BLUR)]
Shutters = Annotated[ShutterOptions, Parameter(name="*", group=SHUTTER)]
Colors = Annotated[ColorSettings, Parameter(name="*", group=COLOR)]
DisplayOptions = Annotated[DisplaySettings, Parameter(name="*", group=COLOR)]
Videos = Annotated[VideoOptions, Parameter(name="*", group=VIDEO)]
Outputs = Annotated[OutputOptions, Parameter(name="*", group=OUTPUT)]
PerceivedOutputs = Annotated[PerceivedOutputOptions, Parameter(name="*", group=OUTPUT)]
Confidence = Annotated[bool, Parameter(group=OUTPUT)]
ConfigFile = Annotated[Path | None, Parameter(name="--config", group=RUN)]
Adapter = Annotated[str | None, Parameter(group=RUN)]
LogJson = Annotated[
    str | None,
    Parameter(
        help="File to which a line of JSON is added at the start of the run, for each frame, and "
        "at the end of the run; - is standard output.",
        group=RUN,
    ),
]
Verbose = Annotated[bool, Parameter(alias="-v", group=RUN)]
Quiet = Annotated[bool, Parameter(alias="-q", group=RUN)]
SceneName = Annotated[str, Parameter(help=f"Scene: {', '.join(builtin.SCENES)}.")]
