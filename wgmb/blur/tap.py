"""Tap blur: average the colour along each pixel's own path."""

from __future__ import annotations

from .. import gpu
from ..errors import InputError

PATHS = ("curved", "straight")
FORMS = ("shutter", "published")


class Tap:
    """Average the colour along each pixel's own path (Rosado 2007, GPU Gems 3, ch. 27).

    Taps stand where equal shares of the exposure have passed, on the path back in time.
    `path`: "curved" goes through the pixel's places in the previous, this and the next
    frame; "straight" takes their mean velocity.
    `form`: "published" is the chapter's own: velocity is half the difference between this
    and the previous position, equal taps go from the pixel along it, the shutter is ignored.

    Strong: the cheapest, smooth within a surface. Artefacts: blur stops at the silhouette of
    what moves, what stands still in front of it bleeds into it, nothing appears behind it.
    """

    name = "tap"
    needs = frozenset({"color", "motion"})
    uses: frozenset[str] = frozenset()
    adaptive = True

    def __init__(self, device, *, output="rgba32float", path="curved", form="shutter"):
        if path not in PATHS:
            raise InputError(f"path must be one of {', '.join(PATHS)}, got {path!r}")
        if form not in FORMS:
            raise InputError(f"form must be one of {', '.join(FORMS)}, got {form!r}")
        self._device, self._output = device, output
        self._constants = {"CURVED": path == "curved", "PUBLISHED": form == "published"}

    def encode(self, encoder, inputs, output):
        """Record the one pass."""
        kernel = gpu.kernel(
            self._device,
            "blur/tap.wgsl",
            {"Output": self._output},
            BOX_SHUTTER=inputs.even,
            ADAPTIVE=inputs.auto,
            WEIGHTED=inputs.weight is not None,
            **self._constants,
        )
        kernel.run(
            encoder,
            "main",
            inputs.given,
            color=inputs.color,
            motion=inputs.motion,
            weight=inputs.weight or inputs.none,
            linear=inputs.linear,
            output=output,
        )
