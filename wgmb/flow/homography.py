"""The motion of most of a picture: a homography, found in spite of all that moves otherwise.

RANSAC (Fischler and Bolles, "Random Sample Consensus", 1981) with a fixed number of fixed
samples, then least squares on the points that agree with the best of them.
"""

from __future__ import annotations

import numpy as np

SAMPLES = 500  # of four points each
POINTS = 4
TOLERANCE = 3.0 / 640  # of the longer side, unless another one is asked for
REFINEMENTS = 3
PARTS = 8  # of the points
AT_ONCE = 64  # homographies: what they are multiplied with stays in the cache, and in one thread
ROUNDING = 1e-6  # sums of agreement that differ by less are equal
IN_FRONT = 0.1  # depth from which a point is seen


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
    ends = _Ends(here, there, tolerance)
    best = ends.best(np.concatenate([np.eye(3)[None], _fits(here[picks], there[picks])]))
    for _ in range(REFINEMENTS):
        near = ends.near(best)
        if near.sum() < POINTS:
            break
        best = ends.best(np.stack([best, _least_squares(here[near], there[near])]))
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


def _equations(here: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and right sides for the 8 unknowns of homographies whose last entry is 1."""
    x, y, u, v = here[..., 0], here[..., 1], other[..., 0], other[..., 1]
    one, zero = np.ones_like(x), np.zeros_like(x)
    across = np.stack([x, y, one, zero, zero, zero, -u * x, -u * y], axis=-1)
    down = np.stack([zero, zero, zero, x, y, one, -v * x, -v * y], axis=-1)
    return np.concatenate([across, down], axis=-2), np.concatenate([u, v], axis=-1)


def _fits(here: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Homographies of samples (count, 4, 2), without those of points on a line."""
    rows, sides = _equations(here, other)
    good = np.abs(np.linalg.det(rows)) > 1e-9
    solved = np.linalg.solve(rows[good], sides[good][..., None])[..., 0]
    last = np.ones((len(solved), 1))
    return np.concatenate([solved, last], axis=1).reshape(-1, 3, 3)


def _least_squares(here: np.ndarray, other: np.ndarray) -> np.ndarray:
    rows, sides = _equations(here, other)
    solved = np.linalg.lstsq(rows.T @ rows, rows.T @ sides, rcond=None)[0]
    return np.append(solved, 1.0).reshape(3, 3)


class _Ends:
    """Points and where they end, as rows of numbers to be multiplied with those of homographies.

    `tolerance`: how far from its end a homography may move a point.
    """

    def __init__(self, here: np.ndarray, other: np.ndarray, tolerance: float):
        place = np.concatenate([here, np.ones((len(here), 1))], axis=1).T
        self._across = np.concatenate([place, -other[:, 0] * place])
        self._down = np.concatenate([place, -other[:, 1] * place])
        self._tolerance = tolerance

    def best(self, homographies: np.ndarray) -> np.ndarray:
        """The first of those (count, 3, 3) with which most points agree.

        The points are looked at in parts, and in each part the homographies that may still turn out
        better than the one that leads after the first.
        """
        agree, left = np.zeros(len(homographies)), np.arange(len(homographies))
        count = self._across.shape[1]
        leader, most, seen = 0, 0.0, 0
        for part in range(PARTS):
            some = slice(part, None, PARTS)
            for few in np.array_split(left, len(left) // AT_ONCE + 1):
                agree[few] += self._agreement(homographies[few], some)
            if part == 0:
                leader = int(np.argmax(agree))
                most = self._agreement(homographies[[leader]], slice(None))[0]
            seen += len(range(count)[some])
            left = left[agree[left] + count - seen > most + ROUNDING]
        return homographies[left[np.argmax(agree[left])] if len(left) else leader]

    def near(self, homography: np.ndarray) -> np.ndarray:
        """(points,) True where it moves a point to its end, within the tolerance."""
        return self._apart(homography[None], slice(None))[0] <= 1

    def _agreement(self, homographies: np.ndarray, some: slice) -> np.ndarray:
        """(count,) how many of some points end where each moves them; near ends count less."""
        return np.maximum(1 - self._apart(homographies, some), 0).sum(axis=1)

    def _apart(self, homographies: np.ndarray, some: slice) -> np.ndarray:
        """(count, points) distance of each end from where the point is moved, in tolerances."""
        rows = homographies.reshape(-1, 9)
        depth = rows[:, 6:] @ self._across[:3, some]
        across = rows[:, [0, 1, 2, 6, 7, 8]] @ self._across[:, some]  # times the depth
        down = rows[:, 3:] @ self._down[:, some]
        across *= across
        down *= down
        across += down
        np.sqrt(across, out=across)
        is_seen = depth > IN_FRONT
        across[~is_seen], depth[~is_seen] = np.inf, 1.0
        across /= depth
        return across / self._tolerance
