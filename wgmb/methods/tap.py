"""Tap blur: average the colour along each pixel's own path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import wgpu

from .. import gpu
from ..extent import Spread
from ..gpu import wgsl
from .contract import Inputs, View
from .five_positions import Bends
from .options import MethodOptions


class Tap:
    """Average the colour along each pixel's own path (Rosado 2007, GPU Gems 3, ch. 27).

    Taps divide the exposure into equal shares along the path.
    `path`: "curved" goes through the pixel's places in the previous, this and the next
    frame; "five" through those in the second frames before and after too, as the neighbours' own
    vectors lead on: it reads the neighbours, and needs depth; "straight" takes the mean velocity.
    `variant`: "published" is the chapter's own: velocity is half the difference between this
    and the previous position, equal taps go from the pixel along it, the shutter is ignored.

    Strong: the cheapest, smooth within a surface. Artefacts: blur stops at the silhouette of
    a moving object, still objects in front of it bleed into it, nothing is revealed behind it.
    """

    name = "tap"
    needs = frozenset({"color", "motion"})
    uses: frozenset[str] = frozenset()
    spread: Spread = "nowhere"
    adaptive = True

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """Tap path and variant."""

        path: Annotated[
            Literal["curved", "straight", "five"],
            "path through three positions (curved), along the mean velocity (straight), or through "
            "five positions, with the neighbours' vectors (five)",
        ] = "curved"
        variant: Annotated[
            Literal["shutter", "published"],
            "taps over the exposure, or as in the chapter, ignoring the shutter",
        ] = "shutter"

    def __init__(self, device: wgpu.GPUDevice, options: Options, *, output: str = "rgba32float"):
        self._device, self._output = device, output
        published = options.variant == "published"
        self._is_five = options.path == "five" and not published
        if self._is_five:
            self.needs, self.uses = self.needs | {"depth"}, frozenset({"neighbours"})
            self.bend = float(wgsl.load("common/path.wgsl").constant("MOST_BEND"))
        self._bends = Bends(device)
        self._constants = {"CURVED": options.path != "straight", "PUBLISHED": published}

    def repeats(self, inputs: Inputs) -> bool:
        """See `Method`."""
        return True

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record the one pass, after that for the paths through five positions."""
        five = self._is_five and len(inputs.frames) > 1
        bends = self._bends.encode(encoder, inputs, inputs.frames[:1])[0] if five else None
        kernel = gpu.kernel(
            self._device,
            "methods/tap.wgsl",
            {"Output": self._output},
            BOX_SHUTTER=inputs.even,
            ADAPTIVE=inputs.auto,
            FIVE_POSITIONS=five,
            WEIGHTED=inputs.frame.weight is not None,
            **self._constants,
        )
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            color=inputs.frame.color,
            motion=inputs.frame.motion,
            weight=inputs.frame.weight,
            linear=inputs.linear,
            bends=bends,
            output=output,
        )
