"""Static areas of a video whose surroundings change: a head-up display, a logo, borders."""

from __future__ import annotations

import numpy as np

from ..color.coding import CodedPicture
from .read.reader import VideoReader

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
