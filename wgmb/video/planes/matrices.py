"""Samples to signals and back: matrix coefficients and range (ITU-T H.273, section 8.3)."""

from __future__ import annotations

import numpy as np

from ...color.coding import FLOAT, Coding
from ...errors import InputError

_RED_BLUE = {  # KR, KB by the number of the matrix
    1: (0.2126, 0.0722),  # BT.709
    4: (0.30, 0.11),  # FCC
    5: (0.299, 0.114),  # BT.601, 625 lines
    6: (0.299, 0.114),  # BT.601, 525 lines
    7: (0.212, 0.087),  # SMPTE 240M
    9: (0.2627, 0.0593),  # BT.2020, non-constant luminance
}
_YCGCO = 8


def from_samples(coding: Coding) -> np.ndarray:
    """(3, 4) signals R, G, B, 0..1, from the samples of the three planes and 1.

    For grey, of the same sample three times. InputError for a matrix that is not known here.
    """
    scale, offset = _range(coding)
    return np.hstack([_rgb_from(coding) * scale, (_rgb_from(coding) @ offset)[:, None]])


def to_samples(coding: Coding) -> np.ndarray:
    """(3, 4) samples of the three planes from the signals R, G, B, 0..1, and 1."""
    scale, offset = _range(coding)
    return np.hstack(
        [np.linalg.inv(_rgb_from(coding)) / scale[:, None], (-offset / scale)[:, None]]
    )


def _range(coding: Coding) -> tuple[np.ndarray, np.ndarray]:
    """Factor and offset of the samples, for each plane."""
    most, unit = 2**coding.bits - 1, 2 ** (coding.bits - 8)
    if coding.bits == FLOAT:
        return np.ones(3), np.zeros(3)
    if coding.full_range:
        scale, black, middle = np.full(3, 1 / most), 0.0, 2 ** (coding.bits - 1)
    else:
        scale = np.array([1 / (219 * unit), 1 / (224 * unit), 1 / (224 * unit)])
        black, middle = 16 * unit, 128 * unit
    if coding.model != "yuv":
        return np.full(3, scale[0]), np.full(3, -black * scale[0])
    return scale, -np.array([black, middle, middle]) * scale


def _rgb_from(coding: Coding) -> np.ndarray:
    """(3, 3) R, G, B from Y, Cb, Cr."""
    if coding.model != "yuv":
        return np.eye(3)
    if coding.matrix == _YCGCO:
        return np.array([[1.0, -1, 1], [1, 1, 0], [1, -1, -1]])
    if coding.matrix not in _RED_BLUE:
        known = ", ".join(map(str, sorted([*_RED_BLUE, _YCGCO])))
        raise InputError(f"matrix {coding.matrix} of H.273 is not known; these are: {known}")
    red, blue = _RED_BLUE[coding.matrix]
    green = 1 - red - blue
    return np.array([
        [1, 0, 2 * (1 - red)],
        [1, -2 * blue * (1 - blue) / green, -2 * red * (1 - red) / green],
        [1, 2 * (1 - blue), 0],
    ])  # fmt: skip
