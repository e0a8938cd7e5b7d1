"""Motion of frames without vectors: its source, and the shot in which a frame's motion is found."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from .reader import REACH

Found = tuple[np.ndarray, np.ndarray | None]


class MotionSource(Protocol):
    """Motion from pictures: Flow (wgmb/flow) and Dis are two."""

    def reach(self, size: tuple[int, int]) -> int:
        """Frames to either side of one that its motion may depend on, by their width and height."""
        ...

    def shot(self, load: Callable[[int], Any], depth: bool = True) -> Callable[[int], Found | None]:
        """Motion (height, width, 4) [px] and depth of a shot's frames, by their number.

        `load` gives the picture of a number, or None outside the shot. Without `depth` a source
        may leave the depth out, as None.
        """
        ...


def window(size: tuple[int, int], *sources: MotionSource | None) -> int:
    """Pictures to keep to either side of one, for its motion and that of its neighbours."""
    return max([REACH, *(1 + source.reach(size) for source in sources if source is not None)])


class ShotMotion:
    """The motion of frames, each within its own shot, by a source.

    `picture`: that of a frame, as the source takes it; None where it has none. `moves_on`: whether
    motion leads from one frame to another, which is kept or can be read. `depth`: whether it is
    wanted.
    """

    def __init__(
        self,
        source: MotionSource,
        picture: Callable[[int], Any],
        moves_on: Callable[[int, int], bool],
        depth: bool = True,
    ):
        self._source, self._picture, self._moves_on = source, picture, moves_on
        self._depth, self._number = depth, 0
        self._shot: Callable[[int], Found | None] | None = None

    def shot(self, number: int) -> Callable[[int], Found | None]:
        """The shot of a frame, as its source made it: the last one, if motion leads there.

        Whatever was asked for before, the motion is the same.
        """
        if self._shot is None or not self._moves_on(self._number, number):
            self._shot = self._source.shot(self._load, self._depth)
        self._number = number
        return self._shot

    def __call__(self, number: int) -> Found | None:
        """Motion (height, width, 4) [px] and depth of a frame; None where it is alone."""
        return self.shot(number)(number)

    def close(self) -> None:
        """Let go of the shot: it refers back to this, and holds pictures."""
        self._shot = None

    def _load(self, number: int) -> Any:
        return self._picture(number) if self._moves_on(self._number, number) else None
