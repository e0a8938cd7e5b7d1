"""Changes of the light on a frame's surfaces from frame to frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...contract import View
from .stage import Stage


@dataclass(frozen=True)
class SurfaceLight:
    """Inputs of the passes from one frame: its light, without its albedo, and its surfaces."""

    light: View
    depth: View
    motion: View


def screen(stage: Stage, frames: Mapping[int, SurfaceLight], scale: int) -> None:
    """Record in which tiles light may differ in a neighbour; `frames` as those of `changes`.

    On static surfaces, a pixel of the `stage` is `scale` pixels of the frames wide.
    """
    for offset, other in frames.items():
        if not offset:
            continue
        if stage.resting:
            stage.run(
                "changes/still",
                constants={"SCALE": scale},
                motion_there=other.motion,
                **_pair(frames[0], other),
            )
        else:
            stage.run("changes/screen", **_both(stage, frames[0], other, offset))


def reduced(
    stage: Stage, frames: Mapping[int, SurfaceLight], scale: int
) -> dict[int, SurfaceLight]:
    """The frames at the size of the `stage`; undefined if no tile is doubtful."""
    result = {}
    for offset, frame in frames.items():
        less = SurfaceLight(
            stage.texture(f"light {offset}", "rgba16float"),
            stage.texture(f"depth {offset}", "r32float"),
            stage.texture(f"motion {offset}", "rgba32float"),
        )
        stage.run(
            "changes/reduced",
            over="whole",
            constants={"SCALE": scale},
            light=frame.light,
            depth=frame.depth,
            motion=frame.motion,
            less_light=less.light,
            less_depth=less.depth,
            less_motion=less.motion,
        )
        result[offset] = less
    return result


def _both(stage: Stage, own: SurfaceLight, other: SurfaceLight, offset: int) -> dict[str, Any]:
    """Bindings of passes that compare the frame with the neighbour at `offset`."""
    return {"side": {"next": offset > 0}, **_pair(own, other)}


def _pair(own: SurfaceLight, other: SurfaceLight) -> dict[str, Any]:
    return {
        "light_here": own.light,
        "light_there": other.light,
        "depth_here": own.depth,
        "depth_there": other.depth,
        "motion_here": own.motion,
    }


def changes(
    stage: Stage,
    frames: Mapping[int, SurfaceLight],
    albedo: View | None,
    by_color: bool,
) -> dict[int, View]:
    """Changes of the logarithm of light to each neighbour, by its offset; black where unknown.

    `frames`: by their offsets, 0 the frame itself. `by_color`: the light is the picture itself. The
    stage's change flags are told. Known in the tiles that `screen` has found doubtful.
    """
    here = frames[0]
    distrusts = by_color and not stage.resting  # texture of static surfaces is in register
    plain = {}
    for offset, frame in frames.items():
        plain[offset] = (stage.texture if offset else stage.sparse)(f"plain {offset}", "r32uint")
        stage.run(
            "changes/plain",
            over="whole" if offset else "doubtful",
            depth=frame.depth,
            motion=frame.motion,
            plain=plain[offset],
        )
    result = {}
    for offset, there in frames.items():
        if offset == 0:
            continue
        raw, smooth, limited = (
            stage.sparse(name, "rgba16float")
            for name in ("raw", "smooth", f"{stage.name} changes {offset}")
        )
        stage.run(
            "changes/measure",
            over="doubtful",
            **_both(stage, here, there, offset),
            motion_there=there.motion,
            plain_here=plain[0],
            plain_there=plain[offset],
            ratio=raw,
        )
        peaks, gain, coherence = (
            stage.sparse(name, "r32float") for name in ("peaks", "gain", "coherence")
        )
        # Of what was measured, only changes that can be seen and are more than noise count.
        for entry, ratio, scalar, ratio_out, scalar_out in (
            ("smooth_ratio", raw, None, smooth, None),
            ("find_peaks", smooth, None, None, peaks),
            ("find_coherence", smooth, None, None, coherence),
            ("find_gain", smooth, peaks, None, gain),
            ("limit_ratio", smooth, gain, limited, None),
        ):
            if entry == "find_coherence" and not distrusts:
                continue
            stage.run(
                "changes/gain",
                entry,
                over="doubtful",
                constants={"HAS_ALBEDO": albedo is not None, "COLORS": distrusts},
                ratio=ratio,
                scalar=scalar,
                light_here=here.light,
                albedo=albedo,
                coherence=coherence if entry == "find_gain" else None,
                ratio_out=ratio_out,
                scalar_out=scalar_out,
            )
        result[offset] = limited
    return result
