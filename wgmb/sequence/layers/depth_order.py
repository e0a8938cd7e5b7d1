"""Order of depth, by occlusion: near surfaces hide far ones where they meet.

Two pixels that move to one place of a neighbouring frame differ in depth; that place shows the
nearer one. Where it shows nothing, as outside of a render region, it tells nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .tones import bilinear, tone

_APART = 1.5  # [px] by which the motions of two surfaces differ at least
_DEEP = 0.02  # of the range of depth: by which they lie behind one another
_CLEAR = 0.15  # difference of tones by which the place shows one of them rather than the other
_PLACES = 300_000  # of larger pictures, evenly spaced rows are looked at
_FEWEST = 24  # places that say anything
_MOSTLY = 0.75  # of them


@dataclass(frozen=True)
class Votes:
    """Places of a neighbouring frame that show which of two surfaces is in front."""

    nearer: int = 0
    """The one of the smaller depth."""
    farther: int = 0
    """The one of the greater depth."""

    @property
    def count(self) -> int:
        """Number of places."""
        return self.nearer + self.farther

    @property
    def is_enough(self) -> bool:
        """True if so many places tell something."""
        return self.count >= _FEWEST

    def __add__(self, other: Votes) -> Votes:
        return Votes(self.nearer + other.nearer, self.farther + other.farther)

    @property
    def is_reversed(self) -> bool:
        """True if depth clearly grows towards the camera."""
        return self.is_enough and self.farther >= _MOSTLY * self.count


def votes(color: np.ndarray, motion: np.ndarray, depth: np.ndarray, near: np.ndarray) -> Votes:
    """The votes of one frame and one neighbour.

    `color`, `near`: (height, width, 3 or 4) linear; `motion`: (height, width, 2) to the neighbour
    [px]; `depth`: (height, width).
    """
    height, width = depth.shape
    rows = np.arange(height, dtype=np.float32)[:, None] + motion[..., 1]
    with np.errstate(invalid="ignore"):
        is_looked_at = np.rint(rows) % (1 + height * width // _PLACES) == 0
    at = np.flatnonzero(is_looked_at)
    y, x = np.divmod(at, width)
    motion, depth, own = motion[y, x], depth[y, x], color[y, x, :3]
    to = np.stack([x, y], axis=1) + motion
    with np.errstate(invalid="ignore"):
        is_inside = ((to >= 0) & (to <= (width - 1, height - 1))).all(axis=1)
    at = np.flatnonzero(is_inside & ~np.isnan(depth))
    places = np.rint(to[at]).astype(np.int64) @ (1, width)
    is_drawn = np.any(near.reshape(height * width, -1)[places], axis=1)
    at, places = at[is_drawn], places[is_drawn]
    order = np.argsort(places, kind="stable")
    at, places = at[order], places[order]
    pairs = np.stack([at[:-1], at[1:]])[:, places[:-1] == places[1:]]
    pairs = pairs[:, _are_two(motion, depth, pairs)]
    left = [
        np.abs(tone(own[one]) - tone(bilinear(near[..., :3], to[one]))).sum(axis=1) for one in pairs
    ]
    is_clear = np.abs(left[0] - left[1]) > _CLEAR
    is_first = left[0] < left[1]
    is_nearer = depth[pairs[0]] < depth[pairs[1]]
    nearer = int(np.count_nonzero((is_first == is_nearer) & is_clear))
    return Votes(nearer, int(np.count_nonzero(is_clear)) - nearer)


def _are_two(motion: np.ndarray, depth: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """True for pairs of pixels of two surfaces: they move differently, and differ in depth."""
    finite = depth[np.isfinite(depth)]
    low, high = np.quantile(finite, (0.02, 0.98)) if finite.size else (0.0, 0.0)
    a, b = (np.clip(depth[one], low, high) for one in pairs)
    apart = np.hypot(*(motion[pairs[0]] - motion[pairs[1]]).T)
    return (np.abs(a - b) > _DEEP * (high - low)) & (apart > _APART)
