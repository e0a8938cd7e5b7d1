"""The smooth motion that a picture has from afar, found from coarse to fine, as a guide."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import wgpu

from .homography import columns, enlarged
from .passes import STATES, Passes

REACH = 0.2  # of the longer side: how far around the motion of most the coarsest level is searched
FINEST_AROUND, AROUND = 1, 2  # px around what the coarser level has: the last level, those before
MEDIANS = 2  # on every level but the last


def guide(
    passes: Passes,
    sizes: list[tuple[int, int]],
    matched: Callable[[int], dict],
    most: tuple[np.ndarray, np.ndarray],
) -> wgpu.GPUTexture:
    """States that lead where the picture seems to move from afar, on the first of some levels.

    `sizes`: of the levels; `matched`: the bindings of match.wgsl on one of these; `most`: the
    homographies of most of the picture to the near frame and the far one on the first level.
    """
    ways = None
    for level in reversed(range(len(sizes))):
        ways = descended(passes, sizes, level, matched(level), ways, most)
        for _ in range(MEDIANS if level else 0):
            ways = median(passes, sizes[level], matched(level), ways)
    assert ways is not None
    return _taken(passes, "write_states", sizes[0], matched(0), ways)


def descended(
    passes: Passes,
    sizes: list[tuple[int, int]],
    level: int,
    matched: dict,
    coarser: wgpu.GPUTexture | None,
    most: tuple[np.ndarray, np.ndarray],
) -> wgpu.GPUTexture:
    """Displacements of a level from those of the coarser one, which are taken back, if any."""
    size = sizes[level]
    reach = AROUND if level else FINEST_AROUND
    if coarser is None:
        reach = max(1, round(REACH * max(size)))
    near, far = (columns(enlarged(matrix, 0.5**level)) for matrix in most)
    own = {"to_near": near, "to_far": far, "reach": reach, "begins": coarser is None}
    if coarser is None:
        coarser = passes.take((1, 1), STATES)
    return _taken(passes, "descend", size, matched, coarser, **own)


def median(passes: Passes, size, matched: dict, ways: wgpu.GPUTexture) -> wgpu.GPUTexture:
    """Of the displacements of 3 x 3 pixels, the one nearest to all; the given are taken back."""
    return _taken(passes, "median", size, matched, ways)


def _taken(passes, entry, size, matched, ways, **own) -> wgpu.GPUTexture:
    """The output of a pass; the given displacements are taken back."""
    output = passes.take(size, STATES)
    uniform = passes.uniform("guide.wgsl", "Guide", **own)
    passes.run("guide.wgsl", entry, size, guide=uniform, ways=ways, output=output, **matched)
    passes.give(ways)
    return output
