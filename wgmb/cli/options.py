"""Option groups shared by several commands, with help texts from the registries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeVar

from cyclopts import Group, Parameter

from ..io import exr
from ..io.suffixes import STILLS, VIDEOS
from ..methods import METHODS
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

_Settings = TypeVar("_Settings", bound=type)


def _with_help(settings: _Settings) -> _Settings:
    """Add the help texts of method-specific options."""
    for name, (kind, default, text) in METHOD_OPTIONS.items():
        settings.__annotations__[name] = Annotated[kind, Parameter(help=f"{text}.")]
        setattr(settings, name, default)
    return settings


@dataclass(frozen=True, kw_only=True)
@_with_help
class BlurOptions(BlurSettings):
    """Blur method and options."""

    holdout: Annotated[
        tuple[str, ...],
        Parameter(
            alias="--keep",
            help="Pixels that stay sharp: LAYER (grey), LAYER=VALUE (object index, Cryptomatte; "
            "names may have wildcards), an image file, or static (videos); may be repeated.",
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
            help=f"{', '.join(METHODS)}; default: gather with depth or searched motion, else tap."
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
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


@dataclass(frozen=True, kw_only=True)
class InputOptions(InputSettings):
    """Input frames, layers and conventions."""

    vectors: Annotated[
        str,
        Parameter(
            help="Motion vector convention: auto (detected), none, or that of "
            f"{', '.join(CONVENTIONS)}."
        ),
    ] = "auto"


@dataclass(frozen=True, kw_only=True)
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


Inputs = Annotated[InputOptions, Parameter(name="*", group=Group("Input", sort_key=1))]
SceneTimes = Annotated[SceneSettings, Parameter(name="*", group=Group("Input", sort_key=1))]
Blurs = Annotated[BlurOptions, Parameter(name="*", group=Group("Blur", sort_key=2))]
Shutters = Annotated[ShutterOptions, Parameter(name="*", group=Group("Shutter", sort_key=3))]
Colors = Annotated[ColorSettings, Parameter(name="*", group=Group("Colour", sort_key=4))]
DisplayOptions = Annotated[DisplaySettings, Parameter(name="*", group=Group("Colour", sort_key=4))]
Videos = Annotated[VideoSettings, Parameter(name="*", group=Group("Video", sort_key=4))]
Outputs = Annotated[OutputOptions, Parameter(name="*", group=Group("Output", sort_key=5))]
SceneName = Annotated[str, Parameter(help=f"Scene: {', '.join(builtin.SCENES)}.")]
