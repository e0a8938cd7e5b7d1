"""The motion of most of a picture: a homography, found in spite of all that moves otherwise.

RANSAC (Fischler and Bolles, "Random Sample Consensus", 1981) with a fixed number of fixed
samples, then least squares on what agrees with the best of them.
"""

from __future__ import annotations

import numpy as np

SAMPLES = 500  # of four points each
POINTS = 4
TOLERANCE = 3.0 / 640  # of the longer side, unless another one is asked for
REFINEMENTS = 3


def dominant_homography(
    points: np.ndarray, motion: np.ndarray, longest: float, tolerance: float = TOLERANCE
) -> np.ndarray:
    """The (3, 3) matrix that moves most of `points` (count, 2) [px] by their `motion` (count, 2).

    `longest`: the picture's longer side [px]; `tolerance`: of that, how far a point may end from
    where the matrix moves it. The unit matrix if there are too few points.
    """
    if len(points) < POINTS:
        return np.eye(3)
    here = (2 * points.astype(float) - points.max(axis=0)) / longest  # about -1 to 1
    there = here + 2 * motion.astype(float) / longest
    tolerance *= 2
    picks = np.random.default_rng(0).integers(0, len(here), (SAMPLES, POINTS))
    candidates = np.concatenate([np.eye(3)[None], _fits(here[picks], there[picks])])
    best = max(candidates, key=lambda h: _agreement(h, here, there, tolerance))
    for _ in range(REFINEMENTS):
        near = _apart(best, here, there) <= tolerance
        if near.sum() < POINTS:
            break
        fitted = _least_squares(here[near], there[near])
        best = max(best, fitted, key=lambda h: _agreement(h, here, there, tolerance))
    scale = np.diag([2 / longest, 2 / longest, 1.0])
    scale[:2, 2] = -points.max(axis=0) / longest
    return np.linalg.inv(scale) @ best @ scale


def columns(homography: np.ndarray) -> np.ndarray:
    """A (3, 3) homography as WGSL takes it: columns of a matrix of 4 x 4."""
    whole = np.eye(4)
    whole[:3, :3] = homography
    return whole.T  # row i in numpy is column i in WGSL


def enlarged(homography: np.ndarray, factor: float) -> np.ndarray:
    """A (3, 3) homography from pixels to pixels of a picture that is so many times as large."""
    scale = np.diag([factor, factor, 1.0])
    return scale @ homography @ np.linalg.inv(scale)


def _equations(here: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and right sides for the 8 unknowns of homographies whose last entry is 1."""
    x, y, u, v = here[..., 0], here[..., 1], there[..., 0], there[..., 1]
    one, zero = np.ones_like(x), np.zeros_like(x)
    across = np.stack([x, y, one, zero, zero, zero, -u * x, -u * y], axis=-1)
    down = np.stack([zero, zero, zero, x, y, one, -v * x, -v * y], axis=-1)
    return np.concatenate([across, down], axis=-2), np.concatenate([u, v], axis=-1)


def _fits(here: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Homographies of samples (count, 4, 2), without those of points on a line."""
    rows, sides = _equations(here, there)
    good = np.abs(np.linalg.det(rows)) > 1e-9
    solved = np.linalg.solve(rows[good], sides[good][..., None])[..., 0]
    last = np.ones((len(solved), 1))
    return np.concatenate([solved, last], axis=1).reshape(-1, 3, 3)


def _least_squares(here: np.ndarray, there: np.ndarray) -> np.ndarray:
    rows, sides = _equations(here, there)
    solved = np.linalg.lstsq(rows, sides, rcond=None)[0]
    return np.append(solved, 1.0).reshape(3, 3)


def _agreement(homography, here, there, tolerance: float) -> float:
    """Number of points that end where the homography moves them; near ends count less."""
    return float(np.maximum(0, 1 - _apart(homography, here, there) / tolerance).sum())


def _apart(homography, here, there) -> np.ndarray:
    """Distance of every point's end from where the homography moves it."""
    moved = here @ homography[:, :2].T + homography[:, 2]
    in_front = moved[:, 2] > 0.1
    apart = moved[:, :2] / np.where(in_front, moved[:, 2], 1.0)[:, None] - there
    return np.where(in_front, np.hypot(apart[:, 0], apart[:, 1]), np.inf)
