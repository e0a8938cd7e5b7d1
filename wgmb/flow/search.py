"""The first states: a full search on the coarsest level."""

from __future__ import annotations

import numpy as np
import wgpu

from ..gpu import wgsl
from ..gpu.textures import ScratchBuffer
from .dominant import ACROSS, spaced
from .passes import STATES, Bindings, FlowPasses

REACH = 0.2  # of the longer side: the longest displacement along an axis


class FullSearch:
    """The best whole displacement of every block of pixels; `block`: its side [px]."""

    def __init__(self, passes: FlowPasses, block: int):
        self._passes, self._block = passes, block
        self._best = ScratchBuffer(passes.device)

    def __call__(
        self, size: tuple[int, int], matched: Bindings
    ) -> tuple[wgpu.GPUTexture, np.ndarray, np.ndarray]:
        """States of a frame on its coarsest level; `matched`: the bindings of match.wgsl.

        Also, for a few pixels, their centres (count, 2) [px] and (count, 4) the displacements to
        the near frame and to the far one that match best, each by itself.
        """
        source = wgsl.load("flow/full_search.wgsl")
        block, columns = self._block, int(source.constant("COLUMNS"))
        bound = matched | {"constants": matched["constants"] | {"BLOCK": block}}
        blocks = -(-size[0] // block), -(-size[1] // block)
        most = max(1, round(REACH * max(size)))
        output = self._passes.take(size, STATES)
        spare = self._passes.take((1, 1), STATES)
        best = self._best.at_least(source.dtype("Best").itemsize * blocks[0] * blocks[1])

        # Short displacements first: what follows is refused sooner.
        firsts = sorted(range(-most, most + 1, columns), key=lambda n: abs(n + columns // 2))

        def run(entry: str, grid: tuple[int, int], first: int, states: wgpu.GPUTexture) -> None:
            reach = self._passes.uniform(
                "full_search.wgsl",
                "Reach",
                most=most,
                first=first,
                blocks=blocks,
                begins=first == firsts[0],
            )
            self._passes.run(
                "full_search.wgsl",
                entry,
                size,
                grid=grid,
                reach=reach,
                best=best,
                output=states,
                **bound,
            )

        for first in firsts:
            run("search", blocks, first, spare)
        run("write_states", size, 0, output)
        few = min(blocks[0], ACROSS), min(blocks[1], ACROSS)
        ways = self._passes.take(few, STATES)
        run("write_ways", few, 0, ways)
        found = self._passes.read(ways).reshape(-1, 4)
        self._passes.give(spare, ways)
        centres = np.minimum(block * spaced(few, blocks), np.array(size) - 1) + 0.5
        return output, centres, found
