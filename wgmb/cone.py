"""Impulse response of a cone cell of the eye.

The response x seconds after a flash is W(x) = rate exp(shift - rate x) F(x); its integral is
F(x) = exp(-exp(shift - rate x)) (Cusa 2022, after Howlett et al. 2017).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    """A cone cell; its impulse response peaks after `peak` [s] and decays with `rate` [1/s]."""

    rate: float = 50.0
    peak: float = 0.05

    def __post_init__(self) -> None:
        if not (math.isfinite(self.rate) and 1 <= self.rate <= 10_000):
            raise InputError(f"cone rate must be 1 to 10000 per second, got {self.rate}")
        if not (math.isfinite(self.peak) and 0 <= self.peak <= 1):
            raise InputError(f"cone peak must be 0 to 1 second, got {self.peak}")

    @property
    def shift(self) -> float:
        """Delay times rate."""
        return self.rate * self.peak

    @property
    def memory(self) -> float:
        """Seconds after which less than 1e-4 of the response to a flash remains."""
        return (self.shift + math.log(1e4)) / self.rate

    def frames_needed(self, rate: float) -> int:
        """Return how many past images contribute, at `rate` images per second."""
        if not (math.isfinite(rate) and rate > 0):
            raise InputError(f"rate must be over 0 images per second, got {rate}")
        count = math.ceil(self.memory * rate) + 2
        if count > MOST_HELD:
            raise InputError(f"{rate:g} images per second: too many to hold, at most {MOST_HELD}")
        return count

    def impulse_response(self, x: np.ndarray | float) -> NDArray[np.float64]:
        """Return W(x), the response `x` seconds after a flash, 1/s."""
        late = np.minimum(self.shift - self.rate * np.asarray(x, float), 80)
        return self.rate * np.exp(late - np.exp(late))

    def step_response(self, x: np.ndarray | float) -> NDArray[np.float64]:
        """Return F(x), the share of the response completed `x` seconds after a flash."""
        return np.exp(-np.exp(np.minimum(self.shift - self.rate * np.asarray(x, float), 80)))

    def weights(self, ages: np.ndarray, held: np.ndarray | float) -> NDArray[np.float64]:
        """Return the weights of images shown for `held` [s], on average `ages` [s] ago."""
        ages = np.asarray(ages, float)
        return self.step_response(ages + held / 2) - self.step_response(ages - held / 2)

    def shares(self, count: int, rate: float, after: float = 0.0) -> NDArray[np.float64]:
        """Return the weights of the last images, newest first; the oldest includes all earlier.

        `rate`: images per second, each held until the next. `after`: time since the middle of the
        newest one [s].
        """
        weights = self.weights(after + np.arange(count) / rate, 1 / rate)
        weights[-1] += 1 - weights.sum()
        return weights

    def shares_held(self, held: np.ndarray, after: float = 0.0) -> NDArray[np.float64]:
        """Return the weights of images each held for its own time [s], as `shares`.

        `held`: of the newest image first. `after`: time since the middle of the newest one [s].
        """
        held = np.asarray(held, float)
        ages = after + np.cumsum(held) - held[:1] / 2 - held / 2
        weights = self.weights(ages, held)
        weights[-1] += 1 - weights.sum()
        return weights

    def shutter(self, fps: float) -> Shutter:
        """Return a shutter that integrates continuous time like this cell at the frame's time."""
        return Shutter(
            360 * self.memory * fps, "end", lambda x: self.impulse_response((1 - x) * self.memory)
        )
