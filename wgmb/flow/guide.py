"""The smooth motion that a picture has from afar, found from coarse to fine, as a guide."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import wgpu

from .homography import columns, enlarged
from .passes import STATES, Bindings, FlowPasses

REACH = 0.2  # of the longer side: how far around the motion of most the coarsest level is searched
AROUND = 2  # px around the displacements of the coarser level
FINER_AROUND = 1  # the same on a level finer than the coarsest that is swept


def guide(
    passes: FlowPasses,
    sizes: list[tuple[int, int]],
    matched: Sequence[Bindings],
    most: tuple[np.ndarray, np.ndarray],
) -> wgpu.GPUTexture:
    """Displacements as the picture seems to move from afar, on the first of some levels.

    `sizes`: of the levels; `matched`: the bindings of match.wgsl on each; `most`: the
    homographies of most of the picture to the near frame and the far one on the first level.
    """
    coarsest = len(sizes) - 1
    near, far = (enlarged(matrix, 0.5**coarsest) for matrix in most)
    ways = begun(passes, sizes[-1], matched[-1], (near, far))
    for level in reversed(range(coarsest)):
        coarser = ways
        ways = finer(passes, sizes[level:], matched[level:], coarser, AROUND)
        passes.give(coarser)
    return ways


def finer(
    passes: FlowPasses,
    sizes: list[tuple[int, int]],
    matched: Sequence[Bindings],
    coarser: wgpu.GPUTexture,
    reach: int = FINER_AROUND,
) -> wgpu.GPUTexture:
    """Displacements of the first level from medians of those of the second one."""
    once = median(passes, sizes[1], matched[1], coarser)
    twice = median(passes, sizes[1], matched[1], once)
    ways = descended(passes, sizes[0], matched[0], twice, reach)
    passes.give(once, twice)
    return ways


def begun(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    most: tuple[np.ndarray, np.ndarray],
) -> wgpu.GPUTexture:
    """Displacements of the coarsest level: the best around those of most of the picture."""
    near, far = (columns(matrix) for matrix in most)
    own = {"to_near": near, "to_far": far, "reach": max(1, round(REACH * max(size)))}
    none = passes.take((1, 1), STATES)
    ways = _run(passes, "descend", size, matched, none, begins=True, **own)
    passes.give(none)
    return ways


def descended(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    coarser: wgpu.GPUTexture,
    reach: int,
) -> wgpu.GPUTexture:
    """Displacements of a level: the best within `reach` px of those of the coarser one."""
    return _run(passes, "descend", size, matched, coarser, reach=reach)


def median(
    passes: FlowPasses, size: tuple[int, int], matched: Bindings, ways: wgpu.GPUTexture
) -> wgpu.GPUTexture:
    """Of the displacements of 3 x 3 pixels, the one nearest to all."""
    return _run(passes, "median", size, matched, ways)


def _run(
    passes: FlowPasses,
    entry: str,
    size: tuple[int, int],
    matched: Bindings,
    ways: wgpu.GPUTexture,
    **values: Any,
) -> wgpu.GPUTexture:
    output = passes.take(size, STATES)
    uniform = passes.uniform("guide.wgsl", "Guide", **values)
    passes.run("guide.wgsl", entry, size, guide=uniform, ways=ways, output=output, **matched)
    return output
