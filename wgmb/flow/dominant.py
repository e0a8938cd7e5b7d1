"""The motion of most of the picture as a first state: a camera's, which may turn and bend."""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu

from .homography import TOLERANCE, columns, dominant_homography
from .passes import STATES, Bindings, FlowPasses
from .views import AROUND, Views

WHOLE, PARTS = 1.0, 0.5  # how far off the motion of most displacements may be [px]
LEAST_BEND = 0.5  # less [px] is left to the sweeps, which begin at constant velocity
CORRECTIONS = 2  # by inverse search, to parts of a pixel
ACROSS = 40  # pixels along a side that take part in them


def follow_most(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    views: Views,
    states: wgpu.GPUTexture,
    centres: np.ndarray,
    ways: np.ndarray,
) -> tuple[wgpu.GPUTexture, tuple[np.ndarray, np.ndarray]]:
    """States; where the motion of most bends and explains a pixel better, that.

    Also its homographies to the near frame and to the far one.

    The given states are given back as they are, or taken back.

    `centres` (count, 2) [px] of some pixels, `ways` (count, 4) their whole displacements to the
    near frame and to the far one; `matched`: the bindings of match.wgsl.
    """
    bound = {"states": states} | matched
    has_far = views.factor == AROUND
    most = _matrices(size, centres, ways, WHOLE, has_far)
    if any((matrix != np.eye(3)).any() for matrix in most):
        few = min(size[0], ACROSS), min(size[1], ACROSS)
        centres, thin = spaced(few, size) + 0.5, passes.take(few, STATES)
        for _ in range(CORRECTIONS):
            _run(passes, "correct", size, most, grid=few, output=thin, **bound)
            ways = _read(passes, thin)
            most = _matrices(size, centres, ways, PARTS, has_far)
        passes.give(thin)
    if not _bends(views, most, centres, ways):
        return states, most
    output = passes.take(size, STATES)
    _run(passes, "follow", size, most, output=output, **bound)
    passes.give(states)
    return output, most


def spaced(few: tuple[int, int], many: tuple[int, int]) -> np.ndarray:
    """(count, 2) numbers of `few` pixels across and down, evenly spaced among `many`."""
    y, x = np.mgrid[: few[1], : few[0]]
    return ((2 * np.stack([x, y], axis=-1) + 1) * many // (2 * np.array(few))).reshape(-1, 2)


def _matrices(
    size: tuple[int, int],
    centres: np.ndarray,
    ways: np.ndarray,
    tolerance: float,
    has_far: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """The homographies of most of the picture to the near frame and the far one.

    Without displacements to the far frame, it is two frames on as the near one.
    """
    longest = max(size)
    near = dominant_homography(centres, ways[:, :2], longest, tolerance / longest)
    if not has_far:
        return near, near @ near
    return near, dominant_homography(centres, ways[:, 2:], longest, tolerance / longest)


def _bends(
    views: Views, most: tuple[np.ndarray, np.ndarray], centres: np.ndarray, ways: np.ndarray
) -> bool:
    """True if at least half of the pixels move like most, and so leave constant velocity."""
    agree = np.ones(len(centres), bool)
    for matrix, way in zip(most, (ways[:, :2], ways[:, 2:]), strict=True):
        moved = np.concatenate([centres, np.ones((len(centres), 1))], axis=1) @ matrix.T
        apart = moved[:, :2] / moved[:, 2:] - centres - way
        agree &= np.hypot(apart[:, 0], apart[:, 1]) < PARTS
    bend = (ways[:, 2:] - views.factor * ways[:, :2])[agree]
    half = 2 * len(bend) >= len(centres)
    return bool(half and np.median(np.hypot(bend[:, 0], bend[:, 1])) >= LEAST_BEND)


def settle(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    views: Views,
    states: wgpu.GPUTexture,
) -> wgpu.GPUTexture:
    """States of a frame, those that the picture hardly tells taken from the motion of most of it.

    The given states are taken back.
    """
    few = min(size[0], ACROSS), min(size[1], ACROSS)
    centres, thin = spaced(few, size) + 0.5, passes.take(few, STATES)
    bound = {"states": states} | matched
    _run(passes, "write_ways", size, (np.eye(3), np.eye(3)), grid=few, output=thin, **bound)
    most = _matrices(
        size, centres, _read(passes, thin), TOLERANCE * max(size), views.far is not None
    )
    for _ in range(CORRECTIONS):
        _run(passes, "correct", size, most, grid=few, output=thin, **bound)
        most = _matrices(size, centres, _read(passes, thin), PARTS, views.far is not None)
    output = settled(passes, size, matched, states, most)
    passes.give(thin, states)
    return output


def settled(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    states: wgpu.GPUTexture,
    most: tuple[np.ndarray, np.ndarray],
) -> wgpu.GPUTexture:
    """States after `settle` in dominant.wgsl.

    `most`: the homographies of most of the picture to the near frame and to the far one.
    """
    output = passes.take(size, STATES)
    _run(passes, "settle", size, most, states=states, output=output, **matched)
    return output


def _read(passes: FlowPasses, thin: wgpu.GPUTexture) -> np.ndarray:
    """(count, 4) the output of a pass for a few pixels."""
    return passes.read(thin).reshape(-1, 4)


def _run(
    passes: FlowPasses,
    entry: str,
    size: tuple[int, int],
    most: tuple[np.ndarray, np.ndarray],
    **bound: Any,
) -> None:
    values = dict(zip(("to_near", "to_far"), map(columns, most), strict=True))
    uniform = passes.uniform("dominant.wgsl", "Dominant", **values)
    passes.run("dominant.wgsl", entry, size, dominant=uniform, **bound)
