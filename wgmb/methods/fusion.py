"""Weighted fusion: samples along the motion, mixed with the sharp picture by facing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import wgpu

from .. import gpu
from ..camera import Camera, Reprojections
from ..extent import Spread
from ..gpu.textures import TexturePool
from .contract import Inputs, View
from .options import MethodOptions, Range


class Fusion:
    """Mix a fading trail with the sharp picture, less of it on faces that lead (Chen 2016).

    S. Chen, "Post-Processing Blur Algorithm Based on GPU", Computer Systems & Applications
    (doi 10.15888/j.cnki.csa.005366). Equation numbers are that paper's.

    Which face (4, 5, 6): a surface whose normal is under 90 degrees from its motion leads; it
    should stay nearly sharp and has the factor `alpha_front`. All others, also those at a right
    angle, which the paper leaves open, trail: `alpha_back`. The motion is the pixel's in the
    picture; along the view axis it counts as 0, for image motion does not say more. The
    normal is `Frame.normal` (in the world) if there is a camera to turn it by; else the depth's
    slope says the same, whatever the field of view: a surface faces where it recedes.

    Samples (7): `samples` along the motion (the paper's number is 8), from the picture through a
    separable Gaussian, whose matrix the paper does not print: 1 2 1 either way.

    Fusion (8): R(0) is the sharp colour, R(1) to R(N) the samples in their order of time, newer
    ones weighing more by 1 / `tau`, 0 < tau <= 1. The printed weights are 1 for R(0) and
    alpha (1 - tau) tau^(N - n) for R(n). They sum to 1 + alpha (1 - tau^N): pictures become
    brighter, and a greater alpha means more trail, while the text and figure 5 say that a
    greater alpha means less. tau is not given.

    `weights`: "published" are those of (8) as printed; tau is 0.5 unless given.
    "normalised" sum to 1 and follow the text: the trail has the smaller of the two alphas over
    the surface's own as its share (0.04 / 0.08 in front, all of it behind), R(0) the rest; tau
    is 1 unless given, the limit in which all samples weigh alike.
    `variant`: "shutter" spreads the samples over the exposure, at equal shares of it; R(0) is
    seen at its middle, and within a streak of 1 px the trail turns into R(0). "published"
    steps over half the way from the previous place, whatever the shutter.
    A pixel that stands still has no samples (N = 0): it stays as it is, in every variant.
    `alpha_front`, `alpha_back`: over 0 and at most 1; the paper tries 0.02 to 0.10.

    Strong: as cheap as taps; fast things keep a recognisable leading side. Artefacts: those
    of taps; a ghost of the sharp picture on leading faces, with an edge where facing changes;
    with the printed weights hardly any blur, and moving objects shine.
    """

    name = "fusion"
    needs = frozenset({"color", "motion", "depth"})
    uses = frozenset({"normal"})
    spread: Spread = "nowhere"
    samples = 8

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """Sample positions and weights."""

        variant: Annotated[
            Literal["shutter", "published"],
            "samples over the exposure, or from the previous position, ignoring the shutter",
        ] = "shutter"
        weights: Annotated[Literal["normalised", "published"], "normalised to 1, or as printed"] = (
            "normalised"
        )
        alpha_front: Annotated[
            float, Range(0, 1, above=True), "factor of leading faces; more blurs them less"
        ] = 0.08
        alpha_back: Annotated[float, Range(0, 1, above=True), "factor of all other faces"] = 0.04
        tau: Annotated[
            float | None,
            Range(0, 1, above=True),
            "ratio of a sample's weight to the next newer one's; default 1, published 0.5",
        ] = None

    def __init__(self, device: wgpu.GPUDevice, options: Options, *, output: str = "rgba32float"):
        self._device, self._output = device, output
        self._published = options.variant == "published"
        self._printed = options.weights == "published"
        self._tau = options.tau if options.tau is not None else 0.5 if self._printed else 1.0
        self._alphas = options.alpha_front, options.alpha_back
        self._images = TexturePool(device)

    def repeats(self, inputs: Inputs) -> bool:
        """See `Method`. A camera is written into a constant."""
        return inputs.frame.camera is None

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record the Gaussian's two passes, for weights too, and the fusion."""
        camera: Reprojections | None = inputs.frame.camera
        turned = camera is not None and camera.here.view_from_world is not None
        soft = self._filtered(encoder, inputs, inputs.frame.color, "color")
        soft_weight = None
        if inputs.frame.weight is not None:
            soft_weight = self._filtered(encoder, inputs, inputs.frame.weight, "weight")
        kernel = gpu.kernel(
            self._device,
            "methods/fusion.wgsl",
            {"Output": self._output},
            BOX_SHUTTER=inputs.even,
            NORMALS=turned and inputs.frame.normal is not None,
            WEIGHTED=soft_weight is not None,
            PUBLISHED=self._published,
        )
        powers = self._tau ** np.arange(inputs.samples)
        leading, trailing = (self._shares(alpha, inputs.samples) for alpha in self._alphas)
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            fusion={
                "facing": facing_of(camera, kernel.source.dtype("Facing")),
                "leading": leading,
                "trailing": trailing,
                "newest": 1 / powers.sum(),
                "fading": self._tau,
                "middle": inputs.shutter.time(np.array(0.5)),
            },
            color=inputs.frame.color,
            soft=soft,
            motion=inputs.frame.motion,
            depth=inputs.frame.depth,
            normal=inputs.frame.normal,
            weight=inputs.frame.weight,
            soft_weight=soft_weight,
            linear=inputs.linear,
            output=output,
        )

    def _shares(self, alpha: float, samples: int) -> tuple[float, float]:
        """Return the weights of the sharp colour and of all samples together."""
        if self._printed:
            return 1.0, alpha * (1 - self._tau**samples)
        trail = min(self._alphas) / alpha
        return 1 - trail, trail

    def _filtered(
        self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, image: View, name: str
    ) -> View:
        """The image through the Gaussian, along rows and then along columns."""
        texel = gpu.texel(self._device, 4)
        for down in (False, True):
            to = self._images.view(f"{name} {down}", inputs.bindings.size, texel)
            kernel = gpu.kernel(
                self._device, "methods/fusion_gaussian.wgsl", {"Output": texel}, DOWN=down
            )
            kernel.run(
                encoder, "main", inputs.bindings, image=image, linear=inputs.linear, output=to
            )
            image = to
        return image


def facing_of(camera: Reprojections | None, dtype: np.dtype) -> np.ndarray:
    """The Facing of wgsl/common/facing.wgsl."""
    data = np.zeros((), dtype)
    data["planar"] = 0, 1, 1, 0
    if camera is None:
        return data
    here: Camera = camera.here
    if here.view_from_world is not None:
        view = np.asarray(here.view_from_world)
        data["right"][:3], data["up"][:3] = view[0, :3], view[1, :3]
    if camera.depth_kind == "clip":
        z, w = np.asarray(here.clip_from_world)[2:]
        if here.orthographic:  # from the near plane, z = -1
            data["planar"] = 1, 1, np.linalg.norm(z[:3]), 0
        else:  # z after projection is a + b / depth
            a = z[:3] @ w[:3] / (w[:3] @ w[:3])
            data["planar"] = z[3] - a * w[3], 0, -a, 1
    return data
