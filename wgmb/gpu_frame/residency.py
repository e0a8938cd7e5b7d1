"""Residency: keeps track of the frames on the GPU and their textures.

Four caches hold the data shared by the frames of a sequence. They depend on one another; a frame
counts as unchanged only while its arrays are the same objects and read-only:

- `Clip` keeps the last three files read, and the frames made of them, by number;
- `Residency` uploads the arrays of a locked frame once, and knows them again by identity;
- a method may keep data derived from a frame's views, by their `key` (see FrameViews);
- `TexturePool` keeps textures by name, so that the next frame's go into the same ones.
"""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .. import gpu
from ..frame import Frame
from ..gpu.textures import TexturePool
from .views import TEXTURES, FrameViews, View

# For a frame, its neighbours and those beyond them, by the end of their textures' names.
_PLACES = (" a", " b", " c", " d", " e")


class _ResidentFrame:
    """A locked frame that was uploaded, and its views."""

    def __init__(self, frame: Frame, views: FrameViews):
        self.views = views
        self._arrays = {name: weakref.ref(array) for name, array in frame.arrays.items()}
        self._rest = frame.camera, frame.object_motion, frame.window

    def is_of(self, frame: Frame) -> bool:
        """Return True if these are the arrays of `frame`, unchanged."""
        given = frame.arrays
        return (
            frame.is_locked
            and given.keys() == self._arrays.keys()
            and all(self._arrays[name]() is array for name, array in given.items())
            and frame.camera is self._rest[0]
            and (frame.object_motion, frame.window) == self._rest[1:]
        )


class Residency:
    """Uploads frames, those that are locked once.

    `wanted`: layers that the method needs or uses; `most`: frames that it takes at once.
    """

    def __init__(self, images: TexturePool, wanted: frozenset[str], most: int):
        self._images, self._wanted, self._most = images, wanted, most
        self._resident: dict[str, _ResidentFrame] = {}

    def views_of(self, frames: Mapping[int, Frame]) -> dict[int, FrameViews]:
        """Return the views of up to five frames by the same keys; uploads missing frames."""
        places = {key: self._place_of(frame) for key, frame in frames.items()}
        free = [p for p in _PLACES[: self._most] if p not in places.values()]
        views: dict[int, FrameViews] = {}
        for key, frame in frames.items():
            # Looked up again, as the same frame may stand at two offsets.
            place = self._place_of(frame)
            if place is not None:
                views[key] = self._resident[place].views
                continue
            place = free.pop(0)
            self._resident.pop(place, None)
            views[key] = self._upload(frame, place)
            if frame.is_locked:
                views[key] = replace(views[key], key=object())
                self._resident[place] = _ResidentFrame(frame, views[key])
        return views

    def forget(self) -> None:
        """Upload everything again, because recorded commands may not have been executed."""
        self._resident.clear()

    def _place_of(self, frame: Frame) -> str | None:
        return next((place for place, held in self._resident.items() if held.is_of(frame)), None)

    def _upload(self, frame: Frame, place: str) -> FrameViews:
        color = padded(frame.color, 4, 1)
        half = color.dtype == np.float16
        four = "rgba16float" if half else gpu.texel(self._images.device, 4)
        views: dict[str, View] = {}
        for name, texture in TEXTURES.items():
            array = getattr(frame, name)
            used = not texture["if_used"] or name in self._wanted
            used |= name == "depth" and frame.camera is not None
            if array is not None and used:
                array = padded(array, 4, 0) if texture["format"].startswith("rgba") else array
                views[name] = self._images.upload(name + place, array, texture["format"])
        return FrameViews(
            color=self._images.upload("color" + place, color, four),
            window=frame.window,
            camera=frame.camera,
            object_motion=frame.object_motion,
            check=bool(frame.bad.keys() - {"depth"}),
            **views,
        )


def padded(array: np.ndarray, channels: int, value: float) -> np.ndarray:
    """The array with as many channels, the new ones of one value."""
    if array.shape[2] == channels:
        return array
    padded = np.full((*array.shape[:2], channels), value, array.dtype)
    padded[..., : array.shape[2]] = array
    return padded
