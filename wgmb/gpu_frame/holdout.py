"""Holdout: removes the pixels that stay sharp before the method, and restores them after it."""

from __future__ import annotations

import wgpu

from .. import gpu
from ..gpu.textures import TexturePool

FILE = "gpu_frame/holdout.wgsl"
View = wgpu.GPUTextureView


class HoldoutPass:
    """Records wgsl/gpu_frame/holdout.wgsl around a method; keeps the textures in between."""

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool):
        self._device, self._images = device, images
        self._four = gpu.texel(device, 4)
        # One channel where it can be stored and filtered, four elsewhere.
        one = gpu.texel(device, 1)
        self._weight = one if one == "r32float" else self._four

    def before(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        color: View,
        holdout: View | None,
        which: str = "",
    ) -> tuple[View, View]:
        """The colour times its weight, and the weight, in textures of frame `which`."""
        weighted = self._images.view("weighted color" + which, bindings.size, self._four)
        weight = self._images.view("weight" + which, bindings.size, self._weight)
        self._kernel(holdout, self._four).run(
            encoder, "before", bindings,
            color=color, holdout=holdout, blurred=None, weight=weight, output=weighted,
        )  # fmt: skip
        return weighted, weight

    def after(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        color: View,
        holdout: View | None,
        blurred: View,
        output: View,
        texel: str,
    ) -> None:
        """Record `output`, of format `texel`: the result, with the holdouts put back."""
        self._kernel(holdout, texel).run(
            encoder, "after", bindings,
            color=color, holdout=holdout, blurred=blurred, weight=None, output=output,
        )  # fmt: skip

    def _kernel(self, holdout: View | None, texel: str) -> gpu.Kernel:
        texels = {"Output": texel, "Weight": self._weight}
        return gpu.kernel(self._device, FILE, texels, HOLDOUT=holdout is not None)
