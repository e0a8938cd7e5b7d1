"""States of a frame carried along their flow into its neighbour, as guesses there."""

from __future__ import annotations

import wgpu

from ..gpu import wgsl
from .passes import STATES, Bindings, FlowPasses


def carry(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    states: wgpu.GPUTexture,
    along: float,
    turn: float,
) -> wgpu.GPUTexture:
    """States as seen from the neighbour; no motion where nothing lands.

    `matched`: the bindings of match.wgsl for the frame that the states are of. `along`: 1 if
    their flow leads to the neighbour, -1 if its continuation does. `turn`: -1 if the neighbour's
    own flow leads back, 1 if it leads on.
    """
    item = wgsl.load("flow/carry.wgsl").dtype("Landing").itemsize
    output = passes.take(size, STATES)
    own = {
        "carry": passes.uniform("carry.wgsl", "Carry", along=along, turn=turn),
        "states": states,
        "landings": passes.landings.at_least(item * size[0] * size[1]),
        "output": output,
    }
    for entry in ("clear", "claim", "settle", "fetch"):
        passes.run("carry.wgsl", entry, size, **own, **matched)
    return output
