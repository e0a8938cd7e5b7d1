"""A frame's file to a Frame: picture, vectors, depth and masks by their layers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..camera import MAX_INDEX
from ..errors import InputError
from ..frame import Frame
from .flow_motion import Found, standing
from .frame_cache import FrameCache
from .frame_file import FrameFile, about
from .layers import alpha, light, vectors
from .layers import names as layers
from .layers.camera_file import CameraFile
from .layers.masks import Masks
from .layers.vector_convention import ConventionFinder
from .layers.vector_test import ConventionFinding

ALONE = "alone in a shot, so no motion can be found: copied"
"""The line about such a frame, or picture of a video, after its number."""
_OBJECT_STEMS = ("indexob", "objectindex", "object_id")

OPTIONAL = frozenset({"color", "diffuse_light", *layers.TRIPLES})
"""Inputs that are read only if they are wanted; "diffuse_light" stands for all passes of light."""


class FrameBuilder:
    """Makes Frames of the files in `stored`, as its Passes ask for.

    `cameras`: those of every view to blur. `picture_motion`: motion where the files hold none.
    `brighten`: changes the light of pictures for the blur.
    """

    def __init__(
        self,
        stored: FrameCache,
        finder: ConventionFinder,
        masks: Masks,
        cameras: Mapping[str | None, CameraFile],
    ):
        self._stored, self._finder, self._masks = stored, finder, masks
        self._cameras = cameras
        self.picture_motion: Callable[[FrameFile], Found | None] | None = None
        self.brighten: Callable[[np.ndarray], np.ndarray] = lambda rgba: rgba

    @property
    def finding(self) -> ConventionFinding:
        """Meaning of the vectors."""
        return self._finder.finding

    def build(self, source: FrameFile, wanted: frozenset[str]) -> Frame:
        """The Frame of `source` as its layers have it; of OPTIONAL, only the fields in `wanted`.

        Without "color", its colour is 0.
        """
        passes, own = self._stored.passes, self._stored.own(source)
        convention = self._finder.finding.vectors
        with about(source.name):
            if convention is None:  # where a layer was asked for, this says why there is none
                convention = vectors.named(own, passes.vectors, source.reference_channel)
            motion = reprojections = ids = None
            depth = self._depth(source)
            if convention is not None:
                if "color" in wanted:
                    self._check_vectors(source, convention)
                motion = vectors.read(own, convention, source.reference_channel)
            camera = self._cameras.get(source.view)
            if motion is None and camera is None and self.picture_motion is not None:
                motion, guessed = self.picture_motion(source) or self._alone(source)
                depth = guessed if depth is None else depth
            if camera is not None:
                if depth is None:
                    there = ", ".join(layers.layers(source.channels))
                    raise InputError(f"motion from a camera needs depth; available layers: {there}")
                kind = "clip" if passes.depth_kind == "clip" else "planar"
                reprojections = camera.around(
                    source.number, depth_kind=kind, far=passes.far, window=source.window
                )
                ids = self._object_ids(source) if reprojections.here.bodies else None
            return Frame(
                self.brighten(self._color(source))
                if "color" in wanted
                else np.zeros((*source.size[::-1], 3), np.float16),
                motion=motion,
                depth=depth,
                **self._triples(source, wanted),
                **(self._light(source) if "diffuse_light" in wanted else {}),
                window=source.window,
                camera=reprojections,
                object_id=ids,
                holdout=self._masks.holdout(source),
                scale=self._masks.scale(source),
                object_motion=passes.object_motion,
                number=source.number,
            )

    def _check_vectors(self, source: FrameFile, convention: vectors.Vectors) -> None:
        """InputError where the picture would be read as vectors."""
        own, near = self._stored.own(source), source.reference_channel
        sides = vectors.channels_of(own, convention, near)
        both = {name for pair in sides.values() for name in pair} & set(source.color)
        if both:
            raise InputError(
                f"{', '.join(sorted(both))} of the picture itself would be read as vectors; "
                "`vector_layer` names another layer, and `also` adds one of another file"
            )

    def _alone(self, source: FrameFile) -> Found:
        """No motion, of a frame that has no neighbour in its shot to find motion from; noted."""
        on = self._stored.notes.setdefault(ALONE, [])
        if source.number not in on:
            on.append(source.number)
        return standing(source)

    def _color(self, source: FrameFile) -> np.ndarray:
        """The picture, premultiplied; alpha that seems to mean something else is noted."""
        rgba, notes = source.rgba, self._stored.notes
        if rgba.shape[2] == 3:
            return rgba
        if self._stored.passes.alpha == "straight":
            return alpha.premultiplied(rgba)
        remark = alpha.remark(rgba)
        if remark and source.number not in (on := notes.setdefault(remark, [])):
            on.append(source.number)
        return rgba

    def check_layers(self) -> None:
        """InputError where a layer that is asked for by its name is in none of the frames.

        The first frame is looked at, and only if it lacks one the middle and the last one.
        """
        stored, passes = self._stored, self._stored.passes
        is_any = any((passes.color, *passes.layers))
        if not is_any and passes.vectors.convention in ("auto", "none"):
            return
        first: layers.MissingLayerError | None = None
        numbers = stored.numbers
        for number in dict.fromkeys(numbers[i] for i in (0, len(numbers) // 2, -1)):
            try:
                for source in stored.sources(number):
                    self.build(source, OPTIONAL)
                return
            except layers.MissingLayerError as error:
                first = first or error
            except (InputError, OSError):  # its turn to fail comes
                return
        if first is not None:
            raise first

    def light_passes(self, source: FrameFile) -> light.LightPasses:
        """The passes of light of a frame's picture."""
        return light.find(self._stored.own(source), source.reference_channel)

    def _depth(self, source: FrameFile) -> np.ndarray | None:
        passes = self._stored.passes
        name = layers.find_depth(self._stored.own(source), passes.depth, source.reference_channel)
        if name is None:
            return None
        depth = source.channels[name].astype(np.float32, copy=False)
        kind = self._finder.depth_kind
        if kind == "white-near" and (depth < 0).any():  # places along the axis towards the camera
            return np.where(depth < 0, -depth, np.inf).astype(np.float32)
        if kind in ("inverse", "white-near"):
            with np.errstate(divide="ignore"):
                depth = np.where(depth > 0, 1 / depth, np.inf).astype(np.float32)
        return depth

    def _triples(self, source: FrameFile, wanted: frozenset[str]) -> dict[str, Any]:
        """Fields of Frame that are layers of three channels, as far as there are such."""
        made = {}
        for name in wanted & layers.TRIPLES.keys():
            stems, near = layers.TRIPLES[name], source.reference_channel
            if names := layers.find_triple(self._stored.own(source), stems, near):
                planes = [source.channels[channel] for channel in names]
                made[name] = np.stack(planes, 2, dtype=np.float32)
        return made

    def _light(self, source: FrameFile) -> dict[str, Any]:
        """Fields of Frame; layers that are not used are noted."""
        found, notes = self.light_passes(source), self._stored.notes
        if found.lacking and source.number not in (on := notes.setdefault(found.lacking, [])):
            on.append(source.number)
        return light.read(source.channels, found)

    def _object_ids(self, source: FrameFile) -> np.ndarray | None:
        by_layer = layers.layers(source.channels, near=source.reference_channel)
        name = self._stored.passes.object_layer
        if name is None:
            named = [k for k in by_layer if layers.stem(k) in _OBJECT_STEMS]
            if not named:
                return None
            name = named[0]
        plane = source.channels[layers.one_channel(by_layer, name, "object index layer")]
        with np.errstate(invalid="ignore"):
            index = np.rint(plane.astype(np.float64))
            return np.where(index > 0, np.minimum(index, MAX_INDEX), 0).astype(np.uint32)
