"""A cone cell of the eye: how it weighs light over time.

Its answer to a flash, x seconds later, is W(x) = rate exp(shift - rate x) F(x), whose integral is
F(x) = exp(-exp(shift - rate x)) (Cusa 2022, after Howlett et al. 2017).
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .errors import InputError
from .shutter import Shutter

MOST_HELD = 512  # pictures that an observer remembers
VIDEOS = {  # what the article compares, each at the degrees where neighbours add up to 1
    "none": Shutter(0),
    "box": Shutter(360),
    "trapezoid": Shutter(540, curve="trapezoid"),
    "cosine": Shutter(720, curve="cosine"),
}


@dataclass(frozen=True)
class Cone:
    """A cone cell: its answer to a flash peaks `peak` [s] later and fades with `rate` [1/s]."""

    rate: float = 50.0
    peak: float = 0.05

    def __post_init__(self) -> None:
        if not (math.isfinite(self.rate) and 1 <= self.rate <= 10_000):
            raise InputError(f"rate must be 1 to 10000 per second, got {self.rate}")
        if not (math.isfinite(self.peak) and 0 <= self.peak <= 1):
            raise InputError(f"peak must be 0 to 1 second, got {self.peak}")

    @property
    def shift(self) -> float:
        """Delay times rate."""
        return self.rate * self.peak

    @property
    def memory(self) -> float:
        """Seconds after which less than 1e-4 of a flash is still to come."""
        return (self.shift + math.log(1e4)) / self.rate

    def frames_needed(self, rate: float) -> int:
        """How many pictures of `rate` a second one has to know, to tell what is seen."""
        if not (math.isfinite(rate) and rate > 0):
            raise InputError(f"rate must be over 0 pictures a second, got {rate}")
        count = math.ceil(self.memory * rate) + 2
        if count > MOST_HELD:
            raise InputError(f"{rate:g} pictures a second are too many: {MOST_HELD} are kept")
        return count

    def impulse_response(self, x: np.ndarray | float) -> np.ndarray:
        """W(x): the answer to a flash `x` seconds later, 1/s."""
        late = np.minimum(self.shift - self.rate * np.asarray(x, float), 80)
        return self.rate * np.exp(late - np.exp(late))

    def step_response(self, x: np.ndarray | float) -> np.ndarray:
        """F(x): share of the answer to a flash that has come `x` seconds later."""
        return np.exp(-np.exp(np.minimum(self.shift - self.rate * np.asarray(x, float), 80)))

    def weights(self, ages: np.ndarray, held: float) -> np.ndarray:
        """What pictures add that were shown for `held` [s], in the mean `ages` [s] ago."""
        ages = np.asarray(ages, float)
        return self.step_response(ages + held / 2) - self.step_response(ages - held / 2)

    def shares(self, count: int, rate: float, after: float = 0.0) -> np.ndarray:
        """(count,) of the last pictures, the newest first; the oldest stands for all before it.

        `rate`: pictures a second, each held until the next. `after` [s] the newest one's middle.
        """
        weights = self.weights(after + np.arange(count) / rate, 1 / rate)
        weights[-1] += 1 - weights.sum()
        return weights

    def shutter(self, fps: float) -> Shutter:
        """Sees a world without frames as this cell does at the frame's instant."""
        return Shutter(
            360 * self.memory * fps, "end", lambda x: self.impulse_response((1 - x) * self.memory)
        )
