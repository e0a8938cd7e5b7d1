"""Shutter functions: the weight of each instant in a frame.

Time is in frame intervals with 0 at the frame's own instant; 360 degrees are one
interval, so a centred 180 degree shutter is open from -0.25 to 0.25. Every shutter
integrates to 1. This file is the only place where a curve is written: the GPU gets
times.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import charts
from .errors import InputError, check_choice
from .files import bounded

Weight = Callable[[np.ndarray], np.ndarray]
_MOST_BYTES = 16 << 20  # of a curve's file


def _box(x: np.ndarray) -> np.ndarray:
    return np.ones_like(x)


def _trapezoid(x: np.ndarray) -> np.ndarray:
    """Flat for the middle third, a ramp on either side: at 540 degrees neighbours add up to 1."""
    return np.clip(np.minimum(x, 1 - x) * 3, 0, 1)


def _triangle(x: np.ndarray) -> np.ndarray:
    return 1 - np.abs(2 * x - 1)


def _cosine(x: np.ndarray) -> np.ndarray:
    """Raised cosine (Cusa 2022, "Motion Blur All the Way Down"), made for 720 degrees."""
    return 1 - np.cos(2 * math.pi * x)


def _gaussian(x: np.ndarray) -> np.ndarray:
    """Cut off at three standard deviations on either side."""
    return np.exp(-0.5 * ((x - 0.5) * 6) ** 2)


CURVES: dict[str, Weight] = {
    "box": _box,
    "trapezoid": _trapezoid,
    "triangle": _triangle,
    "cosine": _cosine,
    "gaussian": _gaussian,
}
OVERLAPS = {"box": 360.0, "trapezoid": 540.0, "triangle": 720.0, "cosine": 720.0}
"""Degrees at which the windows of all frames add up to 1 at every instant (Cusa 2022)."""
PHASES = {"start": 0.5, "centre": 0.0, "center": 0.0, "end": -0.5}
ROLLING = {"down": (0, 1), "up": (0, -1), "right": (1, 0), "left": (-1, 0)}


@dataclass(frozen=True)
class Shutter:
    """Exposure of a frame: shutter angle, phase and curve.

    `degrees`: shutter angle, 0 to 36000; 360 is one frame interval.
    `phase`: "start" opens at the frame's instant, "centre" is centred on it, "end" closes
    at it; a number is the time of the exposure's middle [frame intervals].
    `curve`: a name in CURVES, or a function of x in 0 (opens) to 1 (closes), at any scale,
    never negative.
    `rolling`: "down", "up", "right", "left", the direction in which the exposure moves ("down":
    the top row is first); `rolling_duration`: delay from the first to the last row or column
    [frame intervals]; the middle of the image is not delayed.
    """

    degrees: float = 180.0
    phase: str | float = "centre"
    curve: str | Weight = "box"
    rolling: str | None = None
    rolling_duration: float = 1.0

    def __post_init__(self) -> None:
        text = isinstance(self.degrees, str)
        if text or not (math.isfinite(self.degrees) and 0 <= self.degrees <= 36000):
            raise InputError(f"`shutter` must be 0 to 36000 degrees, got {self.degrees!r}")
        if isinstance(self.phase, str) and self.phase not in PHASES:
            check_choice("`phase`", self.phase, ("start", "centre", "end"), " or a number")
        if not isinstance(self.phase, str) and not abs(self.phase) <= 100:
            raise InputError(f"`phase` must be within 100 frame intervals, got {self.phase}")
        if isinstance(self.curve, str):
            check_choice("`curve`", self.curve, CURVES)
        if self.rolling is not None:
            check_choice("`rolling`", self.rolling, ROLLING)
        if not (math.isfinite(self.rolling_duration) and 0 <= self.rolling_duration <= 100):
            raise InputError(
                f"`rolling_duration` must be 0 to 100 frame intervals, got {self.rolling_duration}"
            )

    def _repr_svg_(self) -> str:
        name = self.curve if isinstance(self.curve, str) else "own curve"
        return charts.svg(charts.shutter_chart(self, name, points=301))

    @property
    def span(self) -> tuple[float, float]:
        """Times at which the shutter opens and closes [frame intervals]."""
        length = self.degrees / 360
        middle = PHASES[self.phase] * length if isinstance(self.phase, str) else self.phase
        return middle - length / 2, middle + length / 2

    @property
    def delay(self) -> tuple[float, float]:
        """Delay of the right edge after the left, the bottom after the top [frame intervals]."""
        x, y = ROLLING[self.rolling] if self.rolling else (0, 0)
        return x * self.rolling_duration, y * self.rolling_duration

    def integral(self, steps: int = 4096) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times from opening to closing [frame intervals] and the share exposed by each."""
        x = np.linspace(0, 1, steps + 1)
        curve = CURVES[self.curve] if isinstance(self.curve, str) else self.curve
        w = np.asarray(curve(x), np.float64) + np.zeros_like(x)
        if not np.isfinite(w).all() or (w < 0).any() or not w.any():
            raise InputError("a shutter curve must be finite, never negative and not all 0")
        share = np.concatenate([[0.0], np.cumsum((w[1:] + w[:-1]) / 2)])
        opens, closes = self.span
        return opens + (closes - opens) * x, share / share[-1]

    def share(self, begin: float, end: float) -> float:
        """The share of the exposure between two times [frame intervals], 0..1."""
        times, integral = self.integral()
        if times[0] == times[-1]:  # a moment
            return float(begin <= times[0] < end or begin == times[0] == end)
        return float(np.diff(np.interp([begin, end], times, integral))[0])

    def part(self, begin: float, end: float) -> Shutter:
        """The exposure between two times [frame intervals] within its span, as a shutter."""
        opens, closes = self.span
        if closes <= opens or self.curve == "box":
            curve = self.curve
        else:
            whole = CURVES[self.curve] if isinstance(self.curve, str) else self.curve
            first, last = ((t - opens) / (closes - opens) for t in (begin, end))
            curve = partial(_stretch, whole, first, last)
        return replace(self, degrees=360 * (end - begin), phase=(begin + end) / 2, curve=curve)

    def timed(self, scale: float, offset: float) -> Shutter:
        """The same exposure on another clock, where time t is scale * t + offset."""
        opens, closes = self.span
        middle = scale * (opens + closes) / 2 + offset
        return replace(self, degrees=scale * self.degrees, phase=middle)

    def weight(self, times: np.ndarray) -> NDArray[np.float64]:
        """Return the weight of each time [frame intervals], per frame interval; 0 while closed."""
        edges, integral = self.integral()
        if edges[0] == edges[-1]:
            raise InputError("a shutter of 0 degrees has no weights")
        slopes = np.diff(integral) / np.diff(edges)
        times = np.asarray(times, np.float64)
        inside = (times >= edges[0]) & (times < edges[-1])
        at = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(slopes) - 1)
        return np.where(inside, slopes[at], 0.0)

    def overlap(self, times: np.ndarray) -> NDArray[np.float64]:
        """Sum of the weights of this and all other frames at the times [frame intervals]."""
        opens, closes = self.span
        times = np.asarray(times, np.float64)
        first, last = math.floor(times.min() - closes), math.ceil(times.max() - opens)
        return np.sum([self.weight(times - n) for n in range(first, last + 1)], axis=0)

    def time(self, shares: np.ndarray) -> NDArray[np.float64]:
        """Return the times at which shares (0..1) of the exposure are reached [frame intervals]."""
        times, integral = self.integral()
        # A flat stretch (weight 0) is jumped over: only the ends of rising steps count.
        rises = np.diff(integral) > 0
        used = np.append(rises, False) | np.insert(rises, 0, False)
        return np.interp(shares, integral[used], times[used])

    def strata(self, samples: int) -> NDArray[np.float32]:
        """(samples, 3) float32: begin, middle and end of equal shares of the exposure."""
        edges = self.time(np.arange(2 * samples + 1) / (2 * samples))
        return np.stack([edges[:-1:2], edges[1::2], edges[2::2]], 1).astype(np.float32)

    def sample_times(self, samples: int, shift: float = 0.0) -> NDArray[np.float32]:
        """(samples,) one time in every stratum, `shift` -0.5..0.5 from its middle."""
        begin, middle, end = self.strata(samples).T
        return middle + 2 * shift * (middle - begin if shift < 0 else end - middle)


