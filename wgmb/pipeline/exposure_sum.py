"""Output frames that input frames share: each is blurred over its cell, and all are summed."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import wgpu

from .. import gpu
from ..exposure import Cell
from ..gpu.textures import TexturePool
from ..gpu_frame.views import FrameInShot
from ..gpu_frame.weighted_sum import WeightedSum
from .blur import Blur

_AT_ONCE = 2  # pictures that are summed in one pass


class ExposureSum:
    """Makes one picture of the cells of an exposure (see exposure.py), on the Blur's device.

    A cell whose frame has no motion, or whose shutter is closed, counts as it is.
    """

    def __init__(self, blur: Blur):
        self.blur = blur
        self._images = TexturePool(blur.device)
        self._sum = WeightedSum(blur.device)

    def texture(
        self, size: tuple[int, int], parts: Iterable[tuple[Cell, FrameInShot]]
    ) -> wgpu.GPUTexture:
        """The exposure of pictures of `size` (width, height): linear light, rgba32float.

        The next call overwrites it.
        """
        output = self._images.texture("exposure", size, "rgba32float")
        waiting: list[tuple[float, wgpu.GPUTexture]] = []
        begun = False
        with gpu.reported(size):
            for cell, shown in parts:
                waiting.append((cell.share, self._picture(f"part {len(waiting)}", cell, shown)))
                if len(waiting) == _AT_ONCE:
                    self._add(waiting, output, begun)
                    begun, waiting = True, []
            if waiting:
                self._add(waiting, output, begun)
        return output

    def _add(
        self, waiting: list[tuple[float, wgpu.GPUTexture]], output: wgpu.GPUTexture, onto: bool
    ) -> None:
        encoder = self.blur.device.create_command_encoder(label="exposure")
        shares = np.array([share for share, _ in waiting], np.float32)
        self._sum.encode(encoder, [texture for _, texture in waiting], shares, output, onto=onto)
        gpu.submit(self.blur.device, encoder)

    def _picture(self, name: str, cell: Cell, shown: FrameInShot) -> wgpu.GPUTexture:
        frame = shown.frame
        if not frame.has_vectors or cell.shutter.degrees <= 0:
            return frame.color.texture
        self.blur.shutter = cell.shutter
        texture = self._images.texture(name, frame.size, self.blur.output)
        encoder = self.blur.device.create_command_encoder(label="cell")
        self.blur.encode(
            encoder,
            frame,
            texture.create_view(),
            prev=shown.prev,
            next=shown.next,
            number=shown.number,
        )
        gpu.submit(self.blur.device, encoder)
        return texture
