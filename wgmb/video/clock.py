"""One clock for all streams of a video: it maps input times to output times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

_COARSEST, _FINEST = Fraction(1, 90_000), 1_000_000  # tick where none fits; ticks a second


@dataclass(frozen=True)
class Clock:
    """Input times `start` become output times `origin`; later ones pass `speed` times as fast.

    Pictures, sound, subtitles and chapters go by it, so that they stay together also where one
    of them begins late. Times outside `first` to `end` [s, of the input] are left out.
    """

    start: Fraction = Fraction(0)
    speed: Fraction = Fraction(1)
    origin: Fraction = Fraction(0)
    first: Fraction | None = None
    end: Fraction | None = None

    def out(self, time: Fraction) -> Fraction:
        """The output time of an input time [s]."""
        return (time - self.start) / self.speed + self.origin

    def back(self, time: Fraction) -> Fraction:
        """The input time of an output time [s]."""
        return (time - self.origin) * self.speed + self.start


AS_IT_IS = Clock()


def tick(*times: Fraction) -> Fraction:
    """The longest tick of which all times are multiples; 1/90000 s if that is very short."""
    found = Fraction(0)
    for time in times:
        below = math.lcm(found.denominator, time.denominator)
        found = Fraction(math.gcd(int(found * below), int(time * below)), below)
    return found if found and 1 / found <= _FINEST else _COARSEST
