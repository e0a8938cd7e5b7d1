"""Adaptive resolution and sample count, to keep the window responsive during motion."""

from __future__ import annotations

from collections import deque

QUICK = 4  # the fewest samples while something moves


class Pace:
    """Level of detail during motion: the finest one whose frames take `target` seconds at most."""

    TARGET = 0.08  # seconds from one frame of the window to the next
    SCALES = (1.0, 1.0, 0.85, 0.72, 0.6, 0.5, 0.42, 0.36, 0.3, 0.25, 0.2)
    FEWER = (1, 1, 1, 1, 1, 2, 2, 3, 4, 4, 4)  # the samples' divisor, for methods of many passes

    def __init__(self, level: int = 0, target: float = TARGET):
        self.level, self._target = level, target
        self._took: deque[tuple[float, float]] = deque(maxlen=3)
        self._patience = 0

    def quality(self, level: int, antialias: int) -> tuple[float, int]:
        """Return the share of the full width, and the rays per pixel side."""
        return self.SCALES[level], antialias if level == 0 else 1

    def samples(self, level: int, samples: int) -> int:
        """Return the number of samples to take, at least QUICK if `samples` allows it."""
        return max(samples // self.FEWER[level], min(samples, QUICK))

    def observe(self, seconds: float, drawing: float, antialias: int) -> None:
        """A moving frame took so long, `drawing` of it for what depends on the level."""
        self._took.append((seconds, drawing))
        if len(self._took) < 3:
            return
        middle = sorted(self._took)[len(self._took) // 2]
        rest, drew = max(middle[0] - middle[1], 0.0), middle[1]

        def predicted(level: int) -> float:
            return rest + drew * self._cost(level, antialias) / self._cost(self.level, antialias)

        last = len(self.SCALES) - 1
        if middle[0] > 1.1 * self._target and self.level < last:
            fits = [k for k in range(self.level + 1, last) if predicted(k) <= self._target]
            self._set(min(fits, default=last))
        elif self.level and predicted(self.level - 1) < 0.85 * self._target:
            self._patience += 1
            if self._patience >= 5:
                self._set(self.level - 1)
        else:
            self._patience = 0

    def _set(self, level: int) -> None:
        self.level, self._patience = level, 0
        self._took.clear()

    def _cost(self, level: int, antialias: int) -> float:
        scale, antialias = self.quality(level, antialias)
        return scale * scale * (antialias * antialias + 1)
