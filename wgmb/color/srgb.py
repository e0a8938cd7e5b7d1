"""Colours: linear light to and from sRGB, and motion as hue and brightness."""

from __future__ import annotations

from typing import Protocol

import numpy as np


def linear(display: np.ndarray) -> np.ndarray:
    """sRGB display values 0..1 -> linear light (IEC 61966-2-1)."""
    high = ((np.maximum(display, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(display <= 0.04045, display / 12.92, high).astype(np.float32)


def srgb(light: np.ndarray) -> np.ndarray:
    """Linear light -> sRGB display values, held to 0..1."""
    light = np.clip(light, 0, 1)
    high = 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, high).astype(np.float32)


class ToDisplay(Protocol):
    """Conversion of pictures to integers for a display: `to_display`, or that of a Display."""

    def __call__(self, rgba: np.ndarray, bits: int, over_black: bool = False) -> np.ndarray:
        """See `to_display`."""
        ...


def to_display(rgba: np.ndarray, bits: int, over_black: bool = False) -> np.ndarray:
    """Linear premultiplied (height, width, 3 or 4) -> sRGB integers of 8 or 16 bits.

    Alpha stays, unassociated; `over_black` drops it, for formats without.
    """
    rgb, alpha = rgba[..., :3], rgba[..., 3 : 3 if over_black else None]
    if alpha.shape[2]:
        rgb = np.divide(rgb, alpha, out=np.zeros_like(rgb), where=alpha > 0)
    if bits == 8:
        shown = _eight_bits()[rgb.astype(np.float16).view(np.uint16)]
        covered = np.rint(np.clip(alpha, 0, 1) * 255).astype(np.uint8)
    else:
        shown = np.rint(srgb(rgb) * 65535).astype(np.uint16)
        covered = np.rint(np.clip(alpha, 0, 1) * 65535).astype(np.uint16)
    return np.concatenate([shown, covered], axis=2) if alpha.shape[2] else shown


def _eight_bits() -> np.ndarray:
    """sRGB of every f16 by its bits: a table instead of a power per pixel."""
    if not _TABLE:
        with np.errstate(all="ignore"):
            halves = np.nan_to_num(np.arange(65536, dtype=np.uint16).view(np.float16).astype("f4"))
        _TABLE.append(np.rint(srgb(halves) * 255).astype(np.uint8))
    return _TABLE[0]


_TABLE: list[np.ndarray] = []


def motion_colors(motion: np.ndarray, fastest: float) -> np.ndarray:
    """(height, width, 3) linear colours 0..1 of `motion` (height, width, 2) [px].

    Hue is the direction (red to the right, then yellow-green down, cyan left, violet up);
    black stands still, full brightness moves `fastest` [px] or more; grey is not finite.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        finite = np.isfinite(motion[..., 0]) & np.isfinite(motion[..., 1])
        x, y = (np.where(finite, motion[..., i], 0) for i in range(2))
        hue = np.arctan2(y, x) / (2 * np.pi) % 1.0
        value = np.clip(np.hypot(x, y) / max(fastest, 1e-6), 0, 1)
    # Three raised cosines a third of a turn apart: a hue circle without hard edges.
    phase = hue[..., None] - np.array([0, 1 / 3, 2 / 3])
    colors = (0.5 + 0.5 * np.cos(2 * np.pi * phase)) * value[..., None]
    return np.where(finite[..., None], colors, 0.2).astype(np.float32)


def motion_picture(motion: np.ndarray, fastest: float) -> np.ndarray:
    """`motion_colors` with the colour wheel in the lower right corner."""
    picture = motion_colors(motion, fastest)
    height, width = picture.shape[:2]
    edge = max(min(height, width) // 5, 8)
    if edge + 4 > min(height, width):
        return picture
    y, x = np.mgrid[:edge, :edge] + 0.5
    around = np.stack([x, y], axis=2) / (edge / 2) - 1
    radius = np.hypot(around[..., 0], around[..., 1])
    wheel = np.where((radius < 1)[..., None], motion_colors(around * fastest, fastest), 0.0)
    wheel[(radius >= 0.96) & (radius < 1)] = 1.0
    corner = picture[height - edge - 4 : height - 4, width - edge - 4 : width - 4]
    corner[radius < 1] = wheel[radius < 1]
    return picture
