"""The levels of a picture, each half as large as the one before, as features that flow compares."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import wgpu

from .passes import FEATURES, FlowPasses

COARSEST = 160  # px along the longer side of the coarsest level that is swept, about
COARSER = 2  # levels beyond it


def level_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Width, height of every level, the picture's own first."""
    halvings = max(0, round(np.log2(max(size) / COARSEST)))
    sizes = [size]
    for _ in range(halvings):
        sizes.append((-(-sizes[-1][0] // 2), -(-sizes[-1][1] // 2)))
    return sizes


def all_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """The same with the coarser levels that guide the search."""
    sizes = level_sizes(size)
    for _ in range(COARSER):
        sizes.append((-(-sizes[-1][0] // 2), -(-sizes[-1][1] // 2)))
    return sizes


def features(
    passes: FlowPasses, picture: wgpu.GPUTextureView, size: tuple[int, int]
) -> list[wgpu.GPUTexture]:
    """Features of every level of a linear picture."""
    return list(_levels(passes, picture, size))


def _levels(
    passes: FlowPasses, picture: wgpu.GPUTextureView, size: tuple[int, int]
) -> Iterator[wgpu.GPUTexture]:
    none = passes.scratch((1, 1), "rgba32float", "none")
    unwritten = passes.take((1, 1), FEATURES)

    def run(
        entry: str,
        size: tuple[int, int],
        source: wgpu.GPUTexture | wgpu.GPUTextureView,
        display: wgpu.GPUTexture = none,
        output: wgpu.GPUTexture | None = None,
        written: wgpu.GPUTexture = unwritten,
    ) -> None:
        spare = passes.scratch((1, 1), "rgba32float", "spare")
        passes.run(
            "pyramid.wgsl",
            entry,
            size,
            picture=source,
            display=display,
            output=output or spare,
            features=written,
        )

    coarser = picture
    for level, here in enumerate(all_sizes(size)):
        texture = [
            passes.scratch(here, "rgba32float", f"{name} {level}")
            for name in ("linear", "display", "gradient", "spread")
        ]
        linear, display, gradient, spread = texture
        run("halve" if level else "limit", here, coarser, output=linear)
        run("encode_display", here, linear, output=display)
        run("find_gradients", here, display, output=gradient)
        run("spread", here, gradient, output=spread)
        done = passes.take(here, FEATURES)
        run("write_features", here, spread, display, written=done)
        coarser = linear
        yield done
    passes.give(unwritten)
