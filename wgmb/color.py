"""Motion as a picture: direction as hue, speed as brightness, with a legend."""

from __future__ import annotations

import numpy as np


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
