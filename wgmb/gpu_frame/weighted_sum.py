"""Weighted sum of images: the cells of an exposure, or the pictures that an eye still sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import wgpu

from .. import gpu
from ..gpu.textures import KeptViews, ScratchBuffer

EIGHT = 8  # pictures that one pass takes


class WeightedSum:
    """Weighted sum of images on the GPU; pixels that are not finite count as 0."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._sums = device, ScratchBuffer(device)
        self._frame, self._views = gpu.SizeBindings(device), KeptViews()

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        pictures: Sequence[wgpu.GPUTexture],
        weights: np.ndarray,
        output: wgpu.GPUTexture,
        *,
        onto: bool = False,
    ) -> None:
        """Record it into `encoder`: float textures of one size, one weight each.

        `output`: rgba32float, of that size. `onto`: added to the sum of the call before.
        """
        width, height, _ = output.size
        bindings = self._frame((width, height))
        file = "gpu_frame/weighted_sum.wgsl"
        views = [self._views.of(picture) for picture in pictures]
        for first in range(0, len(views), EIGHT):
            begins = first == 0 and not onto
            shares = np.zeros(EIGHT, np.float32)
            shares[: len(views) - first] = weights[first : first + EIGHT]
            gpu.kernel(self._device, file, FIRST=begins).run(
                encoder,
                "main",
                bindings,
                share={"weights": shares.reshape(2, 4)},
                sums=self._sums.at_least(16 * width * height),
                output=self._views.of(output),
                **{f"picture{i}": views[min(first + i, len(views) - 1)] for i in range(EIGHT)},
            )
