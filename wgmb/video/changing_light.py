"""Light that changes while the shutter is open: even changes from picture to picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..gpu.textures import ScratchBuffer, TexturePool
from ..shutter import Shutter

_STEP, _UNTIL = 4, 960  # px along a small pixel, in pictures whose longer side [px] is up to this
_KEPT = 3  # small pictures: one and its neighbours
_FOLDER = "video/changing_light"
_TEXEL = 16  # bytes of a small pixel's change


@dataclass(frozen=True)
class Surroundings:
    """A picture between its neighbours, as far as motion leads there."""

    indices: tuple[int | None, int, int | None]
    """Of the previous picture, of the picture itself, of the next one."""
    factors: tuple[float, float]
    """From ways to the previous and the next picture to the ways in `motion`."""
    motion: wgpu.GPUTextureView
    """To the previous and the next picture [px]."""
    holdout: wgpu.GPUTextureView | None
    """(0 to 1) 1 stays as it is."""


class ChangingLight:
    """Adds what light changes to exposures of the pictures of a video, on a device.

    A moment between two pictures has light of both, by its distance in time. A blur takes the light
    of a picture itself; this adds the rest where the same is seen along the motion, in a light that
    differs visibly.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)
        self._changes = ScratchBuffer(device)
        self._small: dict[int, wgpu.GPUTexture] = {}  # the latest last

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        picture: Callable[[int], wgpu.GPUTexture],
        surroundings: Surroundings,
        shares: tuple[float, float],
        part: float,
        begins: bool,
    ) -> None:
        """Record the change of one part of an exposure, onto those before unless it `begins`.

        `picture`: linear light by index. `shares`: see `shares_of`. `part`: of the exposure.
        """
        prev, here, next = (
            None if index is None else self._reduced(encoder, index, picture)
            for index in surroundings.indices
        )
        assert here is not None
        size, step = (here.size[0], here.size[1]), step_of(surroundings.motion.size)
        there = [t is not None for t in (prev, next)]
        values = {
            "ways": np.repeat([1 / factor for factor in surroundings.factors], 2),
            "shares": np.where(there, shares, 0.0),
            "part": part,
            "begins": begins,
        }
        none = self._images.texture("none", (1, 1), "r32float")
        gpu.kernel(self._device, f"{_FOLDER}/change.wgsl", STEP=step).run(
            encoder,
            "main",
            gpu.FrameBindings.of_size(self._device, size),
            light=gpu.uniform(self._device, f"{_FOLDER}/change.wgsl", "Light", **values),
            here=here.create_view(),
            prev=(prev or here).create_view(),
            next=(next or here).create_view(),
            motion=surroundings.motion,
            holdout=surroundings.holdout or none.create_view(),
            changes=self._buffer(size),
        )

    def add(
        self,
        encoder: wgpu.GPUCommandEncoder,
        light: wgpu.GPUTextureView,
        output: wgpu.GPUTextureView,
    ) -> None:
        """Record the exposure with the changes of its parts, into `output` (rgba32float)."""
        size, step = (light.size[0], light.size[1]), step_of(light.size)
        gpu.kernel(self._device, f"{_FOLDER}/add.wgsl", STEP=step).run(
            encoder,
            "main",
            gpu.FrameBindings.of_size(self._device, size),
            picture=light,
            changes=self._buffer(_small_size(light.size)),
            output=output,
        )

    def _buffer(self, size: tuple[int, int]) -> dict[str, Any]:
        buffer = self._changes.at_least(_TEXEL * size[0] * size[1])
        return {"buffer": buffer, "offset": 0, "size": buffer.size}

    def _reduced(
        self,
        encoder: wgpu.GPUCommandEncoder,
        index: int,
        picture: Callable[[int], wgpu.GPUTexture],
    ) -> wgpu.GPUTexture:
        """A picture at the small size, made once."""
        if index in self._small:
            self._small[index] = self._small.pop(index)
            return self._small[index]
        light = picture(index)
        free = {f"small {n}" for n in range(_KEPT)} - {t.label for t in self._small.values()}
        name = min(free) if free else self._small.pop(next(iter(self._small))).label
        size, step = _small_size(light.size), step_of(light.size)
        made = self._images.texture(name, size, "rgba32float")
        gpu.kernel(self._device, f"{_FOLDER}/reduce.wgsl", STEP=step).run(
            encoder,
            "main",
            gpu.FrameBindings.of_size(self._device, size),
            picture=light.create_view(),
            output=made.create_view(),
        )
        self._small[index] = made
        return made


def shares_of(shutter: Shutter, factors: Sequence[float]) -> tuple[float, float]:
    """Shares of the previous and the next picture's light in an exposure, 0 to 1.

    At a time between two pictures, that of each counts by its distance from the other. `factors`:
    own intervals of a picture over the times to both.
    """
    times, exposed = shutter.integral()
    middles, weights = (times[1:] + times[:-1]) / 2, np.diff(exposed)
    back, ahead = (
        float(weights @ np.clip(side * factor * middles, 0, 1))
        for side, factor in zip((-1, 1), factors, strict=True)
    )
    return back, ahead


def step_of(size: Sequence[int]) -> int:
    """Pixels along a small pixel of a picture of a size [px], at which light is compared."""
    return _STEP * -(-max(size) // _UNTIL)


def _small_size(size: Sequence[int]) -> tuple[int, int]:
    step = step_of(size)
    return -(-size[0] // step), -(-size[1] // step)
