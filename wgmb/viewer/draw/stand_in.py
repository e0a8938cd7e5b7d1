"""The method while something moves: the one that is set where it is quick, else the quickest."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from .adaptive import MOST_PATIENCE, PATIENCE, Pace

HALF = 5
"""The level of detail with half the width."""
_SURE = 0.7  # share of the target that is expected at most of what is tried
_UNKNOWN = 4.0  # times the quickest one's seconds that a method is taken for whose are not known
_HOPELESS = 4.0  # times the target that a single frame may take


class StandIn:
    """Choice between the method that is set and the quickest one, while something moves.

    The one that is set is used as long as its frames take `target` seconds at most, at half the
    width or more. It is tried where that is likely, by the times of its still images, or because
    the quickest one takes much less; where it proves too slow, again ever later.
    """

    def __init__(self, target: float):
        self._target = target
        self._key: tuple[Any, ...] = ()
        self._begin_anew()

    def _begin_anew(self) -> None:
        self._pixel = math.inf  # seconds of the set method for one, at least
        self._patience = PATIENCE
        self._stand_in()

    def _stand_in(self) -> None:
        self.is_needed, self._quick = True, 0
        self.pace = Pace(HALF, self._target)
        self._took: deque[float] = deque(maxlen=3)

    def begin(self, key: tuple[Any, ...]) -> None:
        """Forget all observations, if `key` (the picture and its method) is another one."""
        if key != self._key:
            self._key = key
            self._begin_anew()

    def observe_still(self, seconds: float, pixels: int) -> None:
        """A still image by the method that is set took so long, perhaps with compiling."""
        self._pixel = min(self._pixel, seconds / pixels)

    def is_kept(
        self, seconds: float, drawing: float, antialias: int, pixels: int, fewest: int
    ) -> bool:
        """Take note of a moving frame of `pixels`; False if the next one has the other method.

        It took so long, `drawing` of it for the part that depends on its pixels. `fewest` that the
        method that is set would be drawn with.
        """
        if self.is_needed:
            known = seconds - drawing + self._pixel * fewest
            unknown = _UNKNOWN * seconds if pixels >= fewest else math.inf
            expected = unknown if math.isinf(self._pixel) else known
            self._quick = self._quick + 1 if expected <= _SURE * self._target else 0
            self.is_needed = self._quick < self._patience
            return self.is_needed
        self._took.append(seconds)
        self._pixel = drawing / pixels
        usual = sorted(self._took)[1] if len(self._took) == 3 else 0.0
        is_coarsest = self.pace.level >= HALF
        if (is_coarsest and usual > 1.1 * self._target) or seconds > _HOPELESS * self._target:
            self._patience = min(2 * self._patience, MOST_PATIENCE)
            self._stand_in()
            return False
        self.pace.observe(seconds, drawing, antialias)
        return True
