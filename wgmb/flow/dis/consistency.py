"""Pictures in which a quick search lost something: ways there and back that do not agree."""

from __future__ import annotations

import numpy as np

SPACING = 4  # px from one pixel that is looked at to the next
REACH = 2  # pictures to either side whose ways tell whether one, or one beside it, loses something
APART = 2.0  # px by which the way there and back may end beside its start
SHARE = 0.006  # of a picture, above which too much is lost
SHARE_OF_CHANGES = 0.06  # of what changes in it, above which that is too much as well
LEAST = 0.005  # share of a picture that must change for that
CHANGE = 15.0  # levels of 255 that a block differs from both neighbours where it changes,
QUIET = 10  # beyond this percentile of all blocks, which is noise


def returns(way: np.ndarray, back: np.ndarray, spacing: int) -> np.ndarray:
    """(height, width) bool: where the way [px] to another picture and back ends near its start.

    Both (height, width, 2), of every pixel `spacing` px apart; True where a way leaves the picture.
    """
    height, width = way.shape[:2]
    y, x = np.mgrid[:height, :width]
    to_x = np.rint(x + way[..., 0] / spacing).astype(np.int32)
    to_y = np.rint(y + way[..., 1] / spacing).astype(np.int32)
    is_inside = (to_x >= 0) & (to_x < width) & (to_y >= 0) & (to_y < height)
    apart = way + back[to_y.clip(0, height - 1), to_x.clip(0, width - 1)]
    return ~is_inside | (np.hypot(apart[..., 0], apart[..., 1]) <= APART)


def lost(
    ways: dict[int, tuple[np.ndarray, np.ndarray]], number: int, changes: np.ndarray
) -> np.ndarray:
    """(height, width) bool: pixels that change, of which no way to a neighbour leads back.

    `ways`: those (height, width, 2) [px] to the previous and the next picture of a picture and its
    neighbours, by number, of every pixel `SPACING` px apart.
    """
    found = np.zeros(changes.shape, bool)
    for side in (0, 1):
        if (other := number + 2 * side - 1) in ways:
            found |= returns(ways[number][side], ways[other][1 - side], SPACING)
    return changes & ~found


def changing(change: np.ndarray) -> np.ndarray:
    """Blocks that differ from the neighbours by more than noise does, bool, by that difference."""
    return change > CHANGE + np.percentile(change, QUIET)


class Consistency:
    """Tells in which pictures of a shot the ways of too many pixels do not lead back.

    What one neighbour hides leads back from the other, and what does not change cannot be lost. A
    picture is known as soon as its own ways and those of both neighbours are added; only every 4th
    pixel along each axis is kept.
    """

    def __init__(self) -> None:
        self._ways: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._changes: dict[int, np.ndarray] = {}
        self.shares: dict[int, float] = {}
        """The share of a picture that is lost, by the picture's number."""
        self.loses: dict[int, bool] = {}
        """True for a picture if that is too much of it, or of what changes in it."""

    def add(
        self,
        number: int,
        to_prev: np.ndarray,
        to_next: np.ndarray,
        change: np.ndarray | None,
    ) -> None:
        """Take the ways (height, width, 2) [px] of a picture.

        `change`: by how much blocks of 4 x 4 pixels differ from both neighbours, 0 to 255; None at
        the ends of a shot.
        """
        thin = (way[::SPACING, ::SPACING].copy() for way in (to_prev, to_next))
        self._ways[number] = next(thin), next(thin)
        if change is not None:
            self._changes[number] = change
        for old in [n for n in self._ways if abs(n - number) > 2 * REACH]:
            del self._ways[old]
            self._changes.pop(old, None)
        for n in (number - 1, number, number + 1):
            known = all(k in self._ways for k in (n - 1, n, n + 1))
            if n not in self.shares and known and n in self._changes:
                self._judge(n)

    def knows(self, number: int) -> bool:
        """True if the ways of a picture are kept."""
        return number in self._ways

    def _judge(self, number: int) -> None:
        changes = changing(self._changes[number])
        share, changed = float(lost(self._ways, number, changes).mean()), float(changes.mean())
        self.shares[number] = share
        self.loses[number] = share > SHARE or (
            changed > LEAST and share > SHARE_OF_CHANGES * changed
        )

    @property
    def lost(self) -> int:
        """Number of pictures in which something was lost."""
        return sum(self.loses.values())
