"""Motion of a video's pictures, by a source that takes textures or display values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import wgpu

from ..flow import Flow, Shot
from ..flow.dense import DenseInverseSearch, DenseShot
from ..flow.dis import DisShot
from ..flow.dis.by_place import PlaceShot
from ..gpu.textures import TexturePool
from ..shots.motion import Found, MotionSource, ShotMotion
from ..shots.reader import Shots
from .edges import MotionEdges
from .planes import Planes
from .ragged import KEPT, RaggedMotion
from .thumbnail import Thumbnail
from .unfollowed import is_unfollowed

Textures = tuple[wgpu.GPUTexture, wgpu.GPUTexture | None]


class MotionTextures(Protocol):
    """The motion of pictures in time, by their indices, as textures."""

    def place(self, index: int) -> int:
        """The place of a picture's textures, 0 to KEPT - 1, which the next one there overwrites."""
        ...

    def textures(self, index: int) -> Textures | None:
        """Motion (rgba32float) of a picture; depth (r32float), if it is known; None if alone."""
        ...

    def depth(self, index: int) -> wgpu.GPUTexture | None:
        """The depth of a picture whose motion was given without; None where there is none."""
        ...

    def edges(self, index: int) -> MotionEdges | None:
        """Edges of a picture's motion, None if they are not known."""
        ...

    def is_unfollowed(self, index: int, held: Any) -> bool:
        """Return True if a place of a picture was not followed (see unfollowed.py)."""
        ...


class VideoMotion(ShotMotion):
    """The motion of pictures in time, by their indices, nowhere ragged.

    Flow and DenseInverseSearch take them as textures of `device`, in light that is not expanded,
    others as grey. Smooth motion, as from dense inverse search, is left as it is. `light`:
    the kept light of a picture, if it is not expanded; inverse search, which looks no further than
    the next picture, takes it from there.
    """

    def __init__(
        self,
        source: MotionSource,
        shots: Shots[Thumbnail],
        device: wgpu.GPUDevice,
        depth: bool = True,
        light: Callable[[int], wgpu.GPUTexture] | None = None,
    ):
        searched = _Searched(shots, device)
        if light is not None and isinstance(source, DenseInverseSearch):
            picture = light
        elif isinstance(source, Flow | DenseInverseSearch):
            picture = searched.texture
        else:
            picture = searched.grey
        super().__init__(source, picture, shots.moves_on, depth)
        self._grey = searched.grey
        self._device, self._images = device, TexturePool(device)
        self._ragged = RaggedMotion(device)

    def place(self, index: int) -> int:
        """The place of a picture's textures, as in RaggedMotion."""
        return index % KEPT

    def textures(self, index: int) -> Textures | None:
        """Motion (rgba32float) of a picture; depth (r32float), if it is known; None if alone.

        They are valid as RaggedMotion says. The depth of dense inverse search is found by `depth`.
        """
        shot = self.shot(index)
        if isinstance(shot, DisShot):
            motion = shot.motion(index)
            return None if motion is None else (self._up("motion", index, motion), None)
        if isinstance(shot, DenseShot):
            return shot.textures(index)
        if isinstance(shot, Shot):
            found = shot.textures(index)
            return found and self._ragged(index, found.motion, found.depth)
        found = shot(index)
        if found is None:
            return None
        motion, depth = found
        uploaded = None if depth is None else self._up("depth", index, depth)
        return self._ragged(index, self._up("motion", index, motion), uploaded)

    def __call__(self, number: int) -> Found | None:
        """Motion (height, width, 4) [px] of a picture, and depth; None where it is alone."""
        shot = self.shot(number)
        if isinstance(shot, DisShot):
            return shot(number)
        textures = self.textures(number)
        if textures is None:
            return None
        motion, depth = textures
        return self._down(motion), None if depth is None else self._down(depth)[..., 0]

    def edges(self, index: int) -> MotionEdges | None:
        """Edges of a picture's motion, None if they are not known."""
        shot = self.shot(index)
        if not isinstance(shot, PlaceShot):
            return None
        motion = shot.motion(index)
        return MotionEdges(np.zeros((1, 1, 4), np.float32) if motion is None else motion)

    def is_unfollowed(self, index: int, held: Any) -> bool:
        """Return True if a place of a picture was not followed (see unfollowed.py).

        `held`: areas that are to stay sharp, None where there are none. Motion that is made and
        kept on the GPU is not looked at, so this is False.
        """
        shot = self.shot(index)
        motion = shot.motion(index) if isinstance(shot, DisShot) else None
        if motion is None:
            return False
        near = (i if self._moves_on(index, i) else None for i in (index - 1, index, index + 1))
        return is_unfollowed([None if i is None else self._grey(i) for i in near], motion, held)

    def depth(self, index: int) -> wgpu.GPUTexture | None:
        """The depth of a picture whose motion was uploaded without; None where there is none."""
        shot = self.shot(index)
        found = shot.depth(index) if isinstance(shot, DisShot) else None
        return None if found is None else self._up("depth", index, found)

    def _up(self, name: str, index: int, plane: Any) -> wgpu.GPUTexture:
        texel = "rgba32float" if plane.ndim == 3 else "r32float"
        return self._images.upload(f"{name} {index % KEPT}", plane, texel).texture

    def _down(self, texture: wgpu.GPUTexture) -> Any:
        return self._images.download(self._device.create_command_encoder(), texture)


class _Searched:
    """Pictures in time, as they are searched."""

    def __init__(self, shots: Shots[Thumbnail], device: wgpu.GPUDevice):
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
