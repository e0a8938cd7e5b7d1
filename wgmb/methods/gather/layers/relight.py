"""Relights pixels borrowed from a neighbouring frame, where the frame hides the surface."""

from __future__ import annotations

import math

import wgpu

from .... import gpu
from ....gpu.textures import ScratchBuffer
from ...contract import Inputs, PreparedFrame, View
from ..tiles.active_tiles import grid_of


class Relight:
    """Corrects the front layer of a neighbour by the ratio of light beside the hidden surface."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device = device
        self._hidden, self._groups = ScratchBuffer(device), ScratchBuffer(device)
        self._changes = ScratchBuffer(device)
        self._gains = {-1: ScratchBuffer(device), 1: ScratchBuffer(device)}

    def gains(self, size: tuple[int, int], offset: int) -> wgpu.GPUBuffer:
        """The gain of every pixel of a neighbour, as `encode` finds it."""
        return self._gains[offset].at_least(4 * size[0] * size[1])

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        frame: PreparedFrame,
        surfaces: tuple[View, View],
        relit: View,
        cells: gpu.BufferPart,
    ) -> None:
        """Record it for the neighbour `frame`, in the worklist `cells`.

        `surfaces`: the front surfaces of the frame itself, whose edges need not be separated yet,
        and of the neighbour. `relit`: the neighbour's front layer, which has its colours.
        """
        own = inputs.frame
        kernel = gpu.kernel(
            self._device,
            "methods/gather/layers/relight.wgsl",
            {"Color": relit.texture.format, "color": frame.color, "own_texels": own.color},
            WEIGHTED=frame.weight is not None,
        )
        own_surface, front_surface = surfaces
        size = inputs.bindings.size
        side = kernel.source.integer("SQUARE")
        squares = math.ceil(size[0] / side) * math.ceil(size[1] / side)
        hidden = self._hidden.at_least(4 + 8 * squares)
        changes = self._changes.at_least(8 * math.prod(grid_of(size)))
        encoder.clear_buffer(hidden)
        encoder.clear_buffer(changes)
        encoder.clear_buffer(gains := self.gains(size, int(frame.offset)))
        groups = {"buffer": self._groups.at_least(16), "offset": 0, "size": 16}
        # Only pixels that the frame hides are relit, and only near tiles in which light changes:
        # the first pass lists them, the last one scales their light by the ratio seen beside them.
        passes: tuple[tuple[str, tuple[int, int] | gpu.BufferPart], ...] = (
            ("find_hidden", cells),
            ("spread_changes", grid_of(size)),
            ("size_dispatch", (1, 1)),
            ("relight", groups),
        )
        for entry, over in passes:
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                over,
                source={"offset": frame.offset},
                color=frame.color,
                weight=frame.weight,
                front_surface=front_surface,
                own_color=own.color,
                own_texels=own.color,
                own_weight=own.weight,
                own_surface=own_surface,
                worklist=cells,
                hidden=hidden,
                groups=groups if entry == "size_dispatch" else None,
                changes=changes,
                gains=gains,
                relit=relit,
                linear=inputs.linear,
            )
