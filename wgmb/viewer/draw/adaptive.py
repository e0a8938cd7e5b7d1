"""Adaptive resolution and sample count, to keep the window responsive during motion."""

from __future__ import annotations

from collections import deque

PATIENCE, MOST_PATIENCE = 5, 160  # quick frames before a finer level is tried
_MOST_UNCHANGED = 0.8  # share of a frame that no level changes, at most
QUICK = 4  # the fewest samples while something moves


class Pace:
    """Level of detail during motion: the finest one whose frames take `target` seconds at most.

    Where most of that time does not depend on the level, pixels may take as long once more: to
    draw fewer would save little. A level that was too fine is tried again ever later.
    """

    TARGET = 0.08  # seconds from one frame of the window to the next
    SCALES = (1.0, 1.0, 0.85, 0.72, 0.6, 0.5, 0.42, 0.36, 0.3, 0.25, 0.2)
    FEWER = (1, 1, 1, 1, 1, 2, 2, 3, 4, 4, 4)  # the samples' divisor, for methods of many passes

    def __init__(self, level: int = 0, target: float = TARGET):
        self.level, self._target = level, target
        self._took: deque[tuple[float, float]] = deque(maxlen=3)
        self._quick = 0  # frames in succession after which a finer level seems possible
        self._patience = PATIENCE
        self._finer: int | None = None  # the level that was changed to last, if it was finer
        self._before: tuple[int, float] | None = None  # the level before, and its seconds

    def quality(self, level: int, antialias: int) -> tuple[float, int]:
        """Return the share of the full width, and the rays per pixel side."""
        return self.SCALES[level], antialias if level == 0 else 1

    def samples(self, level: int, samples: int) -> int:
        """Return the number of samples to take, at least QUICK if `samples` allows it."""
        return max(samples // self.FEWER[level], min(samples, QUICK))

    def observe(self, seconds: float, drawing: float, antialias: int) -> None:
        """A moving frame took so long, `drawing` of it for the part that depends on the level."""
        self._took.append((seconds, drawing))
        if len(self._took) < 3:
            return
        took, drew = sorted(self._took)[len(self._took) // 2]
        rest = max(took - drew, self._unchanged(took, antialias), 0.0)
        target = max(self._target, 2 * rest)

        def predicted(level: int) -> float:
            share = self._cost(level, antialias) / self._cost(self.level, antialias)
            return rest + (took - rest) * share

        last = len(self.SCALES) - 1
        if took > 1.1 * target and self.level < last:
            if self.level == self._finer:
                self._patience = min(2 * self._patience, MOST_PATIENCE)
            fits = [k for k in range(self.level + 1, last) if predicted(k) <= target]
            self._set(min(fits, default=last), took)
        elif self.level and (took < 0.7 * target or predicted(self.level - 1) < 0.95 * target):
            self._quick += 1
            if self._quick >= self._patience:
                self._set(self.level - 1, took)
                self._finer = self.level
        else:
            self._quick = 0

    def _unchanged(self, took: float, antialias: int) -> float:
        """Seconds of a frame that do not depend on the level, by those of the level before."""
        if self._before is None:
            return 0.0
        level, seconds = self._before
        here, there = self._cost(self.level, antialias), self._cost(level, antialias)
        if here == there:
            return 0.0
        rate = (took - seconds) / (here - there)
        return min(took - rate * here, _MOST_UNCHANGED * took)

    def _set(self, level: int, took: float) -> None:
        self._before = self.level, took
        self.level, self._quick, self._finer = level, 0, None
        self._took.clear()

    def _cost(self, level: int, antialias: int) -> float:
        scale, antialias = self.quality(level, antialias)
        return scale * scale * (antialias * antialias + 1)