def _stretch(curve: Weight, first: float, last: float, x: np.ndarray) -> np.ndarray:
    """A part of a curve as a curve of its own."""
    return curve(np.clip(first + (last - first) * x, 0, 1))


def curve_bytes(path: str | Path) -> bytes:
    """The bytes of a curve's file; InputError if it is too large, or no regular file."""
    return bounded.read(Path(path), _MOST_BYTES, "a curve")


def read_curve(path: str | Path) -> Weight:
    """A curve from a CSV file of `time, weight` rows, a header line allowed.

    Times may be in any unit: the shutter opens at the first row and closes at the last; its
    duration is given by the shutter's degrees. Linear between the rows.
    """
    try:
        text = io.StringIO(curve_bytes(path).decode(), newline="")
        rows = [row for row in csv.reader(text) if row and not row[0].startswith("#")]
    except OSError as error:
        raise InputError(f"curve {path}: {(error.strerror or str(error)).lower()}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"curve {path}: {error}") from None
    try:
        points = np.array([[float(cell) for cell in row[:2]] for row in rows[_is_header(rows) :]])
    except ValueError as error:
        raise InputError(f"curve {path}: rows must be time, weight: {error}") from None
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
        raise InputError(f"curve {path}: needs at least two rows of time, weight")
    time, weight = points.T
    if not np.isfinite(points).all() or (time[1:] <= time[:-1]).any() or (weight < 0).any():
        raise InputError(f"curve {path}: times must rise, weights be 0 or more, all finite")
    if not weight.any():
        raise InputError(f"curve {path}: all weights are 0")
    with np.errstate(all="ignore"):
        time = (time - time[0]) / (time[-1] - time[0])

        def curve(x: np.ndarray) -> np.ndarray:
            return np.interp(x, time, weight)

        try:
            share = Shutter(curve=curve).integral()[1]
        except InputError as error:
            raise InputError(f"curve {path}: {error}") from None
    if not (np.isfinite(time).all() and np.isfinite(share).all()):
        raise InputError(f"curve {path}: times or weights are too large")
    return curve


def _is_header(rows: list[list[str]]) -> bool:
    try:
        float(rows[0][0])
    except (ValueError, IndexError):
        return bool(rows)
    return False
