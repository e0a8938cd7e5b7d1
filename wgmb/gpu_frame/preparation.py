"""Work around a method: motion is completed, and holdouts are taken out and put back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import wgpu

from .. import gpu
from ..gpu.textures import TexturePool
from .velocity import VelocityPass
from .views import FrameViews, View

FILE = "gpu_frame/holdout.wgsl"


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


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedFrame(FrameViews):
    """A frame as methods read it: `motion` is complete, `color` is multiplied by `weight`."""

    offset: int
    """-1, 0, 1: how far it is from the frame that is blurred [frame intervals]."""
    weight: View | None
    """Weight per pixel, 0..1; None: equal weights. Either all frames have one, or none."""
    by_camera: bool
    """The motion is the camera's alone: there are no vectors."""


class Preparation:
    """Records the passes before and after a method.

    `limited`: motion is clamped to the longest blur.
    """

    def __init__(self, images: TexturePool, velocity: VelocityPass, limited: bool):
        self._images, self._velocity, self._limited = images, velocity, limited
        self._holdout = HoldoutPass(images.device, images)

    def encode_motion(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        frame: FrameViews,
        output: View,
    ) -> None:
        """Record to_prev and to_next [px] into `output`."""
        self._velocity.encode(encoder, bindings, frame, self._limited, output)

    def frames(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        views: Sequence[tuple[int, FrameViews]],
    ) -> tuple[PreparedFrame, ...]:
        """Record the inputs of methods: `views` are the frame that is blurred and its
        neighbours, each after its offset. If one of them is masked, all have weights."""
        masked = any(frame.holdout is not None or frame.check for _, frame in views)
        return tuple(
            self._frame(encoder, bindings, frame, offset, masked) for offset, frame in views
        )

    def _frame(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        frame: FrameViews,
        offset: int,
        masked: bool,
    ) -> PreparedFrame:
        motion = frame.motion
        if not frame.has_plain_motion or self._limited or frame.check:
            motion = self._images.view(f"motion {offset}", bindings.size, "rgba32float")
            self.encode_motion(encoder, bindings, frame, motion)
        color, weight = frame.color, None
        if masked:
            color, weight = self._holdout.before(
                encoder, bindings, color, frame.holdout, f" {offset}"
            )
        by_camera = frame.camera is not None and not frame.has_vectors
        changed = {"color": color, "motion": motion, "offset": offset, "weight": weight}
        return PreparedFrame(**vars(frame) | changed, by_camera=by_camera)

    def put_back(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        frame: FrameViews,
        blurred: View,
        output: View,
        texel: str,
    ) -> None:
        """Record `output`, of format `texel`: the blurred frame with its holdouts."""
        self._holdout.after(encoder, bindings, frame.color, frame.holdout, blurred, output, texel)
