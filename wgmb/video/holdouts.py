"""Holdouts of a video: image files, or the pixels that never change while all around them do."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..color.srgb import srgb
from ..errors import InputError, size_text
from ..io import stills
from .read.reader import VideoReader
from .static_areas import overlay_of

STATIC = "static"  # as a holdout: what never changes while all around it does


def holdout_of(masks: Iterable[str], reader: VideoReader) -> np.ndarray | None:
    """(height, width) float32, 1 stays sharp: all masks together; None without any.

    A mask is STATIC or an image file of the video's size, of whose first channel the display values
    count; InputError for others.
    """
    whole: np.ndarray | None = None
    for mask in masks:
        plane = overlay_of(reader) if mask == STATIC else _matte(mask)
        if plane.shape[::-1] != reader.size:
            expected = "{} x {}".format(*reader.size)
            raise InputError(f"{mask} must be {expected} like the video, got {size_text(plane)}")
        whole = plane if whole is None else np.maximum(whole, plane)
    return whole


def files_of(masks: Iterable[str]) -> list[Path]:
    """The files among the masks."""
    return [Path(mask) for mask in masks if mask != STATIC]


def _matte(mask: str) -> np.ndarray:
    if Path(mask).suffix.lower() not in stills.SUFFIXES:
        known = f"{STATIC}, or an image file {' '.join(stills.SUFFIXES)}"
        raise InputError(f"holdout of a video must be {known}; got {mask!r}")
    return srgb(stills.read(mask)[..., 0])
