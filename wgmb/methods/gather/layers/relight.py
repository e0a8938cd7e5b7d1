"""The light of a neighbour made that of the frame, where the frame hides what it is taken for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import wgpu

from .... import gpu
from ....gpu.textures import ScratchBuffer
from ..tiles.active_tiles import grid_of, uniform


class Relight:
    """Corrects the front layer of a neighbour by the ratio of light beside what is hidden."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device = device
        self._hidden, self._groups = ScratchBuffer(device), ScratchBuffer(device)
        self._changes, self._unused = ScratchBuffer(device), ScratchBuffer(device)
        self._gains = {-1: ScratchBuffer(device), 1: ScratchBuffer(device)}

    def gains(self, size: tuple[int, int], offset: int) -> wgpu.GPUBuffer:
        """The gain of every pixel of a neighbour, as `encode` finds it."""
        return self._gains[offset].at_least(4 * size[0] * size[1])

    def encode(self, encoder, inputs, frame, surfaces, relit: wgpu.GPUTextureView, cells: dict):
        """Record it for the neighbour `frame`, in the worklist `cells`.

        `surfaces`: the front surfaces of the frame itself, whose edges need not be separated yet,
        and of the neighbour. `relit`: the neighbour's front layer, which has its colours.
        """
        kernel = gpu.kernel(
            self._device,
            "methods/gather/layers/relight.wgsl",
            {
                "Color": relit.texture.format,
                "color": gpu.stored(frame.color),
                "own_texels": gpu.stored(inputs.frame.color),
            },
            WEIGHTED=frame.weight is not None,
        )
        data = np.zeros((), kernel.source.dtype("RelitFrame"))
        data["offset"] = frame.offset
        own, front = surfaces
        size = inputs.bindings.size
        side = int(kernel.source.constant("SQUARE"))
        squares = math.ceil(size[0] / side) * math.ceil(size[1] / side)
        hidden = self._hidden.at_least(4 + 8 * squares)
        changes = self._changes.at_least(8 * math.prod(grid_of(size)))
        encoder.clear_buffer(hidden)
        encoder.clear_buffer(changes)
        encoder.clear_buffer(gains := self.gains(size, int(frame.offset)))
        groups = {"buffer": self._groups.at_least(16), "offset": 0, "size": 16}
        for entry, indirect, over in (
            ("find_hidden", cells, size),
            ("spread_changes", None, grid_of(size)),
            ("size_dispatch", None, (1, 1)),
            ("relight", groups, size),
        ):
            sizing = entry == "size_dispatch"
            kernel.run(
                encoder,
                entry,
                replace(inputs.bindings, size=over),
                indirect,
                source=uniform(self._device, "source", data),
                color=frame.color,
                weight=frame.weight or inputs.unbound,
                front_surface=front,
                own_color=inputs.frame.color,
                own_texels=inputs.frame.color,
                own_weight=inputs.frame.weight or inputs.unbound,
                own_surface=own,
                worklist=cells,
                hidden=hidden,
                groups=groups if sizing else self._unused.at_least(16),
                changes=changes,
                gains=gains,
                relit=relit,
                linear=inputs.linear,
            )
