"""Sweeps over a frame's states: every pixel tries those of others, and variations of its own."""

from __future__ import annotations

import wgpu

from ..gpu import wgsl
from .passes import STATES, Passes

NEAR_BY = 0.05  # of the longer side: how far off random pixels are tried
FLOW_STEP, FINEST_STEP = 1.0, 2.0  # greatest random change [px], on coarse levels and the finest
BEND_STEP = 2.0  # the same of the bend, in pixels of the finest level
MOST_APART, FINEST_APART = 1.0, 2.0  # differences beyond this [px] cost no more
SEEDS = 64  # random numbers that a pass may take for a pixel


def sweep(
    passes: Passes,
    size: tuple[int, int],
    matched: dict,
    states: wgpu.GPUTexture,
    carried: list[wgpu.GPUTexture],
    level: int,
    count: int,
) -> wgpu.GPUTexture:
    """New states after `count` sweeps; the given ones are taken back.

    `matched`: the bindings of match.wgsl; `carried`: the near frame's states, and the far one's.
    """
    source = wgsl.load("flow/sweep.wgsl")
    assert 2 * source.constant("REFINED") <= SEEDS
    half = -(-size[0] // 2), size[1]
    after = passes.take(size, STATES)
    for number in range(4 * count):
        turn, entry = number // 2, ("propagate", "refine")[number % 2]
        values = {
            "color": turn % 2,
            "seed": SEEDS * (number + 1000 * level),
            "reach": NEAR_BY * max(size),
            "flow_step": FLOW_STEP if level else FINEST_STEP,
            "bend_step": BEND_STEP / 2**level,
            "most_apart": MOST_APART if level else FINEST_APART,
            "carried": len(carried),
        }
        passes.run(
            "sweep.wgsl",
            entry,
            size,
            grid=half,
            sweep=passes.uniform("sweep.wgsl", "Sweep", **values),
            states=states,
            carried_near=carried[0] if carried else states,
            carried_far=carried[-1] if carried else states,
            output=after,
            **matched,
        )
        states, after = after, states
    passes.give(after)
    return states
