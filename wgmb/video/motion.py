"""Motion of a video's pictures, by a source that takes textures or display values."""

from __future__ import annotations

from typing import Any

import wgpu

from ..flow import Flow, Shot
from ..flow.dis import Dis
from ..flow.dis.better_match import BetterMatch, Both
from ..gpu.textures import TexturePool
from ..shots.motion import Found, MotionSource, ShotMotion
from ..shots.reader import ShotReader
from .planes import Planes
from .ragged import KEPT, RaggedMotion
from .thumbnail import Thumbnail


class VideoMotion(ShotMotion):
    """The motion of the pictures that a ShotReader keeps, by their indices there, nowhere ragged.

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
        self._device, self._images = device, TexturePool(device)
        is_searched = not isinstance(source, Dis)  # dense inverse search alone is smooth
        self._ragged = RaggedMotion(device) if is_searched else None

    def textures(self, index: int) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture | None] | None:
        """Motion and depth of a picture on the GPU, valid as RaggedMotion says.

        None where it is alone; the depth may lack where none is wanted.
        """
        shot = self.shot(index)
        if isinstance(shot, Shot):
            textures = shot.textures(index)
            if textures is None:
                return None
            motion, depth = textures.motion, textures.depth
        else:
            found = shot(index)
            if found is None:
                return None
            place = 0 if self._ragged else index % KEPT
            motion = self._images.upload(f"motion {place}", found[0], "rgba32float").texture
            depth = None
            if found[1] is not None:
                depth = self._images.upload(f"depth {place}", found[1], "r32float").texture
        return self._ragged(index, motion, depth) if self._ragged else (motion, depth)

    def __call__(self, number: int) -> Found | None:
        """Motion (height, width, 4) [px] and depth of a picture; None where it is alone."""
        if self._ragged is None:
            return super().__call__(number)
        textures = self.textures(number)
        if textures is None:
            return None
        motion, depth = (
            None
            if texture is None
            else self._images.download(self._device.create_command_encoder(), texture)
            for texture in textures
        )
        assert motion is not None
        return motion, None if depth is None else depth[..., 0]


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
