"""Kinds of light of a frame that can be followed: those that it and a neighbour hold apart."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

from ...errors import InputError
from ..contract import Inputs, PreparedFrame
from .shading import Kind, SurfaceLight

Shading = Literal["auto", "off", "passes", "frames"]
PAIRS = ("diffuse_light", "diffuse_color"), ("glossy_light", "glossy_color")
PASSES = frozenset(name for pair in PAIRS for name in pair)


def kinds_of(inputs: Inputs, shading: Shading) -> list[Kind]:
    """The kinds of light that are followed; none: shading stays that of the frame.

    Without passes, a frame's colours give the light on static surfaces, if its vectors mark
    these and pixels have no weights.
    """
    if shading == "off":
        return []
    if shading == "frames":
        return _kind(inputs, "color", None, False)
    found = [
        *_kind(inputs, *PAIRS[0], False),
        *_kind(inputs, *PAIRS[1], True),
    ]
    if shading == "passes" and not any(_has(inputs.frame, pair) for pair in PAIRS):
        raise InputError(
            '`shading` "passes" needs passes of light: diffuse_light and diffuse_color, or '
            "glossy_light and glossy_color"
        )
    if found or shading == "passes" or inputs.frame.by_camera or inputs.frame.weight is not None:
        return found
    return [replace(kind, resting=True) for kind in _kind(inputs, "color", None, False)]


def _kind(inputs: Inputs, light: str, color: str | None, pulled: bool) -> list[Kind]:
    seen = {f.offset: _surface_light(f, light) for f in inputs.frames if abs(f.offset) <= 1}
    there = {offset: one for offset, one in seen.items() if one is not None}
    albedo = None if color is None else getattr(inputs.frame, color)
    if 0 not in there or len(there) < 2 or (color is not None and albedo is None):
        return []
    return [Kind(pulled, there, albedo, by_color=color is None)]


def _has(frame: PreparedFrame, names: Iterable[str]) -> bool:
    return all(getattr(frame, name) is not None for name in names)


def _surface_light(frame: PreparedFrame, light: str) -> SurfaceLight | None:
    view = getattr(frame, light)
    if view is None or frame.motion is None or frame.depth is None:
        return None
    return SurfaceLight(view, frame.depth, frame.motion)
