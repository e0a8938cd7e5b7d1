"""Active tiles: those with motion in or near them. The others are copied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import ScratchBuffer


def grid_of(size: tuple[int, int]) -> tuple[int, int]:
    """Tiles across and down an image of `size` [px]."""
    side = int(wgsl.load("methods/gather/surface.wgsl").constant("TILE"))
    return -(-size[0] // side), -(-size[1] // side)


def uniform(device: wgpu.GPUDevice, name: str, data: np.ndarray) -> wgpu.GPUBuffer:
    """A uniform buffer that holds the struct `data`."""
    return gpu.constant(device, name, data)


class ActiveTiles:
    """Worklists of cells, a cell being a few tiles side by side.

    `at_edges`: only tiles that the edges of the frame's own motion reach are active.
    """

    def __init__(self, device: wgpu.GPUDevice, at_edges: bool = False):
        self._device, self._lists = device, ScratchBuffer(device)
        self._at_edges = at_edges

    def encode(self, encoder, inputs) -> dict[str, dict]:
        """Record which tiles are active; the worklists of active_tiles.wgsl, by name."""
        file = "methods/gather/tiles/active_tiles.wgsl"
        kernel = gpu.kernel(self._device, file)
        grid = grid_of(inputs.bindings.size)
        words = -(-(grid[0] * grid[1] + int(kernel.source.constant("CELLS_WORD"))) // 64) * 64
        size = 4 * words * int(kernel.source.constant("SECTIONS"))
        lists = self._lists.at_least(size)
        encoder.clear_buffer(lists)
        data = np.zeros((), kernel.source.dtype("SourceFrame"))
        data["words"] = words
        tiles = replace(inputs.bindings, size=grid)
        for frame in inputs.frames[:1] if self._at_edges else inputs.frames:
            data["offset"] = frame.offset
            own = {
                "source": uniform(self._device, "source", data),
                "motion": frame.motion,
                "lists": lists,
            }
            texels = {"motion": gpu.stored(frame.motion)}
            marking = gpu.kernel(self._device, file, texels, AT_EDGES=self._at_edges)
            marking.run(encoder, "mark_active_tiles", tiles, **own)
        kernel.run(encoder, "find_distances", tiles, **own)
        kernel.run(encoder, "build_worklists", replace(inputs.bindings, size=(grid[1], 1)), **own)
        return {
            name: {
                "buffer": lists,
                "offset": 4 * words * int(kernel.source.constant(name.upper())),
                "size": 4 * words,
            }
            for name in ("active", "static", "separated", "motion_only", "flagged")
        }
