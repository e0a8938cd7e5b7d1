"""Poses that are held over several frames, as in animation on twos; jumps between them are no
motion.

A surface that moves for one frame interval alone jumps: between the intervals before and after,
in which its vectors agree and are short, as those of the camera are. Real motion is not as short:
a swing of three and a half to five frames, at its fastest just there, alone is mistaken for one.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from ..frame import Frame

TWOS = ("auto", "off")
_STEP = 4  # pixels between those that are looked at first
_JUMP = 3.0  # a jump differs from what is around it by more than this [px],
_CALM = 0.25  # of which its surroundings are less than this share,
_AGREE = 0.02  # and differ from one another by less than this share, and
_EXACT = 0.1  # this [px]
_RETURNS = 1.5  # distance from the start of a vector that leads there and back [px]
_AWAY = 1e4  # a motion out of any picture [px]
_MIXED = 2  # width of outlines, where vectors are mixtures [px]


def may_be_held(motion: np.ndarray) -> bool:
    """Return True if vectors (height, width, 4) of a few pixels lead far to one side only."""
    few = motion[::_STEP, ::_STEP]
    with np.errstate(all="ignore"):
        most = motion.shape[1] / 2
        return bool((_leads_far(few, -1, most) | _leads_far(few, 1, most)).any())


def without_jumps(frame: Frame) -> Frame:
    """The frame without the jumps between poses: paths go on there as they do on the other side.

    Its neighbours' vectors tell. What a neighbour shows of another pose leaves the picture at once:
    it is not seen between the two. The result is `frame` itself where nothing jumps.
    """
    motion = frame.motion
    if motion is None or not may_be_held(motion):
        return frame
    made, beside = motion, [frame.prev, frame.next]
    for k, side in enumerate((-1, 1)):
        near = beside[k]
        if near is None or near.motion is None:
            continue
        jumps = _widened(_jumps(motion, near.motion, side))
        if jumps.any():
            made = made.copy() if made is motion else made
            there, back = _sides(made, side)
            there[jumps] = -back[jumps]
            beside[k] = _without_pose(near, _widened(_jumps(near.motion, motion, -side)))
    return frame if made is motion else replace(frame, motion=made).between(*beside)


def _without_pose(near: Frame, jumps: np.ndarray) -> Frame:
    """A neighbour whose pixels that jump are nowhere else in the picture at any other time."""
    motion = np.array(near.motion)
    motion[jumps] = 0, -_AWAY, 0, _AWAY
    made = copy(near)  # its own neighbours are not read
    object.__setattr__(made, "motion", motion)
    return made.locked()


def _sides(motion: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Views of the vectors to one side, and to the other."""
    back, ahead = motion[..., :2], motion[..., 2:]
    return (back, ahead) if side < 0 else (ahead, back)


def _leads_far(motion: np.ndarray, side: int, most: float) -> np.ndarray:
    """A mask of the vectors that lead far to one side, and hardly anywhere to the other.

    From `most` on [px], half the width, they lead around a panorama.
    """
    jump, hold = _sides(motion, side)
    apart2 = ((jump + hold) ** 2).sum(axis=-1)
    near = (apart2 > _JUMP**2) & (apart2 < most**2)
    return near & ((hold**2).sum(axis=-1) < _CALM**2 * apart2)


def _jumps(motion: np.ndarray, near: np.ndarray, side: int) -> np.ndarray:
    """A mask of the vectors to one side that are a jump; `near` are the neighbour's."""
    with np.errstate(all="ignore"):
        y, x = np.nonzero(_leads_far(motion, side, motion.shape[1] / 2))
        jump, hold = (vectors[y, x] for vectors in _sides(motion, side))
        at = np.stack([x, y], axis=-1) + 0.5 + jump
        inside = ((at >= 0) & (at < near.shape[1::-1])).all(axis=-1)
        y, x, jump, hold = y[inside], x[inside], jump[inside], hold[inside]
        i, j = at[inside].astype(np.intp).T
        beyond, back = (vectors[j, i] for vectors in _sides(near, side))
        most = _AGREE * np.hypot(*(jump + hold).T) + _EXACT
        told = (np.hypot(*(beyond + hold).T) < most) & (np.hypot(*(back + jump).T) < _RETURNS)
    found = np.zeros(motion.shape[:2], bool)
    found[y[told], x[told]] = True
    return found


def _widened(mask: np.ndarray) -> np.ndarray:
    """A mask with all that is at most _MIXED pixels away, across and down."""
    for axis in (0, 1) if mask.any() else ():
        padded = np.pad(mask, [(_MIXED, _MIXED) if axis == k else (0, 0) for k in (0, 1)])
        size = mask.shape[axis]
        parts = (padded.take(range(k, k + size), axis) for k in range(2 * _MIXED + 1))
        mask = np.logical_or.reduce(list(parts))
    return mask
