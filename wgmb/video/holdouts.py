"""Holdouts of a video: its displays, image files, or the pixels that never change."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..color.srgb import srgb
from ..errors import InputError, counted, size_text
from ..io import stills
from ..shots.reader import Shots
from .displays import Displays
from .read.reader import VideoReader
from .static_areas import overlay_of
from .thumbnail import Thumbnail

STATIC = "static"  # as a holdout: all that stands while what is around it moves
NONE = "none"  # as a holdout: nothing stays sharp

Held = Callable[[int], np.ndarray | None]
"""(height, width) float32 by the index of a picture: 1 stays sharp."""


@dataclass
class Holdout:
    """Pixels that stay sharp in the pictures of a video, besides those that do not move.

    `mask` (height, width): in every picture, 1 stays sharp. `displays`: also the
    displays found in each picture; `always`: however large they are, see Displays. `shares`: the
    share of each picture that displays took, by its number.
    """

    mask: np.ndarray | None = None
    displays: bool = True
    always: bool = False
    shares: dict[int, float] = field(default_factory=dict)

    def of(self, shots: Shots[Thumbnail]) -> Held:
        """Masks of pictures, by their indices."""
        found = Displays(lambda index: shots[index].content.grey, shots.moves_on, self.always)

        def held(index: int) -> np.ndarray | None:
            display = found.mask(index) if self.displays else None
            if display is None:
                return self.mask
            self.shares[shots[index].number] = float(display.mean())
            plane = display.astype(np.float32)
            return plane if self.mask is None else np.maximum(plane, self.mask)

        return held

    @property
    def message(self) -> str:
        """A line about the displays that were held out, or ''."""
        if not self.shares:
            return ""
        share = 100 * sum(self.shares.values()) / len(self.shares)
        return (
            f"what stands before moving ground stays sharp, such as displays: {share:.1f} % of "
            f"{counted(len(self.shares), 'picture')}; `holdout` none blurs all"
        )


def holdout_of(masks: Iterable[str], reader: VideoReader) -> Holdout:
    """Holdout of a video: without any masks, the displays that are found in it.

    A mask is NONE, STATIC, or an image file of the video's size, of whose first channel the display
    values count; all together hold. InputError for others.
    """
    names = tuple(masks)
    check_masks(names)
    if names == (NONE,):
        return Holdout(displays=False)
    whole: np.ndarray | None = None
    for name in names:
        plane = overlay_of(reader) if name == STATIC else _matte(name)
        if plane.shape[::-1] != reader.size:
            expected = "{} x {}".format(*reader.size)
            raise InputError(f"{name} must be {expected} like the video, got {size_text(plane)}")
        whole = plane if whole is None else np.maximum(whole, plane)
    is_static = STATIC in names
    return Holdout(whole, displays=is_static or not names, always=is_static)


def check_masks(masks: tuple[str, ...]) -> None:
    """InputError for NONE among others."""
    if NONE in masks and len(masks) > 1:
        raise InputError("`holdout` none stands alone: it holds out nothing")


def files_of(masks: Iterable[str]) -> list[Path]:
    """The files among the masks."""
    return [Path(mask) for mask in masks if mask not in (STATIC, NONE)]


def _matte(mask: str) -> np.ndarray:
    if Path(mask).suffix.lower() not in stills.SUFFIXES:
        known = f"{STATIC}, {NONE}, or an image file {' '.join(stills.SUFFIXES)}"
        raise InputError(f"holdout of a video must be {known}; got {mask!r}")
    return srgb(stills.read(mask)[..., 0])
