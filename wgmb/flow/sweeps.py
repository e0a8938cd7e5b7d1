"""Sweeps over a frame's states: every pixel tries those of others, and variations of its own."""

from __future__ import annotations

import numpy as np
import wgpu

from ..gpu import wgsl
from .homography import columns
from .passes import STATES, FlowPasses

NEAR_BY = 0.05  # of the longer side: how far off random pixels are tried
STEP, FINEST_STEP = 1.0, 2.0  # greatest random change [px], on coarse levels and the finest
BEND_STEP = 2.0  # the same of the bend, in pixels of the finest level
MOST_APART, FINEST_APART = 1.0, 2.0  # differences beyond this [px] cost no more
PASSES = 4  # of a sweep
SEEDS = 64  # random numbers that a pass may take for a pixel
MOST_PASSES = 1000  # on one level


def sweep(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: dict,
    states: wgpu.GPUTexture,
    carried: list[wgpu.GPUTexture],
    level: int,
    count: int,
    most: np.ndarray,
    lead: wgpu.GPUTexture | None = None,
) -> wgpu.GPUTexture:
    """New states after `count` sweeps; the given ones are taken back.

    `matched`: the bindings of match.wgsl; `carried`: the near frame's states, and the far one's;
    `most`: the homography of most of the picture to the near frame, on this level; `lead`: what
    repeats.py made.
    """
    after = passes.take(size, STATES)
    for number in range(PASSES * count):
        is_known = number not in (0, 2)  # the first of a colour finds out what its states cost
        args = level, number, after, most, is_known, lead
        half_sweep(passes, size, matched, states, carried, *args)
        states, after = after, states
    passes.give(after)
    return states


def half_sweep(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: dict,
    states: wgpu.GPUTexture,
    carried: list[wgpu.GPUTexture],
    level: int,
    number: int,
    output: wgpu.GPUTexture,
    most: np.ndarray,
    is_known: bool = False,
    lead: wgpu.GPUTexture | None = None,
) -> None:
    """Pass `number` of the sweeps: one colour of the chessboard, propagated or refined.

    `is_known`: the costs of this colour's states are in `passes.costs`, from an earlier pass.
    """
    entry = "refine" if number % 2 else "propagate"
    grid = -(-size[0] // 2), size[1]
    args = level, number, output, most, is_known, lead
    _run(passes, entry, size, grid, matched, states, carried, *args)


def polish(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: dict,
    states: wgpu.GPUTexture,
    output: wgpu.GPUTexture,
) -> None:
    """Steps of every pixel on the finest level that improve its match."""
    _run(passes, "polish", size, size, matched, states, [], 0, 0, output, np.eye(3), False)


def _run(
    passes,
    entry,
    size,
    grid,
    matched,
    states,
    carried,
    level,
    number,
    output,
    most,
    is_known,
    lead=None,
) -> None:
    assert 2 * wgsl.load("flow/sweep.wgsl").constant("REFINED") <= SEEDS
    uniform = passes.uniform(
        "sweep.wgsl",
        "Sweep",
        color=number // 2 % 2,
        seed=SEEDS * (number + MOST_PASSES * level),
        reach=NEAR_BY * max(size),
        flow_step=STEP if level else FINEST_STEP,
        bend_step=BEND_STEP / 2**level,
        most_apart=MOST_APART if level else FINEST_APART,
        carried=len(carried),
        is_known=is_known,
        most=columns(most),
        lead_factor=0 if lead is None else round(max(size) / max(lead.size[:2])),
    )
    passes.run(
        "sweep.wgsl",
        entry,
        size,
        grid=grid,
        sweep=uniform,
        states=states,
        carried_near=carried[0] if carried else states,
        carried_far=carried[-1] if carried else states,
        costs=passes.costs.at_least(4 * size[0] * size[1]),
        output=output,
        lead=states if lead is None else lead,
        **matched,
    )
