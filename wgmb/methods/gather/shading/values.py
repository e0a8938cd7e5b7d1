"""Values that move over a frame's surfaces, in the frame and in its neighbours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .changes import SurfaceLight, View
from .stage import Stage

STEPS = 12  # [px] that the brightest light around is looked for


def values(
    stage: Stage, here: SurfaceLight, changed: Mapping[int, View], by_color: bool
) -> dict[int, View]:
    """Darkness, or levels of light, by the offset of the frame: see values.wgsl.

    `by_color`: the light is the picture itself, and the brightest pixels around may be its texture.
    """
    sides: dict[str, Any] = {"before": changed.get(-1), "after": changed.get(1)}
    closed = None
    if not (stage.pulled or stage.resting):
        closed = _closed(stage, here, sides, 0 if by_color else STEPS)
    result = {}
    for offset in (0, *changed):
        name, format = f"values {offset}", "rgba16float"
        result[offset] = (stage.texture if stage.pulled else stage.sparse)(name, format)
        stage.run(
            "values",
            over="whole" if stage.pulled else "near",
            light_here=here.light,
            closed=closed,
            own=changed.get(offset),
            values=result[offset],
            **sides,
        )
    return result


def _closed(stage: Stage, here: SurfaceLight, sides: Mapping[str, Any], steps: int) -> View:
    """The light without its shadows."""
    state, other = (stage.sparse(f"closing {k}", "rgba32float") for k in "ab")
    for entry in ("begin", *("grow",) * steps, *("shrink",) * steps):
        stage.run(
            "closing",
            entry,
            over="near",
            light_here=here.light,
            depth_here=here.depth,
            state=other,
            output=state,
            **sides,
        )
        state, other = other, state
    return other
