"""Changes of the light on a frame's surfaces from frame to frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import wgpu

from .stage import Stage

View = wgpu.GPUTextureView


@dataclass(frozen=True)
class SurfaceLight:
    """Inputs of the passes from one frame: its light, without its albedo, and its surfaces."""

    light: View
    depth: View
    motion: View


def changes(
    stage: Stage,
    frames: Mapping[int, SurfaceLight],
    albedo: View | None,
    by_color: bool,
) -> dict[int, View]:
    """Changes of the logarithm of light to each neighbour, by its offset; black where unknown.

    `frames`: by their offsets, 0 the frame itself. `by_color`: the light is the picture itself. The
    stage's change flags are told.
    """
    here = frames[0]
    plain = {}
    for offset, frame in frames.items():
        plain[offset] = stage.texture(f"plain {offset}", "r32uint")
        stage.run("plain", depth=frame.depth, motion=frame.motion, plain=plain[offset])
    result = {}
    for offset, there in frames.items():
        if offset == 0:
            continue
        raw, smooth, limited = (
            stage.texture(name, "rgba16float")
            for name in ("raw", "smooth", f"{stage.name} changes {offset}")
        )
        stage.run(
            "measure",
            side=stage.uniform("measure", "Side", next=offset > 0),
            light_here=here.light,
            light_there=there.light,
            depth_here=here.depth,
            depth_there=there.depth,
            motion_here=here.motion,
            motion_there=there.motion,
            plain_here=plain[0],
            plain_there=plain[offset],
            ratio=raw,
        )
        peaks, gain, coherence = (
            stage.texture(name, "r32float") for name in ("peaks", "gain", "coherence")
        )
        four, one, none = (
            stage.unused("rgba16float"),
            stage.unused("r32float"),
            stage.none("r32float"),
        )
        for entry, ratio, scalar, ratio_out, scalar_out in (
            ("smooth_ratio", raw, none, smooth, one),
            ("find_peaks", smooth, none, four, peaks),
            ("find_coherence", smooth, none, four, coherence),
            ("find_gain", smooth, peaks, four, gain),
            ("limit_ratio", smooth, gain, limited, one),
        ):
            if entry == "find_coherence" and not by_color:
                continue
            stage.run(
                "gain",
                entry,
                constants={"HAS_ALBEDO": albedo is not None, "COLORS": by_color},
                ratio=ratio,
                scalar=scalar,
                light_here=here.light,
                albedo=albedo or stage.none("rgba16float"),
                coherence=coherence if entry == "find_gain" else none,
                ratio_out=ratio_out,
                scalar_out=scalar_out,
                found=stage.change_flags,
            )
        result[offset] = limited
    return result
