"""What a viewer's cones make of a frame sequence.

A cone cell's answer to a flash: W(x) = rate exp(shift - rate x) F(x), x seconds later, whose
integral is F(x) = exp(-exp(shift - rate x)) (Cusa 2022, after Howlett et al. 2017).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import wgpu

from . import gpu, shader
from .errors import InputError
from .images import Images, Scratch
from .shutter import Shutter

TURN = 2 * math.pi
EIGHT = 8  # pictures that one pass takes
MOST_HELD = 512  # pictures in the ring
VIDEOS = {  # what the article compares, each at the degrees where neighbours add up to 1
    "none": Shutter(0),
    "box": Shutter(360),
    "trapezoid": Shutter(540, curve="trapezoid"),
    "cosine": Shutter(720, curve="cosine"),
}


@dataclass(frozen=True)
class Cone:
    """A cone cell: its answer to a flash peaks `peak` [s] later and fades with `rate` [1/s]."""

    rate: float = 50.0
    peak: float = 0.05

    def __post_init__(self):
        if not (math.isfinite(self.rate) and 1 <= self.rate <= 10_000):
            raise InputError(f"rate must be 1 to 10000 per second, got {self.rate}")
        if not (math.isfinite(self.peak) and 0 <= self.peak <= 1):
            raise InputError(f"peak must be 0 to 1 second, got {self.peak}")

    @property
    def shift(self) -> float:
        """Delay times rate."""
        return self.rate * self.peak

    @property
    def memory(self) -> float:
        """Seconds after which less than 1e-4 of a flash is still to come."""
        return (self.shift + math.log(1e4)) / self.rate

    def held(self, rate: float) -> int:
        """How many pictures of `rate` a second one has to know, to tell what is seen."""
        if not (math.isfinite(rate) and rate > 0):
            raise InputError(f"rate must be over 0 pictures a second, got {rate}")
        count = math.ceil(self.memory * rate) + 2
        if count > MOST_HELD:
            raise InputError(f"{rate:g} pictures a second are too many: {MOST_HELD} are kept")
        return count

    def answer(self, x: np.ndarray | float) -> np.ndarray:
        """W(x): the answer to a flash `x` seconds later, 1/s."""
        late = np.minimum(self.shift - self.rate * np.asarray(x, float), 80)
        return self.rate * np.exp(late - np.exp(late))

    def seen(self, x: np.ndarray | float) -> np.ndarray:
        """F(x): share of the answer to a flash that has come `x` seconds later."""
        return np.exp(-np.exp(np.minimum(self.shift - self.rate * np.asarray(x, float), 80)))

    def weights(self, ages: np.ndarray, held: float) -> np.ndarray:
        """What pictures add that were shown for `held` [s], in the mean `ages` [s] ago."""
        ages = np.asarray(ages, float)
        return self.seen(ages + held / 2) - self.seen(ages - held / 2)

    def shares(self, count: int, rate: float, after: float = 0.0) -> np.ndarray:
        """(count,) of the last pictures, the newest first; the oldest stands for all before it.

        `rate`: pictures a second, each held until the next. `after` [s] the newest one's middle.
        """
        weights = self.weights(after + np.arange(count) / rate, 1 / rate)
        weights[-1] += 1 - weights.sum()
        return weights

    def shutter(self, fps: float) -> Shutter:
        """Sees a world without frames as this cell does at the frame's instant."""
        return Shutter(360 * self.memory * fps, "end", lambda x: self.answer((1 - x) * self.memory))


