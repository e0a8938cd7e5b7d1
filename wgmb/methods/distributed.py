"""Distributed ray tracing in time: the reference."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import wgpu

from .. import gpu
from ..gpu.textures import ScratchBuffer
from ..shutter import Shutter
from .contract import Inputs, View
from .options import MethodOptions, Range

TIMES = 4096  # equal shares of the exposure between which times are interpolated


class Distributed:
    """Every ray has its own instant and place in the pixel (Cook, Porter, Carpenter 1984).

    `samples` are rays per pixel. Times are mapped by the shutter's inverse integral; time and
    position come from one low-discrepancy sequence, shifted by the pixel and the `seed`, so
    that more rays refine the same image, and the same seed gives the same bits.

    Strong: converges to the truth for any motion, the only one that needs nothing but a
    scene. Artefacts: noise that falls with the number of rays, and takes the longest to fall.
    """

    name = "distributed"
    needs = frozenset({"scene"})
    uses = frozenset({"progress"})

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """Seed of the noise."""

        seed: Annotated[int, Range(0, 2**32 - 1), "seed of the noise"] = 0

    def __init__(self, device: wgpu.GPUDevice, options: Options, *, output: str = "rgba32float"):
        self._device, self._output, self._seed = device, output, options.seed
        self._sums = ScratchBuffer(device)
        self._times: tuple[Shutter, wgpu.GPUBuffer] | None = None

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record the rays of `inputs.progress`; `output` is the mean of all so far."""
        kernel = gpu.kernel(
            self._device,
            "methods/distributed.wgsl",
            {"Output": self._output},
            **inputs.scene.constants,
        )
        width, height = inputs.bindings.size
        first, count = inputs.progress
        fine = inputs.bindings.resources | {"strata": self._fine(inputs.shutter)}
        kernel.run(
            encoder,
            "main",
            replace(inputs.bindings, resources=fine),
            progress={"first": first, "count": count, "seed": self._seed},
            sums=self._sums.at_least(16 * width * height),
            output=output,
            **inputs.scene.resources,
        )

    def _fine(self, shutter: Shutter) -> wgpu.GPUBuffer:
        """The times of the samples, in finer shares than other methods take."""
        if self._times is None or self._times[0] is not shutter:
            buffer = self._device.create_buffer_with_data(
                label="times", data=shutter.strata(TIMES), usage=wgpu.BufferUsage.STORAGE
            )
            self._times = shutter, buffer
        return self._times[1]
