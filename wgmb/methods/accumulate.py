"""Frame blending: N whole pictures at sub-frame times, averaged."""

from __future__ import annotations

import wgpu

from .. import gpu
from ..errors import InputError
from ..gpu.textures import ScratchBuffer, TexturePool
from .contract import Inputs, View
from .options import MethodOptions


class Accumulate:
    """Average `samples` images, rendered at the middle of equal shares of the exposure.

    The accumulation buffer of Haeberli and Akeley (1990), for time alone.

    Strong: correct visibility and shading at every instant, no noise. Artefacts: with few
    images, ghosts of moving objects instead of blur; each image costs a whole render.
    """

    name = "accumulate"
    needs = frozenset({"scene"})
    uses = frozenset({"progress"})

    Options = MethodOptions

    def __init__(
        self, device: wgpu.GPUDevice, options: MethodOptions, *, output: str = "rgba32float"
    ):
        self._device, self._output = device, output
        self._sums, self._images = ScratchBuffer(device), TexturePool(device)

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record the pictures of `inputs.progress`; `output` is the mean of all so far."""
        if inputs.shutter.rolling:
            raise InputError("method 'accumulate' renders whole images and cannot roll the shutter")
        kernel = gpu.kernel(self._device, "methods/accumulate.wgsl", {"Output": self._output})
        times = inputs.shutter.sample_times(inputs.samples)[spread(inputs.samples)]
        width, height = inputs.bindings.size
        first, count = inputs.progress
        for i in range(first, first + count):
            picture = inputs.scene.encode(
                encoder, inputs.bindings, self._images, "accumulate", float(times[i])
            )
            kernel.run(
                encoder,
                "main",
                inputs.bindings,
                color=picture["color"].create_view(),
                sums=self._sums.at_least(16 * width * height),
                progress={"done": i},
                output=output,
            )


def spread(count: int) -> list[int]:
    """0 to count - 1, so that the first few are spread over all (van der Corput's order)."""
    return sorted(range(count), key=lambda i: f"{i:016b}"[::-1])
