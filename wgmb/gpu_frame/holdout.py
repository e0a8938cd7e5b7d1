"""Holdout: removes the pixels that stay sharp before the method, and restores them after it."""

from __future__ import annotations

import wgpu

from .. import gpu
from ..gpu.textures import TexturePool

FILE = "gpu_frame/holdout.wgsl"
View = wgpu.GPUTextureView


class HoldoutPass:
    """Records wgsl/gpu_frame/holdout.wgsl around a method; keeps the textures in between."""

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool, none: View):
        self._device, self._images, self._none = device, images, none
        self._four = gpu.texel(device, 4)
        # One channel where it can be stored and filtered, four elsewhere.
        one = gpu.texel(device, 1)
        self._weight = one if one == "r32float" else self._four

    def before(
        self,
        encoder,
        bindings: gpu.FrameBindings,
        color: View,
        holdout: View | None,
        which: str = "",
    ):
        """The colour times its weight, and the weight, in textures of frame `which`."""
        weighted = self._images.view("weighted color" + which, bindings.size, self._four)
        weight = self._images.view("weight" + which, bindings.size, self._weight)
        self._run(
            "before",
            encoder,
            bindings,
            color,
            holdout,
            self._none,
            weight,
            weighted,
            self._four,
        )
        return weighted, weight

    def after(
        self,
        encoder,
        bindings,
        color: View,
        holdout: View | None,
        blurred,
        output,
        texel: str,
    ):
        """Record `output`, of format `texel`: the result, with what was held out put back."""
        spare = self._images.view("spare", (1, 1), self._weight)
        self._run("after", encoder, bindings, color, holdout, blurred, spare, output, texel)

    def _run(
        self, entry, encoder, bindings, color, holdout, blurred, weight, output, texel
    ) -> None:
        texels = {"Output": texel, "Weight": self._weight}
        kernel = gpu.kernel(self._device, FILE, texels, HOLDOUT=holdout is not None)
        kernel.run(
            encoder,
            entry,
            bindings,
            color=color,
            holdout=holdout or self._none,
            blurred=blurred,
            weight=weight,
            output=output,
        )
