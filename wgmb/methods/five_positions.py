"""Continue paths beyond the three positions that a frame's own vectors lead to."""

from __future__ import annotations

from collections.abc import Sequence

from .. import gpu
from ..gpu.textures import TexturePool
from .contract import Inputs, PreparedFrame, View


class Bends:
    """A word per pixel and frame; see trajectory_with() of wgsl/common/trajectory5.wgsl."""

    def __init__(self, device):
        self._device, self._images = device, TexturePool(device)

    def encode(self, encoder, inputs: Inputs, frames: Sequence[PreparedFrame]) -> list[View]:
        """Record the bends of these frames of the inputs; returns them in the same order."""
        by_offset = {frame.offset: frame for frame in inputs.frames}
        made = []
        for frame in frames:
            bends = self._images.view(f"bends {frame.offset}", inputs.bindings.size, "r32uint")
            around = {"prev": by_offset.get(frame.offset - 1),
                      "next": by_offset.get(frame.offset + 1)}  # fmt: skip
            others = {
                f"{side}_{name}": getattr(other, name, None) or inputs.unbound
                for side, other in around.items()
                for name in ("motion", "depth")
            }
            read = others | {"motion": frame.motion, "depth": frame.depth or inputs.unbound}
            texels = {name: gpu.stored(view) for name, view in read.items()}
            kernel = gpu.kernel(self._device, "methods/five_positions.wgsl", texels)
            kernel.run(encoder, "main", inputs.bindings, bends=bends, **read)
            made.append(bends)
        return made

    @property
    def unbound(self) -> View:
        """Bound where there are none."""
        return self._images.view("no bends", (1, 1), "r32uint")
