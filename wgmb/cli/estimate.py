"""The estimated time of a long run, reported as early as possible, with quicker settings."""

from __future__ import annotations

import time
from collections.abc import Callable

FIRST = 3  # frames from which the rest is estimated
LONG = 600.0  # seconds above which it is told


def spelled(seconds: float) -> str:
    """80 -> 1 min, 7500 -> 2 h 5 min."""
    hours, minutes = divmod(max(1, round(seconds / 60)), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


class Estimate:
    """A `progress` that passes on to `tell`, and says once if the frames left take long.

    Two frames are no measure: the first one, which also started all, and the slowest one after it,
    which may have compiled a shader. `total`: number of frames; `quicker`: settings that take less
    time; `say`: takes the line.
    """

    def __init__(
        self,
        tell: Callable[..., None],
        total: int,
        quicker: str,
        say: Callable[[str], None],
        clock: Callable[[], float] = time.perf_counter,
    ):
        self._tell, self._total, self._quicker = tell, total, quicker
        self._say, self._clock = say, clock
        self._count, self._done, self._last = 0, 0, 0.0
        self._took, self._slowest = 0.0, 0.0  # seconds of the frames after the first
        self._is_said = False

    def __call__(self, number: int, status: str) -> None:
        """One frame more; `status`: done, skipped or failed."""
        self._tell(number, status)
        self._count += 1
        if status != "done" or self._is_said:
            return
        self._done += 1
        now = self._clock()
        if self._done > 1:
            self._took += now - self._last
            self._slowest = max(self._slowest, now - self._last)
        self._last = now
        if self._done < FIRST:
            return
        # Later frames may take longer: those in which something is fast.
        each = (self._took - self._slowest) / (self._done - 2)
        left = self._total - self._count
        if left * each > LONG:
            self._is_said = True
            self._say(f"about {spelled(left * each)} for {left} more frames; {self._quicker}")
