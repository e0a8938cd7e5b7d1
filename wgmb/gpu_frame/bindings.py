"""Bindings of all passes over a frame: its constants, the shutter, and the times of the samples."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..camera import Window
from ..gpu import wgsl
from ..shutter import Shutter

AUTO_STRATA = 256
"""Equal shares of the exposure that times are interpolated in, if samples are "auto"."""


class FrameConstants:
    """Bind group 0 of one Blur, for one frame after the other.

    `strata`: equal shares of the exposure whose times are given to the GPU; the other arguments
    are those of the Blur. `expose` comes before `bindings`.
    """

    def __init__(
        self,
        device: wgpu.GPUDevice,
        samples: int,
        strata: int,
        jitter: float,
        max_blur: float | None,
    ):
        self._device, self._samples, self._strata = device, samples, strata
        self._jitter, self._max_blur = jitter, max_blur
        self.groups = gpu.BindGroups()

    def expose(self, shutter: Shutter) -> None:
        """Take the shutter of the frames from now on."""
        data = np.zeros((), wgsl.load("common/shutter.wgsl").dtype("Shutter"))
        opens, closes = shutter.span
        data["span"] = opens, closes
        data["step"] = (closes - opens) / self._samples
        data["rolling"] = shutter.delay
        create = self._device.create_buffer_with_data
        self._shared = {
            "shutter": create(label="shutter", data=data, usage=wgpu.BufferUsage.UNIFORM),
            "strata": create(
                label="strata",
                data=shutter.strata(self._strata),
                usage=wgpu.BufferUsage.STORAGE,
            ),
        }
        self._last: tuple[tuple[Any, ...], gpu.FrameBindings] | None = None

    def bindings(
        self, size: tuple[int, int], number: int = 0, window: Window | None = None
    ) -> gpu.FrameBindings:
        """Return the bindings of the frame of this number, which shows `window` of a display."""
        window = window or (0, 0, *size)
        key = size, number, window
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        data = np.zeros((), wgsl.load("common/frame.wgsl").dtype("Frame"))
        data["size"], data["samples"], data["jitter"] = size, self._samples, self._jitter
        data["index"] = number % 2**32
        data["origin"], data["display"] = window[:2], window[2:]
        data["max_blur"] = np.inf if self._max_blur is None else self._max_blur
        frame = gpu.constant(self._device, "frame", data)
        bound = gpu.FrameBindings(size, {"frame": frame, **self._shared}, window, self.groups)
        self._last = key, bound
        return bound
