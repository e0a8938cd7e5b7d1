"""Motion of a video's pictures, by a source that takes textures or display values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import wgpu

from ..flow import Flow, Shot
from ..flow.dis import Dis
from ..flow.dis.better_match import BetterMatch, Both, Hypothesis, MixedShot
from ..flow.dis.by_place import ByPlace, PlaceShot
from ..gpu.textures import TexturePool
from ..shots.motion import Found, MotionSource, ShotMotion
from ..shots.reader import ShotReader
from .planes import Planes
from .ragged import KEPT, RaggedMotion
from .thumbnail import Thumbnail


class Ways(NamedTuple):
    """A hypothesis about the motion of a picture, on the GPU; depth where it is wanted."""

    share: float
    motion: wgpu.GPUTexture
    depth: wgpu.GPUTexture | None


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
        is_searched = not isinstance(source, Dis | ByPlace)  # which are smooth
        self._ragged = RaggedMotion(device) if is_searched else None

    def hypotheses(self, index: int) -> Sequence[Ways]:
        """Those about the motion of a picture, the likeliest first; none where it is alone.

        They are valid as RaggedMotion says.
        """
        shot = self.shot(index)
        if isinstance(shot, MixedShot):
            return self._uploaded(index, shot.hypotheses(index))
        return self._of(index)

    def __call__(self, number: int) -> Found | None:
        """The likeliest motion (height, width, 4) [px] of a picture, and depth; None if alone."""
        if self._ragged is None:
            return super().__call__(number)
        for _, motion, depth in self._of(number):
            return self._down(motion), None if depth is None else self._down(depth)[..., 0]
        return None

    def _of(self, index: int) -> Sequence[Ways]:
        """The likeliest motion alone."""
        shot = self.shot(index)
        if isinstance(shot, Shot):
            found = shot.textures(index)
            if found is None:
                return []
            return [Ways(1.0, *self._smooth(index, 0, found.motion, found.depth))]
        if isinstance(shot, PlaceShot):
            motion = shot.motion(index)
            found = None if motion is None else (motion, None)
        else:
            found = shot(index)
        return [] if found is None else self._uploaded(index, [Hypothesis(1.0, found)])

    def change(self, index: int) -> float:
        """The greatest change of a picture's motion within a tile [px], infinite if not known."""
        shot = self.shot(index)
        return shot.change(index) if isinstance(shot, PlaceShot) else math.inf

    def depth(self, index: int) -> wgpu.GPUTexture | None:
        """The depth of a picture whose motion was uploaded without; None where there is none."""
        shot = self.shot(index)
        found = shot.depth(index) if isinstance(shot, PlaceShot) else None
        if found is None:
            return None
        return self._images.upload(f"depth {index % KEPT}", found, "r32float").texture

    def _uploaded(self, index: int, hypotheses: Sequence[Hypothesis]) -> Sequence[Ways]:
        made: list[Ways] = []
        place = 0 if self._ragged else index % KEPT
        for number, (share, (motion, depth)) in enumerate(hypotheses):
            ways = self._images.upload(f"motion {place}", motion, "rgba32float").texture
            if depth is not None:
                depth = self._images.upload(f"depth {place}", depth, "r32float").texture
            made.append(Ways(share, *self._smooth(index, number, ways, depth)))
        return made

    def _smooth(
        self,
        index: int,
        number: int,
        motion: wgpu.GPUTexture,
        depth: wgpu.GPUTexture | None,
    ) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture | None]:
        """Motion and depth of a hypothesis, nowhere ragged."""
        return self._ragged(index, motion, depth, number) if self._ragged else (motion, depth)

    def _down(self, texture: wgpu.GPUTexture) -> Any:
        return self._images.download(self._device.create_command_encoder(), texture)


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
