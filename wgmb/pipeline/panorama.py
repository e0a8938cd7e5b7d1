"""Panoramas of 360 degrees: equirectangular frames, whose left and right edge are one meridian.

A renderer writes the motion of a body that crosses this edge as nearly the width. Here it is the
short way, and a blur reads beyond one edge the pixels inside the other. The poles stay edges.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..extent import Extent
from ..frame import Frame

_STEP = 128  # room beyond an edge is a multiple of it [px], so that neighbours often have the same
_MOTION = "motion", "to_next", "to_prev"


def crosses(motion: np.ndarray | None) -> bool:
    """True if vectors, (height, width, 2 or 4) [px], are finite and longer than half the width."""
    if motion is None:
        return False
    across = np.abs(motion[..., ::2])
    return bool(((across > motion.shape[1] / 2) & np.isfinite(across)).any())


def shortest(frame: Frame) -> Frame:
    """The frame with motion by the short way around: within half the width to either side."""
    planes = {name: getattr(frame, name) for name in _MOTION if crosses(getattr(frame, name))}
    return replace(frame, **{name: _short(plane) for name, plane in planes.items()})


def _short(motion: np.ndarray) -> np.ndarray:
    motion = motion.copy()
    width = motion.shape[1]
    with np.errstate(invalid="ignore"):
        motion[..., ::2] -= width * np.rint(motion[..., ::2] / width)
    return motion


def turned(picture: np.ndarray) -> np.ndarray:
    """The picture (height, width, ...) turned by half, so that its two edges are its middle."""
    return np.roll(picture, picture.shape[1] // 2, axis=1)


def joined(image: np.ndarray, other: np.ndarray) -> np.ndarray:
    """An image of a panorama, (height, width, ...): the middle of `image`, and the rest from the
    middle of `other`, that of `turned`."""
    width = image.shape[1]
    whole = np.roll(other, -(width // 2), axis=1)
    whole[:, width // 4 : width - width // 4] = image[:, width // 4 : width - width // 4]
    return whole


class PanoramaCanvas:
    """Panoramas as a blur takes them: with room beyond the left and the right edge.

    A frame that is locked is made once while its room stays the same.
    """

    def __init__(self) -> None:
        self._laid: OrderedDict[int, tuple[Frame, int, Frame]] = OrderedDict()

    def of(self, frames: Mapping[int, Frame], extent: Extent) -> Frame:
        """The frame at 0 with those around it, by their offsets, and room for a blur's `extent`."""
        room = _room(frames, extent)
        while len(self._laid) > 2 * len(frames):
            self._laid.popitem(last=False)
        made = {offset: self._placed(frame, room) for offset, frame in frames.items()}
        for far in (-2, 2):
            if far in made:
                around = (made[far], None) if far < 0 else (None, made[far])
                made[far // 2] = made[far // 2].between(*around)
        return made[0].between(made.get(-1), made.get(1))

    def _placed(self, frame: Frame, room: int) -> Frame:
        key = id(frame.color)
        known, its_room, made = self._laid.get(key, (None, 0, None))
        same = (
            known is not None and known.is_locked and known.arrays.items() == frame.arrays.items()
        )
        if made is None or not same or its_room != room:
            made = placed(shortest(frame.between(None, None)), room).locked()
            self._laid[key] = frame, room, made
        self._laid.move_to_end(key)
        return made


def _are_same(known: Frame | None, frame: Frame) -> bool:
    """True if these are the arrays of a frame made before, which nobody can write to."""
    if known is None or not known.is_locked:
        return False
    own, others = known.arrays, frame.arrays
    return own.keys() == others.keys() and all(own[name] is others[name] for name in own)


def _room(frames: Mapping[int, Frame], extent: Extent) -> int:
    """Columns beyond either edge for content that leaves the frames: at most half the width."""
    width, height = frames[0].size
    if frames[0].window not in (None, (0, 0, width, height)):
        raise InputError(
            "`wrap='on'` needs the whole panorama, but the frame's window is only a part of it"
        )
    if extent.spread == "everywhere":
        return 0
    boxes = [extent.box(shortest(frame), offset) for offset, frame in frames.items()]
    beyond = max((max(-box[0], box[2] - width + 1) for box in boxes if box), default=0)
    return min(-(-max(beyond, 0) // _STEP) * _STEP, width // 2)


def placed(frame: Frame, room: int) -> Frame:
    """The frame with so many columns beyond either edge, read around the other one."""
    width, height = frame.size
    columns = np.arange(-room, width + room) % width
    arrays = {name: np.take(array, columns, axis=1) for name, array in frame.arrays.items()}
    return replace(frame, **arrays, window=(-room, 0, width, height), wrap="off")
