"""Bindings of all passes over a frame: its constants, the shutter, and the times of the samples."""

from __future__ import annotations

import math
from typing import Any

import wgpu

from .. import gpu
from ..camera import Window
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
        opens, closes = shutter.span
        self._shared = {
            "shutter": gpu.uniform(
                self._device,
                "common/shutter.wgsl",
                "Shutter",
                span=(opens, closes),
                step=(closes - opens) / self._samples,
                rolling=shutter.delay,
            ),
            "strata": gpu.constant(
                self._device, "strata", shutter.strata(self._strata), wgpu.BufferUsage.STORAGE
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
        frame = gpu.uniform(
            self._device,
            "common/frame.wgsl",
            "Frame",
            size=size,
            samples=self._samples,
            jitter=self._jitter,
            index=number % 2**32,
            origin=window[:2],
            display=window[2:],
            max_blur=math.inf if self._max_blur is None else self._max_blur,
        )
        bound = gpu.FrameBindings(size, {"frame": frame, **self._shared}, window, self.groups)
        self._last = key, bound
        return bound
