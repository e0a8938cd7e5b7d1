"""The pictures of a video's shots on the GPU, with the motion between them: nothing comes down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import wgpu

from .. import gpu
from ..exposure import Cell, evened
from ..gpu.textures import KeptViews, TexturePool
from ..gpu_frame.views import TEXTURES, FrameInShot, FrameViews, View
from ..pipeline.blur import Blur
from ..shots.motion import MotionSource
from ..shots.picture import Picture
from ..shots.reader import Shots
from .changing_light import ChangingLight, Surroundings, shares_of
from .holdouts import Holdout
from .motion import MotionTextures, VideoMotion
from .planes import Planes
from .ragged import KEPT
from .thumbnail import Thumbnail, is_same

LIGHTS = 6  # pictures kept as light: a frame and its neighbours, the next one, and two of a sum


class VideoFrames:
    """Textures of the pictures of `shots`, on the device of the Blur that takes them.

    `motion`: where motion comes from, or None. `known_motion`: instead, motion that was found
    already. `holdout`: areas that stay sharp, where there is motion. `planes`: make their light;
    motion is searched in light that is not expanded. `changing`: adds changes of light, for all
    that blur pictures of `shots`. Numbers of pictures that are copied, as none of their shot is
    beside them to find motion from, are `alone`; those with a place whose motion was not found are
    `unfollowed`.
    """

    def __init__(
        self,
        shots: Shots[Thumbnail],
        blur: Blur,
        motion: MotionSource | None = None,
        holdout: Holdout | None = None,
        planes: Planes | None = None,
        changing: ChangingLight | None = None,
        known_motion: MotionTextures | None = None,
    ):
        self.shots, self._blur, self._device = shots, blur, blur.device
        self._planes, self._images = planes or Planes(blur.device), TexturePool(blur.device)
        self._frame_of, self._views = gpu.SizeBindings(blur.device), KeptViews()
        self.changing = changing or ChangingLight(blur.device)
        self._source = known_motion
        if motion is not None:
            wants_depth = "depth" in blur.method.needs | blur.method.uses
            light = None if self._planes.expansion else self._light
            self._source = VideoMotion(motion, shots, blur.device, wants_depth, light)
        self._holdout = holdout or Holdout(displays=False)
        has_gpu = blur.device.adapter_info["adapter_type"] != gpu.SOFTWARE
        self._held = self._holdout.of(shots, ahead=has_gpu)  # otherwise all cores have work
        self.alone: set[int] = set()
        self.unfollowed: set[int] = set()
        self._mask: View | None = None
        self._lights: dict[int, str] = {}  # names of textures by index, the latest last
        self._frames: dict[int, tuple[Picture[Thumbnail], FrameViews]] = {}  # by their places
        self._same: dict[tuple[int, int], bool] = {}  # whether two pictures are, by their indices

    def in_shot(self, index: int, blur: Blur | None = None) -> FrameInShot:
        """A picture, between its neighbours if the method takes them, of `blur` if not of its own.

        Their textures may be overwritten once two others have been requested.
        """
        number = self.shots[index].number
        if self._is_still(index):
            return FrameInShot(
                FrameViews(color=self._images.view_of(self._light(index))), number=number
            )
        before = after = None
        method = (blur or self._blur).method
        takes = method.needs | method.uses
        if self._source is not None and "neighbours" in takes:
            before, after = self._led_to(index)
        wanted = [i for i in (before, index, after) if i is not None]
        views = {i: self.views(i, "depth" in takes) for i in wanted}
        near = (None if i is None else views[i] for i in (before, after))
        previous, next = (one if one is not None and one.has_vectors else None for one in near)
        return FrameInShot(views[index], previous, next, number)

    def change(self, cell: Cell, begins: bool) -> bool:
        """Submit the changes of light in the part `cell` of an exposure.

        `begins`: it is the first part that does. False where there is no motion.
        """
        index = cell.index
        if cell.shutter.degrees <= 0 or self._is_still(index):
            return False
        frame = self.views(index)
        if frame.motion is None:
            return False
        (before, after), factors = self._led_to(index), self._factors(index)
        surroundings = Surroundings((before, index, after), factors, frame.motion, frame.holdout)
        encoder = gpu.encoder(self._device, "changing light")
        shares = shares_of(cell.shutter, factors)
        self.changing.encode(encoder, self._light, surroundings, shares, cell.share, begins)
        gpu.hand_in(self._device, encoder)
        return True

    def blur_of(self, cell: Cell, blur: Blur, at_edges: Blur | None) -> Blur:
        """The Blur of a cell: `at_edges`, if there is one, where its motion has edges."""
        return at_edges if at_edges is not None and self.has_edges(cell) else blur

    def has_edges(self, cell: Cell) -> bool:
        """True if the motion of a picture has edges within its exposure, as gather looks for."""
        if self._source is None or self._is_still(cell.index):
            return False
        edges = self._source.edges(cell.index)
        return edges is None or edges.within(cell.shutter, self._factors(cell.index))

    def _is_still(self, index: int) -> bool:
        """True if motion leads to pictures beside one, and all of them are the same."""
        if self._source is None:
            return False
        before, after = self._led_to(index)
        pairs = (before, index), (index, after)
        near = [(a, b) for a, b in pairs if a is not None and b is not None]
        return bool(near) and all(self._are_same(a, b) for a, b in near)

    def _led_to(self, index: int) -> tuple[int | None, int | None]:
        """The pictures before and after one, as far as motion leads there."""
        before, after = (self.shots.neighbour(index, side) for side in (-1, 1))
        return (
            before if before is not None and self.shots.moves_on(index, before) else None,
            after if after is not None and self.shots.moves_on(index, after) else None,
        )

    def _are_same(self, before: int, index: int) -> bool:
        """True if a picture is the same as the one before it; compared once."""
        if (before, index) not in self._same:
            for old in [pair for pair in self._same if abs(pair[1] - index) > LIGHTS]:
                del self._same[old]
            one, here = (self.shots[i].content for i in (before, index))
            self._same[before, index] = is_same(one, here)
        return self._same[before, index]

    def _place(self, index: int) -> int:
        return index % KEPT if self._source is None else self._source.place(index)

    def views(self, index: int, depth: bool = False) -> FrameViews:
        """The views of one picture. `depth`: whether it is wanted, if it is found only then."""
        picture, place = self.shots[index], self._place(index)
        of, kept = self._frames.get(place, (picture, None))
        light = self._images.view_of(self._light(index))
        if kept is None or of is not picture or kept.color.texture is not light.texture:
            kept = self._moving(index, light)
        if depth and kept.depth is None and kept.motion is not None and self._source is not None:
            found = self._source.depth(index)
            if found is not None:
                kept = replace(kept, depth=self._views.of(found), key=object())
        self._frames[place] = picture, kept
        return kept

    def _moving(self, index: int, light: View) -> FrameViews:
        """The views of one picture, with its motion within its own interval."""
        found = None if self._source is None else self._source.textures(index)
        if found is None:
            if self._source is not None:
                self.alone.add(self.shots[index].number)
            return FrameViews(color=light, key=object())
        held = self._held(index)
        if self._source is not None and self._source.is_unfollowed(index, held):
            self.unfollowed.add(self.shots[index].number)
        (motion, depth), factors = found, self._factors(index)
        if factors != (1.0, 1.0):
            motion = self._paced(motion, f"paced {self._place(index)}", factors)
        return FrameViews(
            color=light,
            motion=self._views.of(motion),
            depth=depth and self._views.of(depth),
            holdout=self._held_out(index, held),
            key=object(),
        )

    def _light(self, index: int) -> wgpu.GPUTexture:
        """The texture of one picture, kept until others need its place."""
        coded = self.shots[index].content.coded
        if known := index in self._lights:
            self._lights[index] = self._lights.pop(index)
        else:
            free = {f"light {n}" for n in range(LIGHTS)} - set(self._lights.values())
            oldest = next(iter(self._lights), None)
            self._lights[index] = min(free) if free else self._lights.pop(oldest or 0)
        texel = self._planes.texel(coded.coding)
        texture = self._images.texture(self._lights[index], coded.size, texel)
        if not known:
            self._planes.draw(coded, texture)
        return texture

    def _held_out(self, index: int, plane: np.ndarray | None) -> View | None:
        """View of the mask of the areas of a picture that stay sharp."""
        texel = TEXTURES["holdout"]["format"]
        if plane is None:
            return None
        if plane is not self._holdout.mask:
            return self._images.upload(f"display {self._place(index)}", plane, texel)
        if self._mask is None:
            self._mask = self._images.upload("holdout", plane, texel)
        return self._mask

    def _factors(self, index: int) -> tuple[float, float]:
        """See exposure.evened."""
        before, after = (self.shots.neighbour(index, side) for side in (-1, 1))
        near = [i for i in (before, index, after) if i is not None]
        times = np.array([self.shots[i].time for i in near])
        back, ahead = (i is not None for i in self._led_to(index))
        return evened(times, near.index(index), (back, ahead), self.shots.tolerance)

    def _paced(
        self, motion: wgpu.GPUTexture, name: str, factors: tuple[float, float]
    ) -> wgpu.GPUTexture:
        """A copy of a motion, multiplied."""
        size = motion.size[0], motion.size[1]
        output = self._images.texture(name, size, "rgba32float")
        file = "video/gpu_frames.wgsl"
        encoder = gpu.encoder(self._device, "pace")
        gpu.kernel(self._device, file).run(
            encoder,
            "main",
            self._frame_of(size),
            pace={"factors": np.repeat(factors, 2)},
            motion=self._views.of(motion),
            output=self._images.view_of(output),
        )
        gpu.hand_in(self._device, encoder)
        return output