class WeightedSum:
    """The sum of pictures on the GPU, each times a weight; a pixel that is not finite is 0."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._sums = device, Scratch(device)

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        pictures: Sequence[wgpu.GPUTexture],
        weights: np.ndarray,
        output: wgpu.GPUTexture,
    ) -> None:
        """Record it into `encoder`: float textures of one size, one weight each.

        `output`: rgba32float, of that size.
        """
        width, height, _ = output.size
        kernel = gpu.kernel(self._device, "perceive.wgsl")
        data = np.zeros((), shader.load("common/frame.wgsl").dtype("Frame"))
        data["size"] = width, height
        uniform = wgpu.BufferUsage.UNIFORM
        create = self._device.create_buffer_with_data
        given = gpu.Given((width, height), {"frame": create(data=data, usage=uniform)})
        views = [picture.create_view() for picture in pictures]
        for first in range(0, len(views), EIGHT):
            share = np.zeros((), kernel.source.dtype("Share"))
            share["weights"].flat[: len(views) - first] = weights[first : first + EIGHT]
            share["first"] = first == 0
            kernel.run(
                encoder,
                "main",
                given,
                share=create(data=share, usage=uniform),
                sums=self._sums.at_least(16 * width * height),
                output=output.create_view(),
                **{f"picture{i}": views[min(first + i, len(views) - 1)] for i in range(EIGHT)},
            )


class Viewer:
    """What is seen of pictures shown one after the other, on the GPU.

    `rate`: pictures a second, each held until the next. Before the first one it was there too.
    `device`: a wgpu device of yours, the name of an adapter, or None for the best.
    """

    def __init__(
        self,
        rate: float,
        cone: Cone | None = None,
        *,
        device: wgpu.GPUDevice | str | None = None,
    ):
        self.rate, self.cone = rate, cone or Cone()
        self.held = self.cone.held(rate)  # pictures in the ring
        self.device = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
        self._images, self._sum = Images(self.device), WeightedSum(self.device)
        self._size, self._shown = (0, 0), 0

    def look(self, picture: np.ndarray) -> None:
        """Show one more: (height, width, 3 or 4), linear light."""
        if picture.ndim != 3 or picture.shape[2] not in (3, 4):
            raise InputError(f"a picture is (height, width, 3 or 4), got {picture.shape}")
        height, width, channels = picture.shape
        if self._shown and self._size != (width, height):
            raise InputError(
                f"picture of {width} x {height} after those of {self._size[0]} x {self._size[1]}"
            )
        if channels == 3:
            picture = np.concatenate([picture, np.ones_like(picture[..., :1])], axis=2)
        self._size = width, height
        self._images.upload(f"ring {self._shown % self.held}", picture, "rgba16float")
        self._shown += 1

    def sees(self, after: float = 0.0) -> np.ndarray:
        """(height, width, 4) float32: what is seen `after` [s] the middle of the last picture."""
        if not self._shown:
            raise InputError("nothing was shown yet")
        count = min(self._shown, self.held)
        pictures = [
            self._images.texture(f"ring {number % self.held}", self._size, "rgba16float")
            for number in range(self._shown - 1, self._shown - 1 - count, -1)
        ]
        output = self._images.texture("output", self._size, "rgba32float")
        encoder = self.device.create_command_encoder(label="perceive")
        self._sum.encode(encoder, pictures, self.cone.shares(count, self.rate, after), output)
        return self._images.download(encoder, output)


def difference(shutter: Shutter, speed: float, fps: float, cone: Cone | None = None) -> float:
    """How far a perceived video is from perceived nature: the article's claim as a number.

    A disk of radius 0.1 runs at `speed` [rad/s] on a circle of 0.2; `shutter` exposes its video of
    `fps` frames a second. Frames and windows are centred alike. Mean absolute difference of 0..1
    over the ring that the disk sweeps, at four times within a frame.
    """
    if not (math.isfinite(speed) and speed > 0):
        raise InputError(f"speed must be over 0 rad/s, got {speed}")
    if not (math.isfinite(fps) and fps > 0):
        raise InputError(f"fps must be over 0, got {fps}")
    cone = cone or Cone()
    r = (0.1 + 0.2 * (np.arange(40) + 0.5) / 40)[:, None]
    theta = (np.arange(720) + 0.5) / 720 * TURN
    half = np.arccos(np.clip((0.2**2 + r**2 - 0.1**2) / (0.4 * r), -1, 1))
    passes, frames = math.ceil(cone.memory * speed / TURN) + 2, math.ceil(cone.memory * fps) + 2
    total = 0.0
    for t in (np.arange(4) + 0.5) / 4 / fps:
        # The angle by which the disk has passed a place; up to 1 rad ahead is not yet passed.
        passed = (speed * t - theta + 1) % TURN - 1 + TURN * np.arange(passes)[:, None, None]
        nature = cone.seen((passed + half) / speed) - cone.seen((passed - half) / speed)
        video = np.zeros((len(r), len(theta)))
        for k in range(1, -frames, -1):
            weight = cone.weights(t - k / fps, 1 / fps)
            around = (theta - speed * k / fps + math.pi) % TURN - math.pi
            video += weight * _exposed(shutter, around, half, speed / fps)
        total += float((np.abs(nature.sum(axis=0) - video) * r).mean() / r.mean())
    return total / 4


def _exposed(shutter: Shutter, theta, half, speed: float) -> np.ndarray:
    """Share of the exposure that a disk, at angle 0 at the frame's instant, is at a place."""
    if shutter.degrees == 0:
        return (np.abs(theta) < half).astype(float)
    times, integral = shutter.integral()
    reach = math.ceil(max(map(abs, shutter.span)) * speed / TURN) + 1
    total = np.zeros(np.broadcast_shapes(np.shape(theta), np.shape(half)))
    for edge in theta + TURN * np.arange(-reach, reach + 1)[:, None]:
        after, before = ((edge + side * half) / speed for side in (1, -1))
        total += np.interp(after, times, integral) - np.interp(before, times, integral)
    return total


def compare(fps: float, speeds: np.ndarray, cone: Cone | None = None) -> dict[str, list[float]]:
    """`difference` by name of the shutter (VIDEOS) at each speed [rad/s]."""
    return {
        name: [difference(shutter, float(speed), fps, cone) for speed in speeds]
        for name, shutter in VIDEOS.items()
    }


def best_shutter(speed: float, fps: float, cone: Cone | None = None) -> tuple[str, float]:
    """Of VIDEOS, whose perceived video is nearest to nature at `speed` [rad/s], and how near."""
    found = compare(fps, np.array([speed]), cone)
    name = min(found, key=lambda name: found[name][0])
    return name, found[name][0]
