"""Settings as options: the groups that several commands share, with help from the registries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeVar

from cyclopts import Group, Parameter

from ..io import exr, stills, video
from ..io.vectors import CONVENTIONS
from ..methods import METHODS
from ..scene import builtin
from ..settings import (
    METHOD_OPTIONS,
    BlurSettings,
    InputSettings,
    OutputSettings,
    SceneSettings,
    ShutterSettings,
)
from ..shutter import CURVES, PHASES

_Settings = TypeVar("_Settings", bound=type)


def _with_help(settings: _Settings) -> _Settings:
    """Give the options that only some methods have their help."""
    for name, (kind, default, text) in METHOD_OPTIONS.items():
        settings.__annotations__[name] = Annotated[kind, Parameter(help=f"{text}.")]
        setattr(settings, name, default)
    return settings


@dataclass(frozen=True, kw_only=True)
@_with_help
class BlurOptions(BlurSettings):
    """How to blur."""

    holdout: Annotated[
        str | None,
        Parameter(
            alias="--keep",
            help="Stays sharp: LAYER (grey), LAYER=VALUE (object index, Cryptomatte) or an image.",
        ),
    ] = None

    method: Annotated[
        str | None,
        Parameter(help=f"{', '.join(METHODS)}; by default gather where there is depth, else tap."),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ShutterOptions(ShutterSettings):
    """When the shutter is open."""

    phase: Annotated[
        str,
        Parameter(
            help=f"When it opens: {', '.join(PHASES)} of the interval at the frame's instant, "
            "or the time of the exposure's middle in frame intervals."
        ),
    ] = "centre"
    curve: Annotated[
        str | None,
        Parameter(help=f"{', '.join(CURVES)}, or a CSV file of time, weight; box by default."),
    ] = None


@dataclass(frozen=True, kw_only=True)
class InputOptions(InputSettings):
    """Which frames and layers, and what they mean."""

    vectors: Annotated[
        str,
        Parameter(
            help="What the motion vectors mean: auto, none, or the convention of "
            f"{', '.join(CONVENTIONS)}."
        ),
    ] = "auto"


@dataclass(frozen=True, kw_only=True)
class OutputOptions(OutputSettings):
    """Where to."""

    output: Annotated[
        str,
        Parameter(
            alias="-o",
            help=f"Pattern or file: .exr {' '.join(stills.SUFFIXES)}, or a video "
            f"{' '.join(video.SUFFIXES)}.",
        ),
    ]
    compression: Annotated[
        str,
        Parameter(help=f"Of an EXR: {', '.join(exr.COMPRESSIONS)}, or the same as the input's."),
    ] = "zip"


Given = Annotated[InputOptions, Parameter(name="*", group=Group("Input", sort_key=1))]
Moments = Annotated[SceneSettings, Parameter(name="*", group=Group("Input", sort_key=1))]
Look = Annotated[BlurOptions, Parameter(name="*", group=Group("Blur", sort_key=2))]
When = Annotated[ShutterOptions, Parameter(name="*", group=Group("Shutter", sort_key=3))]
Target = Annotated[OutputOptions, Parameter(name="*", group=Group("Output", sort_key=5))]
SceneName = Annotated[str, Parameter(help=f"{', '.join(builtin.SCENES)}.")]
