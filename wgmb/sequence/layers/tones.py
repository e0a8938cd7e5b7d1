"""Pictures as they are compared in tests of vectors and depth."""

from __future__ import annotations

import numpy as np

_BRIGHT = 1e4  # light beyond this is all the same


def tone(color: np.ndarray) -> np.ndarray:
    """Float16, held to 0..1 without hard limit, so that one highlight does not decide."""
    light = np.clip(np.nan_to_num(color.astype(np.float32)), 0, _BRIGHT)
    return (light / (1 + light)).astype(np.float16)


def bilinear(image: np.ndarray, where: np.ndarray) -> np.ndarray:
    """(n, channels) of an image at places (n, 2), x and y [px]; its edge where they are outside."""
    height, width = image.shape[:2]
    x = np.clip(where[:, 0], 0, width - 1.001)
    y = np.clip(where[:, 1], 0, height - 1.001)
    left, top = x.astype(int), y.astype(int)
    right, below = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    u, v = (x - left)[:, None], (y - top)[:, None]
    upper = (1 - u) * image[top, left] + u * image[top, right]
    lower = (1 - u) * image[below, left] + u * image[below, right]
    return (1 - v) * upper + v * lower
