"""Active tiles: those with motion in or near them. The others are copied."""

from __future__ import annotations

from typing import Any

import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import ScratchBuffer
from ...contract import Inputs


def grid_of(size: tuple[int, int]) -> tuple[int, int]:
    """Tiles across and down an image of `size` [px]."""
    side = wgsl.load("methods/gather/surface.wgsl").integer("TILE")
    return -(-size[0] // side), -(-size[1] // side)


class ActiveTiles:
    """Worklists of cells, a cell being a few tiles side by side.

    `at_edges`: only tiles that the edges of the frame's own motion reach are active.
    """

    def __init__(self, device: wgpu.GPUDevice, at_edges: bool = False):
        self._device, self._lists = device, ScratchBuffer(device)
        self._at_edges = at_edges

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs) -> dict[str, gpu.BufferPart]:
        """Record which tiles are active; the worklists of active_tiles.wgsl, by name."""
        file = "methods/gather/tiles/active_tiles.wgsl"
        kernel = gpu.kernel(self._device, file)
        grid = grid_of(inputs.bindings.size)
        words = -(-(grid[0] * grid[1] + kernel.source.integer("CELLS_WORD")) // 64) * 64
        size = 4 * words * kernel.source.integer("SECTIONS")
        lists = self._lists.at_least(size)
        encoder.clear_buffer(lists)
        # Tiles in which something moves in any frame that is read.
        own: dict[str, Any] = {}
        for frame in inputs.frames[:1] if self._at_edges else inputs.frames:
            own = {
                "source": {"words": words, "offset": frame.offset},
                "motion": frame.motion,
                "lists": lists,
            }
            marking = gpu.kernel(
                self._device, file, {"motion": frame.motion}, AT_EDGES=self._at_edges
            )
            marking.run(encoder, "mark_active_tiles", inputs.bindings, grid, **own)
        # What moves reaches the tiles around it: these are active too, and go into the lists.
        kernel.run(encoder, "find_distances", inputs.bindings, grid, **own)
        kernel.run(encoder, "build_worklists", inputs.bindings, (grid[1], 1), **own)
        return {
            name: {
                "buffer": lists,
                "offset": 4 * words * kernel.source.integer(name.upper()),
                "size": 4 * words,
            }
            for name in ("active", "static", "separated", "motion_only", "flagged")
        }
