"""The result of a frame: motion to both neighbours, and the order in depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from .homography import columns, dominant_homography
from .passes import FlowPasses
from .views import AROUND, Views

ACROSS = 40  # points along the longer side from which the motion of most is found


@dataclass(frozen=True)
class Motion:
    """Textures of a frame: `motion` to_prev, to_next [px] (rgba32float), and `depth` (r32float)."""

    motion: wgpu.GPUTexture
    depth: wgpu.GPUTexture


def result(
    passes: FlowPasses,
    size: tuple[int, int],
    views: Views,
    states: wgpu.GPUTexture,
    depth: wgpu.GPUTexture | None = None,
) -> Motion:
    """Motion and depth from the states of a frame; `depth`: if it is known already."""
    motion = passes.take(size, ("rgba32float", 1))
    apart = passes.scratch(size, "rgba32float", "apart")
    spacing = max(1, round(max(size) / ACROSS))
    values = {
        "near": float(views.near - views.here),
        "around": views.far is not None and views.factor == AROUND,
        "spacing": spacing,
    }
    spare = passes.scratch((1, 1), "rgba32float", "spare")
    spare_depth = passes.scratch((1, 1), "r32float", "spare depth")
    none = passes.scratch((1, 1), "rgba32float", "none")

    def run(
        entry: str,
        size: tuple[int, int],
        read: wgpu.GPUTexture = none,
        read_apart: wgpu.GPUTexture = none,
        **written: wgpu.GPUTexture,
    ) -> None:
        outputs: dict[str, Any] = {
            "motion_out": spare,
            "apart_out": spare,
            "depth_out": spare_depth,
        }
        outputs |= written
        passes.run(
            "motion.wgsl",
            entry,
            size,
            result=passes.uniform("motion.wgsl", "Result", **values),
            states=states,
            motion=read,
            apart=read_apart,
            **outputs,
        )

    run("write_motion", size, motion_out=motion)
    if depth is not None:
        return Motion(motion, depth)
    depth = passes.take(size, ("r32float", 1))
    few = -(-size[0] // spacing), -(-size[1] // spacing)
    thin = passes.scratch(few, "rgba32float", "thin")
    run("thin", few, motion, apart_out=thin)
    to_prev, to_next = _homographies(passes, thin, size, spacing)
    values |= {"to_prev": columns(to_prev), "to_next": columns(to_next)}
    run("find_apart", size, motion, apart_out=apart)
    run("write_depth", size, read_apart=apart, depth_out=depth)
    return Motion(motion, depth)


def _homographies(
    passes: FlowPasses, thin: wgpu.GPUTexture, size: tuple[int, int], spacing: int
) -> list[np.ndarray]:
    """The motion of most of the picture to the previous frame and to the next one."""
    some = passes.read(thin)
    y, x = np.mgrid[: some.shape[0], : some.shape[1]]
    last = np.array(size) - 1
    points = np.minimum(np.stack([x, y], axis=-1) * spacing + spacing // 2, last) + 0.5
    return [
        dominant_homography(points.reshape(-1, 2), some[..., k : k + 2].reshape(-1, 2), max(size))
        for k in (0, 2)
    ]
