"""Holdouts of a video: its displays, image files, or the pixels that never change."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..color.coding import CodedPicture
from ..color.srgb import srgb
from ..errors import InputError, counted, size_text
from ..files import bounded
from ..io import stills
from ..shots.reader import Shots
from .displays import Displays
from .read.reader import VideoReader
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

    def of(self, shots: Shots[Thumbnail], ahead: bool = False) -> Held:
        """Masks of pictures, by their indices. `ahead`: see Displays."""
        found = Displays(
            lambda index: shots[index].content,
            shots.moves_on,
            self.always,
            ahead,
            grey=lambda thumbnail: thumbnail.grey,
        )

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
            f"static areas before a moving background, such as displays, stay sharp: "
            f"{share:.1f} % of {counted(len(self.shares), 'picture')}; `holdout` none blurs all"
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
        plane = overlay_of(reader) if name == STATIC else _matte(name, reader.size)
        whole = plane if whole is None else np.maximum(whole, plane)
    is_static = STATIC in names
    return Holdout(whole, displays=is_static or not names, always=is_static)


def check_masks(masks: tuple[str, ...]) -> None:
    """InputError for NONE among others, and for files that are no images or not there."""
    if NONE in masks and len(masks) > 1:
        raise InputError("`holdout` none cannot be combined with other masks")
    for path in files_of(masks):
        if path.suffix.lower() not in stills.SUFFIXES:
            known = f"{STATIC}, {NONE}, or an image file {' '.join(stills.SUFFIXES)}"
            raise InputError(f"`holdout` of a video must be {known}; got {str(path)!r}")
        if not path.is_file():
            raise bounded.missing(path)


def check_sizes(masks: Iterable[str], size: tuple[int, int]) -> None:
    """InputError for image files that cannot be read, or are not of the video's size."""
    for path in files_of(masks):
        _matte(str(path), size)


def files_of(masks: Iterable[str]) -> list[Path]:
    """The files among the masks."""
    return [Path(mask) for mask in masks if mask not in (STATIC, NONE)]


def _matte(name: str, size: tuple[int, int]) -> np.ndarray:
    plane = srgb(stills.read(name)[..., 0])
    if plane.shape[::-1] != size:
        expected = "{} x {}".format(*size)
        raise InputError(f"{name} must be {expected} like the video, got {size_text(plane)}")
    return plane


# ---- static areas of a video whose surroundings change: a head-up display, a logo, borders ----


_SAMPLES = 48  # pictures looked at
_NOISE = 4 / 255  # of the range of a sample, that codecs change in what is still
_AROUND = 16  # pixels to each side
_CHANGES = 0.25  # share of changes around a pixel from which it stands out by not changing


def overlay_of(reader: VideoReader) -> np.ndarray:
    """(height, width) float32: 1 where nothing changes although the surroundings do.

    Looked for in pictures from all over the video.
    """
    width, height = reader.size
    numbers = np.unique(np.linspace(0, len(reader) - 1, _SAMPLES).astype(int))
    still = np.ones((height, width), bool)
    changes = np.zeros((height, width), np.float32)
    before: list[np.ndarray] | None = None
    first: list[np.ndarray] | None = None
    count = 0
    for number in numbers:
        for _, picture in reader.pictures(int(number), int(number)):
            planes = _planes(picture)
            if first is None or before is None:
                first = before = planes
                continue
            changed = _differ(planes, before)
            still &= ~_differ(planes, first) & ~changed
            changes += changed
            before, count = planes, count + 1
    busy = _mean_around(changes / max(count, 1)) > _CHANGES
    return (still & busy).astype(np.float32)


def _planes(picture: CodedPicture) -> list[np.ndarray]:
    """The planes as float32 shares of their range, all of the picture's size."""
    width, height = picture.size
    most, step = np.float32(2**picture.coding.bits - 1), picture.coding.steps
    full = []
    for plane in picture.planes[:3]:
        if plane.shape != (height, width):
            plane = np.repeat(np.repeat(plane, step[1], 0), step[0], 1)[:height, :width]
        full.append(plane / most)
    return full


def _differ(a: list[np.ndarray], b: list[np.ndarray]) -> np.ndarray:
    return np.any([np.abs(x - y) > _NOISE for x, y in zip(a, b, strict=True)], axis=0)


def _mean_around(plane: np.ndarray) -> np.ndarray:
    """The mean of the pixels up to _AROUND to each side."""
    padded = np.pad(plane, ((_AROUND + 1, _AROUND), (_AROUND + 1, _AROUND)), mode="edge")
    total = padded.astype(np.float64).cumsum(axis=0).cumsum(axis=1)
    side = 2 * _AROUND + 1
    inner = (
        total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side]
    )
    return inner / side**2
