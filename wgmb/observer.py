"""An observer: simulates the perception of successive images, on the GPU."""

from __future__ import annotations

import threading
from collections import deque

import numpy as np
import wgpu
from numpy.typing import NDArray

from . import gpu
from .cone import Cone
from .errors import InputError
from .frame import Floats
from .gpu.textures import TexturePool
from .gpu_frame.weighted_sum import WeightedSum


class Observer:
    """Simulates the perception of successive images, on the GPU.

    `rate`: images per second, over 0, each held until the next unless `present` sets another time;
    as many are kept as contribute at this rate. The first image counts as shown since ever.
    `cone`: the cone cell, by default Cone(). `device`: your own wgpu device, the name of an
    adapter, or None for the best one.
    """

    def __init__(
        self,
        rate: float,
        cone: Cone | None = None,
        *,
        device: wgpu.GPUDevice | str | None = None,
    ):
        self.rate, self.cone = rate, cone or Cone()
        self.held = self.cone.frames_needed(rate)  # pictures in the ring
        self.device = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
        self._images, self._sum = TexturePool(self.device), WeightedSum(self.device)
        self._size, self._count = (0, 0), 0
        self._held_for: deque[float | None] = deque(maxlen=self.held)  # the newest first
        self._lock = threading.RLock()

    def present(self, picture: Floats, held: float | None = None) -> None:
        """Show another image: (height, width, 3 or 4) floats, linear light, for `held` [s].

        `held` is 1 / `rate` if None; if images are held for different times, each needs its own.
        InputError for another shape than before.
        """
        if picture.ndim != 3 or picture.shape[2] not in (3, 4):
            raise InputError(f"picture must be (height, width, 3 or 4), got {picture.shape}")
        height, width, channels = picture.shape
        if self._count and self._size != (width, height):
            raise InputError(
                f"picture is {width} x {height}, earlier ones {self._size[0]} x {self._size[1]}"
            )
        if held is not None and not 0 < held < float("inf"):
            raise InputError(f"held must be over 0 seconds, got {held}")
        if channels == 3:
            picture = np.concatenate([picture, np.ones_like(picture[..., :1])], axis=2)
        with self._lock, gpu.reported((width, height)):
            self._size = width, height
            self._images.upload(f"ring {self._count % self.held}", picture, "rgba16float")
            self._count += 1
            self._held_for.appendleft(held)

    def perceived(self, after: float = 0.0) -> NDArray[np.float32]:
        """(height, width, 4) float32: the perceived image `after` [s] the last one's middle."""
        output = self.texture(after)
        with self._lock, gpu.reported(self._size):
            return self._images.download(
                self.device.create_command_encoder(label="perceived"), output
            )

    def texture(self, after: float = 0.0) -> wgpu.GPUTexture:
        """The perceived image as a texture, rgba32float, which the next call overwrites."""
        if not self._count:
            raise InputError("no image has been shown yet")
        with self._lock, gpu.reported(self._size):
            count = min(self._count, self.held)
            pictures = [
                self._images.texture(f"ring {number % self.held}", self._size, "rgba16float")
                for number in range(self._count - 1, self._count - 1 - count, -1)
            ]
            output = self._images.texture("output", self._size, "rgba32float")
            encoder = self.device.create_command_encoder(label="perceive")
            self._sum.encode(encoder, pictures, self._weights(count, after), output)
            gpu.submit(self.device, encoder)
            return output

    def _weights(self, count: int, after: float) -> np.ndarray:
        """The weights of the last images, newest first."""
        if all(held is None for held in self._held_for):
            return self.cone.shares(count, self.rate, after)
        held = [1 / self.rate if held is None else held for held in self._held_for]
        return self.cone.shares_held(np.array(held[:count]), after)
