"""Luminance and subsampled chroma (Y, RY, BY) to R, G and B, as OpenEXR's own RGBA reader does.

RY = (R - Y) / Y and BY = (B - Y) / Y, stored for every second pixel of every second row.
OpenEXR, "Technical Introduction", section "Luminance/Chroma Images"; the filter's taps are those
of its ImfRgbaYca.cpp.
"""

from __future__ import annotations

import numpy as np

from ..errors import InputError

# Of the stored samples at distance 1, 3, ... 13, on both sides of a pixel without one.
_TAPS = (0.627123, -0.186077, 0.087929, -0.043159, 0.019597, -0.007540, 0.002128)
_REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)


def weights(chromaticities: object = None) -> np.ndarray:
    """Shares of R, G and B in luminance, sum 1: the second row of their matrix to CIE XYZ.

    `chromaticities`: x and y of red, green, blue and white, as the attribute has them; Rec. 709
    by default. InputError where no colour space has them.
    """
    given = _REC709 if chromaticities is None else chromaticities
    try:
        xy = np.array(given, np.float64).reshape(4, 2)
        columns = np.column_stack([xy, 1 - xy.sum(axis=1)]).T
        white = columns[:, 3] / xy[3, 1]
        luminances = np.linalg.solve(columns[:, :3], white) * xy[:3, 1]
        shares = luminances / luminances.sum()
    except (ValueError, TypeError, ArithmeticError, np.linalg.LinAlgError):
        shares = np.full(3, np.nan)
    if not (np.isfinite(shares).all() and shares[1] != 0):
        raise InputError(f"chromaticities {given} belong to no colour space")
    return shares.astype(np.float32)


def rgb(
    luminance: np.ndarray, chroma: tuple[np.ndarray, np.ndarray], shares: np.ndarray
) -> np.ndarray:
    """(height, width, 3) float32 from luminance and RY, BY of the same size; see `whole`.

    Colours that the filter made purer than their neighbours are held back.
    """
    y = luminance.astype(np.float32)
    ry, by = (c.astype(np.float32) for c in chroma)
    with np.errstate(all="ignore"):
        r, b = (ry + 1) * y, (by + 1) * y
        g = (y - r * shares[0] - b * shares[2]) / shares[1]
        grey = ((ry == 0) & (by == 0))[..., None]
        made = np.where(grey, y[..., None], np.stack([r, g, b], axis=2))
        return _held_back(made, shares)


def whole(plane: np.ndarray, sampling: tuple[int, int]) -> np.ndarray:
    """`plane`, stored for every `sampling` pixels along x and y, with a value for each.

    Between the stored ones the filter's, where they are two pixels apart; else the nearest to
    the left and above.
    """
    for axis, step in ((1, sampling[0]), (0, sampling[1])):
        plane = _between(plane, axis) if step == 2 else plane.repeat(step, axis)
    return plane


def _between(plane: np.ndarray, axis: int) -> np.ndarray:
    """The stored values along an axis, and one from the filter after each."""
    stored = np.moveaxis(plane, axis, 0).astype(np.float32)
    n, reach = len(stored), len(_TAPS)
    padded = np.concatenate([stored[:1].repeat(reach, 0), stored, stored[-1:].repeat(reach, 0)])
    made = np.empty((2 * n, *stored.shape[1:]), np.float32)
    made[0::2], made[1::2] = stored, 0
    for i, tap in enumerate(_TAPS):
        before, after = padded[reach - i : reach - i + n], padded[reach + 1 + i :][:n]
        made[1::2] += np.float32(tap) * (before + after)
    return np.moveaxis(made, 0, axis)


def _held_back(rgb: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Saturation held to 1 - (1 - mean) / 4, the mean over the diagonal neighbours; Y is kept."""
    most = rgb.max(axis=2)
    saturation = np.where(most > 0, 1 - rgb.min(axis=2) / most, 0)
    around = np.pad(saturation, 1, mode="edge")
    mean = (around[:-2, :-2] + around[:-2, 2:] + around[2:, :-2] + around[2:, 2:]) / 4
    limit = 1 - (1 - np.minimum(mean, 1)) / 4
    y, x = np.nonzero((saturation > mean) & (saturation > limit))
    if len(y):
        one, top = rgb[y, x], most[y, x, None]
        held = np.maximum(top - (top - one) * (limit[y, x] / saturation[y, x])[:, None], 0)
        before, after = one @ shares, held @ shares
        rgb[y, x] = held * np.where(after > 0, before / after, 1)[:, None]
    return rgb
