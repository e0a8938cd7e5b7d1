"""Motion of a video's pictures, by a source that takes textures or display values."""

from __future__ import annotations

from typing import Any

import wgpu

from ..flow import Flow
from ..flow.dis.better_match import BetterMatch, Both
from ..gpu.textures import TexturePool
from ..shots.motion import MotionSource, ShotMotion
from ..shots.reader import ShotReader
from .planes import Planes
from .thumbnail import Thumbnail


class VideoMotion(ShotMotion):
    """The motion of the pictures that a ShotReader keeps, by their indices there.

    Flow takes them as textures of `device`, in light that is not expanded; BetterMatch also as
    grey, and others as grey alone.
    """

    def __init__(
        self,
        source: MotionSource,
        shots: ShotReader[Thumbnail],
        device: wgpu.GPUDevice,
        depth: bool = True,
    ):
        searched = _Searched(shots, device)
        pictures = {Flow: searched.texture, BetterMatch: searched.both}
        picture = pictures.get(type(source), searched.grey)
        super().__init__(source, picture, shots.moves_on, depth)


class _Searched:
    """Pictures that a ShotReader keeps, as they are searched."""

    def __init__(self, shots: ShotReader[Thumbnail], device: wgpu.GPUDevice):
        self._shots, self._planes = shots, Planes(device)
        self._images = TexturePool(device)

    def texture(self, index: int) -> wgpu.GPUTexture:
        """A picture's light, in the texture of the one before."""
        coded = self._shots[index].content.coded
        texel = self._planes.texel(coded.coding)
        texture = self._images.texture("searched", coded.size, texel)
        self._planes.draw(coded, texture)
        return texture

    def grey(self, index: int) -> Any:
        """A picture's display values."""
        return self._shots[index].content.grey

    def both(self, index: int) -> Both:
        """The grey picture at once, its texture when it is asked for."""
        return Both(self.grey(index), lambda: self.texture(index))
