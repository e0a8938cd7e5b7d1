"""Panoramas of 360 degrees: equirectangular frames, whose left and right edge are one meridian.

A renderer writes the motion of a body that crosses this edge as nearly the width. Here it is the
short way, and a blur reads beyond one edge the pixels inside the other. The poles stay edges.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..extent import Box
from ..frame import Frame
from .data_windows import Window, size_of
from .frame_file import FrameFile

WRAPS = ("auto", "on", "off")
_LATLONG = "LATLONG"  # of OpenEXR's attribute `envmap`
_STEP = 128  # room beyond an edge is a multiple of it [px], so that neighbours often have the same
_JOINED = 2.0  # times the change from column to column, that edges of one meridian differ at most
_TEXTURE = 1 / 512  # change from column to column under which edges tell nothing [share of white]


def is_stated(source: FrameFile) -> bool:
    """True if the file says that it holds a panorama: the attribute `envmap` is "latlong"."""
    return getattr(source.attributes.get("envmap"), "name", "").endswith(_LATLONG)


def has_shape(source: FrameFile) -> bool:
    """True if the picture is whole, and twice as wide as high."""
    width, height = size_of(source.display_window)
    return source.data_window == source.display_window and width == 2 * height


def joins(rgba: np.ndarray) -> bool:
    """True if the left edge goes on where the right one ends: a texture runs through both.

    rgba: (height, width, 3 or 4), linear.
    """
    edges = rgba[:, [-2, -1, 0, 1], :3].astype(np.float32)
    with np.errstate(invalid="ignore"):
        shown = np.sqrt(np.clip(np.nan_to_num(edges), 0, 1))  # about as bright as it looks
    before, across, after = (np.abs(np.diff(shown, axis=1))).mean(axis=(0, 2))
    inside = (before + after) / 2
    return bool(inside > _TEXTURE and across <= _JOINED * inside)


def crosses(motion: np.ndarray | None) -> bool:
    """True if vectors, (height, width, 4) [px], are longer than half the width."""
    if motion is None:
        return False
    with np.errstate(invalid="ignore"):
        return bool((np.abs(motion[..., ::2]) > motion.shape[1] / 2).any())


def shortest(frame: Frame) -> Frame:
    """The frame with motion by the short way around: within half the width to either side."""
    if not crosses(frame.motion):
        return frame
    assert frame.motion is not None
    motion = frame.motion.copy()
    width = motion.shape[1]
    with np.errstate(invalid="ignore"):
        motion[..., ::2] -= width * np.rint(motion[..., ::2] / width)
    return replace(frame, motion=motion)


def room(width: int) -> int:
    """Columns beyond either edge in which motion is searched: a quarter of the width."""
    return -(-width // 4)


def widened(picture: np.ndarray) -> np.ndarray:
    """The picture (height, width, ...) with `room` beyond its sides, read around them."""
    width = picture.shape[1]
    columns = np.arange(-room(width), width + room(width))
    return np.take(picture, columns % width, axis=1)


def canvas(display: Window, boxes: list[Box]) -> Window:
    """The window with room beyond its left and right edge for content that reaches `boxes`.

    Content that leaves one side comes in from the other: both have the same room, of at most half
    the width.
    """
    left, top, right, bottom = display
    beyond = max((max(left - box[0], box[2] - right) for box in boxes), default=0)
    half = size_of(display)[0] // 2
    room = min(-(-max(beyond, 0) // _STEP) * _STEP, half)
    return left - room, top, right + room, bottom


def placed(frame: Frame, window: Window, onto: Window) -> Frame:
    """`frame`, which fills `window`, on the wider canvas `onto`: pixels beyond an edge are
    read around the other one."""
    if window == onto:
        return frame
    if frame.camera is not None:
        raise InputError(
            "a panorama takes no camera file: that is for perspective and orthographic"
        )
    columns = np.arange(onto[0], onto[2] + 1) - window[0]
    width = size_of(window)[0]
    arrays = {name: np.take(array, columns % width, axis=1) for name, array in frame.arrays.items()}
    x, y, *display = frame.window or (0, 0, *size_of(window))
    return replace(frame, **arrays, window=(x + onto[0] - window[0], y, *display))
