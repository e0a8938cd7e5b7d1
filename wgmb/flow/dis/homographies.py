"""Homographies by OpenCV: that of the dominant motion, and the motion that one gives."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

_POINTS = 40  # along the longer side, to which the homography is fitted


def _cv() -> Any:
    """OpenCV, which is optional."""
    return importlib.import_module("cv2")


def homography_of(way: np.ndarray) -> np.ndarray:
    """The homography (3, 3) of the dominant motion in a motion (height, width, 2) [px].

    Its median distance from the motion is the least (Rousseeuw, 1984), so no limit is needed.
    """
    height, width = way.shape[:2]
    step = max(1, max(width, height) // _POINTS)
    y, x = np.mgrid[step // 2 : height : step, step // 2 : width : step]
    points = np.stack([x.ravel(), y.ravel()], 1).astype(np.float64)
    if len(points) < 4:
        return np.eye(3)
    moved = points + way[y, x].reshape(-1, 2)
    fitted, _ = _cv().findHomography(points, moved, _cv().LMEDS)
    return np.eye(3) if fitted is None else fitted


def ways_of(matrix: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements by a homography, right and down, from places, float32 [px].

    `x` (columns), `y` (rows, 1): float32.
    """
    # In place: the pages of large arrays cost as much as the arithmetic.
    across, down, scale = (a * x + (b * y + c) for a, b, c in matrix.astype(np.float32))
    for way, place in ((across, x), (down, y)):
        way /= scale
        way -= place
    return across, down
