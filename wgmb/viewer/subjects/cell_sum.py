"""The exposure of a video's picture from frames on the CPU, of which the viewer keeps many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import wgpu

from ... import gpu
from ...exposure import Cell
from ...frame import Frame
from ...gpu.textures import TexturePool
from ...gpu_frame.weighted_sum import WeightedSum
from ...pipeline.blur import Blur

_AT_ONCE = 2  # pictures that are on the GPU


class PictureCellSum:
    """Blurs frames over their cells, and adds them by their shares."""

    def __init__(self, blur: Blur):
        self.blur = blur
        self._images, self._sum = TexturePool(blur.device), WeightedSum(blur.device)

    def draw(self, parts: Sequence[tuple[Cell, Frame]], output: wgpu.GPUTexture) -> None:
        """Draw the exposure into `output`, rgba32float.

        A cell whose frame has no motion, or whose shutter is closed, counts as it is.
        """
        for first in range(0, len(parts), _AT_ONCE):
            some = parts[first : first + _AT_ONCE]
            pictures = [self._picture(f"part {i}", *part) for i, part in enumerate(some)]
            shares = np.array([cell.share for cell, _ in some], np.float32)
            encoder = self.blur.device.create_command_encoder(label="exposure")
            self._sum.encode(encoder, pictures, shares, output, onto=first > 0)
            gpu.submit(self.blur.device, encoder)

    def _picture(self, name: str, cell: Cell, frame: Frame) -> wgpu.GPUTexture:
        if "motion" not in frame.has or cell.shutter.degrees <= 0:
            color = frame.color
            if color.shape[2] == 3:
                color = np.concatenate([color, np.ones_like(color[..., :1])], axis=2)
            texel = "rgba16float" if color.dtype == np.float16 else "rgba32float"
            self._images.upload(f"{name} sharp", color, texel)
            return self._images.texture(f"{name} sharp", frame.size, texel)
        self.blur.shutter = cell.shutter
        texture = self._images.texture(name, frame.size, self.blur.output)
        self.blur.draw(frame, texture.create_view())
        return texture
