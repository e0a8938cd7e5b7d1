"""Light that changes while the shutter is open: even changes from picture to picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import wgpu

from .. import gpu
from ..gpu.textures import KeptViews, ScratchBuffer, TexturePool
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


@dataclass(frozen=True)
class LightChanges:
    """Changes of light in a picture; with a `step` of 0 there are none."""

    view: wgpu.GPUTextureView
    """Of small pixels, linear."""
    linear: wgpu.GPUSampler
    step: int
    """Pixels along a small pixel."""
    standing: wgpu.GPUTextureView
    """Of small pixels: shares of the previous and the next picture's light where that stands."""
    near: tuple[wgpu.GPUTextureView, wgpu.GPUTextureView]
    """Those pictures; any others where nothing stands."""

    @classmethod
    def none(cls, device: wgpu.GPUDevice) -> LightChanges:
        """Nothing changes."""
        view = TexturePool(device).view("none", (1, 1), gpu.texel(device, 4))
        return cls(view, device.create_sampler(), 0, view, (view, view))

    def texels(self) -> dict[str, str]:
        """The formats in which changed.wgsl reads the pictures from storage."""
        return dict(zip(("previous", "next"), map(gpu.stored, self.near), strict=True))

    def bindings(self) -> dict[str, wgpu.GPUTextureView | wgpu.GPUSampler]:
        """The inputs of changed.wgsl, by their names there."""
        previous, next = self.near
        return {
            "changes": self.view,
            "linear": self.linear,
            "standing": self.standing,
            "previous": previous,
            "next": next,
        }


class ChangingLight:
    """Adds changes of light to exposures of the pictures of a video, on a device.

    A moment between two pictures has light of both, by its distance in time. A blur takes the light
    of a picture itself; this adds the rest where the same is seen along the motion, in a light that
    differs visibly, and where neither neighbour shows the same, as it is not there all the time.
    Where a picture stands and is all of an exposure, each pixel takes its share of the neighbours'
    own light there, which averages noise and jitter as a longer exposure does.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._images = device, TexturePool(device)
        self._texel = gpu.texel(device, 4)
        self._frame, self._views = gpu.SizeBindings(device), KeptViews()
        self._sums = ScratchBuffer(device)
        self._linear = device.create_sampler(mag_filter="linear", min_filter="linear")
        self._small: dict[int, wgpu.GPUTexture] = {}  # the latest last
        none = self._images.view("no light", (1, 1), self._texel)
        self._none = self._near = none, none

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

        `picture`: linear light by index, which `changes` refers to where `part` is 1. `shares`: see
        `shares_of`. `part`: of the exposure.
        """
        picture_size, indices = surroundings.motion.size, surroundings.indices
        size, step = _small_size(picture_size), step_of(picture_size)
        sums = self._sums.at_least(_TEXEL * size[0] * size[1])
        here = self._reduced(encoder, indices[1], picture)
        if not (any(shares) or begins):
            return
        texels = {"here": self._texel, "Output": self._texel}
        kernel = gpu.kernel(self._device, f"{_FOLDER}/change.wgsl", texels, STEP=step)
        previous, next = (
            here if index is None else self._reduced(encoder, index, picture)
            for index in indices[::2]
        )
        self._near = self._none
        if part == 1:
            before, after = (indices[1] if i is None else i for i in indices[::2])
            self._near = self._views.of(picture(before)), self._views.of(picture(after))
        kernel.run(
            encoder,
            "main",
            self._frame(size),
            light={
                "factors": surroundings.factors,
                "shares": part * np.array(shares),
                "exist": [index is not None for index in indices[::2]],
                "begins": begins,
                "whole": part == 1,
            },
            here=here,
            previous=previous,
            next=next,
            linear=self._linear,
            motion=surroundings.motion,
            holdout=surroundings.holdout,
            sums={"buffer": sums, "offset": 0, "size": sums.size},
            changes=self._images.view("changes", size, self._texel),
            standing=self._images.view("standing", size, self._texel),
        )

    def changes(self, size: Sequence[int]) -> LightChanges:
        """Those of all parts so far, of pictures of this size."""
        view, standing = (
            self._images.view(name, _small_size(size), self._texel)
            for name in ("changes", "standing")
        )
        return LightChanges(view, self._linear, step_of(size), standing, self._near)

    def add(
        self,
        encoder: wgpu.GPUCommandEncoder,
        light: wgpu.GPUTextureView,
        output: wgpu.GPUTextureView,
    ) -> None:
        """Record the exposure with the changes of its parts, into `output` (rgba32float)."""
        changes = self.changes(light.size)
        texels = {"picture": gpu.stored(light), **changes.texels()}
        gpu.kernel(self._device, f"{_FOLDER}/add.wgsl", texels, STEP=changes.step).run(
            encoder,
            "main",
            self._frame((light.size[0], light.size[1])),
            picture=light,
            output=output,
            **changes.bindings(),
        )

    def _reduced(
        self,
        encoder: wgpu.GPUCommandEncoder,
        index: int,
        picture: Callable[[int], wgpu.GPUTexture],
    ) -> wgpu.GPUTextureView:
        """A picture at the small size, made once."""
        if index in self._small:
            self._small[index] = self._small.pop(index)
            return self._images.view_of(self._small[index])
        light = picture(index)
        free = {f"small {n}" for n in range(_KEPT)} - {t.label for t in self._small.values()}
        name = min(free) if free else self._small.pop(next(iter(self._small))).label
        size, step = _small_size(light.size), step_of(light.size)
        made, seen = self._images.texture(name, size, self._texel), self._views.of(light)
        texels = {"picture": gpu.stored(seen), "Output": self._texel}
        gpu.kernel(self._device, f"{_FOLDER}/reduce.wgsl", texels, STEP=step).run(
            encoder,
            "main",
            self._frame(size),
            picture=seen,
            output=self._images.view_of(made),
        )
        self._small[index] = made
        return self._images.view_of(made)


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
