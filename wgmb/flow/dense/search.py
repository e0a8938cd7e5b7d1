"""Motion of the pictures of a shot by dense inverse search and blocks, on the GPU."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...errors import InputError
from ...gpu.textures import KeptViews
from ..shot import checked
from .levels import KEPT
from .stages import DenseStages

Textures = tuple[wgpu.GPUTexture, wgpu.GPUTexture | None]  # motion, depth
Load = Callable[[int], np.ndarray | wgpu.GPUTexture | None]


class DenseInverseSearch:
    """Motion and depth order of pictures by dense inverse search, and by blocks where it is lost.

    Kroeger, Timofte, Dai and Van Gool, "Fast Optical Flow using Dense Inverse Search" (2016). What
    fits neither neighbour then is searched in blocks of a small picture, and taken where it costs
    less. The commands of a picture are one submission, and nothing is read back.

    `device`: your own wgpu device, the name of an adapter, or None for the best one.
    """

    def __init__(self, *, device: wgpu.GPUDevice | str | None = None):
        self.device = device if isinstance(device, wgpu.GPUDevice) else gpu.open_device(device)
        self._pictures: _Pictures | None = None

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion depends on."""
        return 1

    def shot(self, load: Load, depth: bool = True) -> DenseShot:
        """Motion of a shot's pictures, and depth if it is wanted.

        `load(number)`: the picture (height, width, 3 or 4), linear, as an array, or as a texture of
        this device that is read at once; None outside the shot.
        """
        return DenseShot(self, load, depth)

    def pictures(self, size: tuple[int, int]) -> _Pictures:
        """The textures for pictures of a size, which one shot after the other has."""
        if self._pictures is None or self._pictures.stages.size != size:
            self._pictures = _Pictures(DenseStages(self.device, size))
        return self._pictures


class _Pictures:
    """The place of every picture, and of its motion, in the textures of the stages."""

    def __init__(self, stages: DenseStages):
        self.stages = stages
        self.levels: dict[int, tuple[object, int]] = {}  # shot and number, by place
        self.motions: dict[int, tuple[object, int, Textures]] = {}
        self.views = KeptViews()


class DenseShot:
    """Motion of the pictures of a shot; made by `DenseInverseSearch.shot`."""

    def __init__(self, source: DenseInverseSearch, load: Load, depth: bool):
        self._source, self._load, self._depth = source, load, depth
        self._me = object()  # in what is kept, which shall not hold the shot
        self._size: tuple[int, int] | None = None

    def textures(self, number: int) -> Textures | None:
        """Motion to_prev, to_next [px] (rgba32float) and depth (r32float) of a picture on the GPU.

        They are valid until those of `number` + 3 are asked for. None where a picture is alone.
        """
        with gpu.reported():
            if (kept := self._kept(number)) is not None:
                return kept
            return self._motion_of(number)

    def __call__(self, number: int) -> tuple[np.ndarray, np.ndarray | None] | None:
        """(height, width, 4) to_prev, to_next [px] and (height, width) depth of a picture."""
        found = self.textures(number)
        if found is None or self._size is None:
            return None
        images, device = self._source.pictures(self._size).stages.images, self._source.device
        with gpu.reported():
            motion, depth = (
                None
                if texture is None
                else images.download(device.create_command_encoder(), texture)
                for texture in found
            )
        assert motion is not None
        return motion, None if depth is None else depth[..., 0]

    def _kept(self, number: int) -> Textures | None:
        if self._size is None:
            return None
        kept = self._source.pictures(self._size).motions.get(number % KEPT)
        return kept[2] if kept is not None and kept[:2] == (self._me, number) else None

    def _motion_of(self, number: int) -> Textures | None:
        device, encoder, there = self._source.device, None, {}
        for n in (number, number - 1, number + 1):
            there[n] = self._has_levels(n)
            if there[n]:
                continue
            if encoder is not None:  # what it reads may be drawn over by the next picture
                gpu.hand_in(device, encoder)
                encoder = None
            picture = self._load(n)
            there[n] = picture is not None
            if picture is not None:
                encoder = gpu.encoder(device, "motion")
                self._add(encoder, n, picture)
            elif n == number:
                return None
        encoder = encoder or gpu.encoder(device, "motion")
        found = None
        if there[number - 1] or there[number + 1]:
            assert self._size is not None
            pictures = self._source.pictures(self._size)
            beside = there[number - 1], there[number + 1]
            found = pictures.stages.find(encoder, number, *beside, self._depth)
            pictures.motions[number % KEPT] = self._me, number, found
        gpu.hand_in(device, encoder)
        return found

    def _has_levels(self, number: int) -> bool:
        if self._size is None:
            return False
        return self._source.pictures(self._size).levels.get(number % KEPT) == (self._me, number)

    def _add(self, encoder: wgpu.GPUCommandEncoder, number: int, picture: Any) -> None:
        is_texture = isinstance(picture, wgpu.GPUTexture)
        picture = picture if is_texture else checked(picture, number)
        size = picture.size[:2] if is_texture else picture.shape[1::-1]
        if self._size not in (None, size):
            expected = "{} x {}".format(*self._size or size)
            raise InputError(f"frame {number} is {size[0]} x {size[1]}, others are {expected}")
        self._size = size
        pictures = self._source.pictures(size)
        if is_texture:
            view = pictures.views.of(picture)
        else:
            view = pictures.stages.images.upload("picture", picture, "rgba32float")
        pictures.stages.add(encoder, number, view)
        pictures.levels[number % KEPT] = self._me, number
