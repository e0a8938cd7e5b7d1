"""Sweeps over a frame's states: every pixel tries those of others, and variations of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import wgpu

from ..gpu import wgsl
from .homography import columns
from .passes import STATES, Bindings, FlowPasses

NEAR_BY = 0.05  # of the longer side: how far off random pixels are tried
STEP, FINEST_STEP = 1.0, 2.0  # greatest random change [px], on coarse levels and the finest
BEND_STEP = 2.0  # the same of the bend, in pixels of the finest level
MOST_APART, FINEST_APART = 1.0, 2.0  # differences beyond this [px] cost no more
PASSES = 4  # of a sweep
SEEDS = 64  # random numbers that a pass may take for a pixel
MOST_PASSES = 1000  # on one level


@dataclass(frozen=True)
class SweptLevel:
    """The fixed part of the sweeps over one level of a frame.

    `matched`: the bindings of match.wgsl; `carried`: the near frame's states, and the far one's;
    `most`: the homography of most of the picture to the near frame, on this level; `lead`: the
    lead of the guide, see `follow_guide`.
    """

    number: int
    size: tuple[int, int]
    matched: Bindings
    carried: list[wgpu.GPUTexture]
    most: np.ndarray
    lead: wgpu.GPUTexture | None = None


def sweep(
    passes: FlowPasses, level: SweptLevel, states: wgpu.GPUTexture, count: int
) -> wgpu.GPUTexture:
    """New states after `count` sweeps; the given ones are taken back."""
    after = passes.take(level.size, STATES)
    for number in range(PASSES * count):
        is_known = number not in (0, 2)  # the first of a colour finds out what its states cost
        half_sweep(passes, level, number, states, after, is_known)
        states, after = after, states
    passes.give(after)
    return states


def half_sweep(
    passes: FlowPasses,
    level: SweptLevel,
    number: int,
    states: wgpu.GPUTexture,
    output: wgpu.GPUTexture,
    is_known: bool = False,
) -> None:
    """Pass `number` of the sweeps: one colour of the chessboard, propagated or refined.

    `is_known`: the costs of this colour's states are in `passes.costs`, from an earlier pass.
    """
    entry = "refine" if number % 2 else "propagate"
    grid = -(-level.size[0] // 2), level.size[1]
    _run(passes, entry, level, grid, number, states, output, is_known)


def polish(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    states: wgpu.GPUTexture,
    output: wgpu.GPUTexture,
) -> None:
    """Steps of every pixel on the finest level that improve its match."""
    finest = SweptLevel(0, size, matched, [], np.eye(3))
    _run(passes, "polish", finest, size, 0, states, output, False)


def _run(
    passes: FlowPasses,
    entry: str,
    level: SweptLevel,
    grid: tuple[int, int],
    number: int,
    states: wgpu.GPUTexture,
    output: wgpu.GPUTexture,
    is_known: bool,
) -> None:
    assert 2 * wgsl.load("flow/sweep.wgsl").constant("REFINED") <= SEEDS
    size, carried, lead = level.size, level.carried, level.lead
    uniform = passes.uniform(
        "sweep.wgsl",
        "Sweep",
        color=number // 2 % 2,
        seed=SEEDS * (number + MOST_PASSES * level.number),
        reach=NEAR_BY * max(size),
        flow_step=STEP if level.number else FINEST_STEP,
        bend_step=BEND_STEP / 2**level.number,
        most_apart=MOST_APART if level.number else FINEST_APART,
        carried=len(carried),
        is_known=is_known,
        most=columns(level.most),
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
        **level.matched,
    )
