"""Signs that a file holds a panorama of 360 degrees: an attribute, its shape, joined edges."""

from __future__ import annotations

import numpy as np

from .data_windows import size_of
from .frame_file import FrameFile

WRAPS = ("auto", "on", "off")
_LATLONG = "LATLONG"  # of OpenEXR's attribute `envmap`
_JOINED = 2.0  # times the change from column to column, that edges of one meridian differ at most
_TEXTURE = 1 / 512  # change from column to column under which edges tell nothing [share of white]


def is_stated(source: FrameFile) -> bool:
    """True if the file says that it holds a panorama: the attribute `envmap` is "latlong"."""
    return getattr(source.attributes.get("envmap"), "name", "").endswith(_LATLONG)


def has_shape(source: FrameFile) -> bool:
    """True if the picture is whole, and twice as wide as high."""
    width, height = size_of(source.display_window)
    return source.data_window == source.display_window and width == 2 * height


def may_be(source: FrameFile) -> bool:
    """True if the file's attribute or shape is that of a panorama."""
    return has_shape(source) or is_stated(source)


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
