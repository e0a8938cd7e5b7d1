"""Output frames that input frames share: each is blurred over its cell, and all are summed."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import wgpu

from . import gpu
from .exposure import Cell
from .frame import Frame
from .gpu.textures import TexturePool
from .observer import EIGHT, WeightedSum
from .pipeline import Blur

_TEXEL = "rgba32float"


class Exposer:
    """Makes one picture of the cells of an exposure (see exposure.py), on the Blur's device.

    A cell whose frame has no motion, or whose shutter is closed, counts as it is.
    """

    def __init__(self, blur: Blur):
        self.blur = blur
        self._images = TexturePool(blur.device)
        self._sum = WeightedSum(blur.device)

    def __call__(self, parts: Sequence[tuple[Cell, Frame]]) -> np.ndarray:
        """(height, width, 3 or 4) float32, linear: the exposure of these frames by their cells."""
        channels = parts[0][1].color.shape[2]
        texture = self.texture(parts)
        encoder = self.blur.device.create_command_encoder(label="exposure")
        return self._images.download(encoder, texture)[..., :channels]

    def texture(self, parts: Sequence[tuple[Cell, Frame]]) -> wgpu.GPUTexture:
        """The same as a texture, rgba32float, which the next call overwrites."""
        size, device = parts[0][1].size, self.blur.device
        output = self._images.texture("exposure", size, _TEXEL)
        moving = any(_moves(*part) for part in parts)
        at_once = 2 if moving else EIGHT  # pictures that are on the GPU
        for first in range(0, len(parts), at_once):
            some = parts[first : first + at_once]
            pictures = [self._picture(f"part {i}", *part) for i, part in enumerate(some)]
            shares = np.array([cell.share for cell, _ in some], np.float32)
            encoder = device.create_command_encoder(label="exposure")
            self._sum.encode(encoder, pictures, shares, output, onto=first > 0)
            gpu.submit(device, encoder)
        return output

    def _picture(self, name: str, cell: Cell, frame: Frame) -> wgpu.GPUTexture:
        if not _moves(cell, frame):
            color = frame.color
            if color.shape[2] == 3:
                color = np.concatenate([color, np.ones_like(color[..., :1])], axis=2)
            texel = "rgba16float" if color.dtype == np.float16 else _TEXEL
            self._images.upload(f"{name} sharp", color, texel)
            return self._images.texture(f"{name} sharp", frame.size, texel)
        self.blur.shutter = cell.shutter
        texture = self._images.texture(name, frame.size, self.blur.output)
        self.blur.draw(frame, texture.create_view())
        return texture


def _moves(cell: Cell, frame: Frame) -> bool:
    return "motion" in frame.has and cell.shutter.degrees > 0
