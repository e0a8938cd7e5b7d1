"""Presets of the input by the program that made the frames: options that one could give by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

ProgramName = Literal["ae", "arnold", "blender", "nuke", "redshift", "unreal", "vray"]


@dataclass(frozen=True)
class ProgramPreset:
    """A program, and the fields of InputSettings that its frames need."""

    name: str
    options: Mapping[str, Any]


def _program(name: str, **values: Any) -> ProgramPreset:
    return ProgramPreset(name, MappingProxyType(values))


PROGRAMS: dict[str, ProgramPreset] = {
    "ae": _program("After Effects", vectors="rsmb", depth_kind="white-near"),
    "arnold": _program("Arnold", vector_layer="motionvector", depth_kind="planar"),
    "blender": _program("Blender", vectors="blender", depth_kind="planar"),
    "nuke": _program("Nuke", vectors="nuke", depth_kind="inverse"),
    "redshift": _program("Redshift", vector_layer="MotionVectors"),
    "unreal": _program("Unreal", vectors="unreal", depth_kind="planar"),
    "vray": _program("V-Ray", vectors="vray"),
}
"""By the names that the option takes. Where `vectors` is not set, their convention is detected."""
