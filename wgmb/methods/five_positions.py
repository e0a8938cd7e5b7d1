"""Continue paths beyond the three positions that a frame's own vectors lead to."""

from __future__ import annotations

from collections.abc import Sequence

import wgpu

from .. import gpu
from ..gpu.textures import TexturePool
from .contract import Inputs, PreparedFrame, View


class Bends:
    """A word per pixel and frame; see trajectory_with() of wgsl/common/trajectory5.wgsl."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)

    def encode(
        self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, frames: Sequence[PreparedFrame]
    ) -> list[View]:
        """Record the bends of these frames of the inputs; returns them in the same order."""
        by_offset = {frame.offset: frame for frame in inputs.frames}
        made = []
        for frame in frames:
            bends = self._images.view(f"bends {frame.offset}", inputs.bindings.size, "r32uint")
            around = {"prev": by_offset.get(frame.offset - 1),
                      "next": by_offset.get(frame.offset + 1)}  # fmt: skip
            read = {"motion": frame.motion, "depth": frame.depth} | {
                f"{side}_{name}": getattr(other, name, None)
                for side, other in around.items()
                for name in ("motion", "depth")
            }
            kernel = gpu.kernel(self._device, "methods/five_positions.wgsl", read)
            kernel.run(encoder, "main", inputs.bindings, bends=bends, **read)
            made.append(bends)
        return made
