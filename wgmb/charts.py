"""Line charts as SVG, without a plotting library."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

COLORS = ("#1f6fb4", "#d1495b", "#3a8f5c", "#8a5aa8", "#c77f1a", "#555555")
WIDTH, HEIGHT = 640, 260  # of a chart with its margins [px]
_TIME = "time [frame intervals]"
_MARGINS = 64, 120, 38, 44  # left, right, top, bottom [px]


@dataclass(frozen=True)
class Chart:
    """Lines over one axis: `lines` by label, each x and y; `faint` labels are drawn thin."""

    title: str
    x: str
    y: str
    lines: Mapping[str, tuple[np.ndarray, np.ndarray]]
    faint: frozenset[str] = frozenset()


def svg(*charts: Chart) -> str:
    """The charts one below the other, a label in one colour in all, as the text of an SVG file."""
    strong = dict.fromkeys(k for chart in charts for k in chart.lines if k not in chart.faint)
    colors = {label: COLORS[i % len(COLORS)] for i, label in enumerate(strong)}
    parts = [
        f'<g transform="translate(0 {i * HEIGHT})">{_chart(chart, colors)}</g>'
        for i, chart in enumerate(charts)
    ]
    height = HEIGHT * len(charts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        f'width="{WIDTH}" height="{height}" font-family="sans-serif" font-size="12">'
        f'<rect width="100%" height="100%" fill="white"/>{"".join(parts)}</svg>\n'
    )


def _chart(chart: Chart, colors: Mapping[str, str]) -> str:
    every_x = np.concatenate([x for x, _ in chart.lines.values()])
    every_y = np.concatenate([y for _, y in chart.lines.values()])
    low, high = float(every_x.min()), float(every_x.max())
    top = float(every_y.max()) * 1.08 or 1.0
    axes = Axes(WIDTH, HEIGHT, _MARGINS, (low, high), (0.0, top))
    x_ticks = [t for t in ticks(low, high) if low <= t <= high]
    y_ticks = [t for t in ticks(0.0, top) if t <= top]
    left, right, bottom = axes.left, axes.right, axes.bottom
    drawn = [
        _text(left, 14, chart.title, weight="bold"),
        axes.grid(x_ticks, y_ticks, 'stroke="#e4e4e4"'),
        _line(left, bottom, right, bottom, "#333"),
        _text((left + right) / 2, HEIGHT - 10, chart.x, "middle"),
        _text(4, axes.top - 4, chart.y),
    ]
    strong = [label for label in chart.lines if label not in chart.faint]
    for label, (x, y) in chart.lines.items():
        shown = label in strong
        color = colors[label] if shown else "#bbbbbb"
        points = " ".join(f"{axes.x(a):.2f},{axes.y(b):.2f}" for a, b in zip(x, y, strict=True))
        wide = 2 if shown else 1
        drawn.append(
            f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="{wide}"/>'
        )
        if shown:
            row = axes.top + 14 + 18 * strong.index(label)
            drawn.append(_line(right + 10, row - 4, right + 26, row - 4, color, 2))
            drawn.append(_text(right + 31, row, label))
    return "".join(drawn)


class Axes:
    """Values to pixels: `margins` are left, right, top, bottom [px]; `log`: x is logarithmic."""

    def __init__(
        self,
        width: float,
        height: float,
        margins: tuple[float, float, float, float],
        x_range: tuple[float, float],
        y_range: tuple[float, float],
        log: bool = False,
    ):
        left, right, top, bottom = margins
        self.left, self.right, self.top, self.bottom = left, width - right, top, height - bottom
        self._x, self._y, self._along = x_range, y_range, math.log if log else float

    def x(self, value: float) -> float:
        """Pixels from the left."""
        low, high = map(self._along, self._x)
        share = (self._along(value) - low) / ((high - low) or 1)
        return self.left + share * (self.right - self.left)

    def y(self, value: float) -> float:
        """Pixels from the top."""
        low, high = self._y
        return self.bottom - (value - low) / ((high - low) or 1) * (self.bottom - self.top)

    def grid(self, x_ticks: Iterable[float], y_ticks: Iterable[float], attributes: str) -> str:
        """A line and its number at every tick; `attributes`: of the lines."""
        across = "".join(
            f'<line {attributes} x1="{self.left}" x2="{self.right}" y1="{self.y(t):.1f}" '
            f'y2="{self.y(t):.1f}"/><text x="{self.left - 6}" y="{self.y(t) + 4:.1f}" '
            f'text-anchor="end">{t:g}</text>'
            for t in y_ticks
        )
        down = "".join(
            f'<line {attributes} x1="{self.x(t):.1f}" x2="{self.x(t):.1f}" y1="{self.top}" '
            f'y2="{self.bottom}"/><text x="{self.x(t):.1f}" y="{self.bottom + 15}" '
            f'text-anchor="middle">{t:g}</text>'
            for t in x_ticks
        )
        return across + down


def ticks(low: float, high: float) -> list[float]:
    """About five round numbers that hold the range."""
    span = (high - low) or abs(high) or 1.0
    rough = span / 4
    power = 10 ** math.floor(math.log10(rough))
    step = next(k * power for k in (1, 2, 2.5, 5, 10) if k * power >= rough * 0.999)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [round(k * step, 12) for k in range(first, max(last, first + 1) + 1)]


def log_ticks(low: float, high: float) -> list[float]:
    """Powers of two for small numbers of samples, else 1, 2 and 5 times powers of ten."""
    low, high = max(low, 1e-9), max(high, low * 1.01)
    if float(low).is_integer() and float(high).is_integer() and high <= 4096:
        twos = [2.0**k for k in range(13) if low <= 2**k <= high]
        if len(twos) >= 2:
            return twos
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    every = [k * 10.0**d for d in decades for k in (1, 2, 5)]
    inside = [t for t in every if low <= t <= high]
    return inside if 2 <= len(inside) <= 8 else [t for t in inside if f"{t:e}"[0] == "1"] or [low]


def _line(x1: float, y1: float, x2: float, y2: float, color: str, wide: int = 1) -> str:
    return (
        f'<line x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" '
        f'stroke="{color}" stroke-width="{wide}"/>'
    )


def _text(x: float, y: float, text: str, anchor: str = "start", weight: str = "normal") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-weight="{weight}" '
        f'fill="#222">{escape(text)}</text>'
    )


def shutter_chart(shutter: Any, name: str, points: int = 1201) -> Chart:
    """A shutter's curve."""
    t = np.linspace(*_reach(shutter), points)
    return Chart(f"{name}, {shutter.degrees:g} degrees", _TIME, "weight",
                 {"curve": (t, shutter.weight(t))})  # fmt: skip


def shutter_charts(shutter: Any, name: str) -> tuple[Chart, Chart, Chart]:
    """A shutter's curve, its integral, and the sum of neighbouring frames' windows."""
    opens, closes = shutter.span
    low, high = _reach(shutter)
    t = np.linspace(low, high, 1201)
    edges, integral = shutter.integral()
    near = range(int(np.floor(low - closes)), int(np.ceil(high - opens)) + 1)
    windows = {f"frame {n:+d}": (t, shutter.weight(t - n)) for n in near}
    everything = {**windows, "sum": (t, shutter.overlap(t))}
    return (
        shutter_chart(shutter, name),
        Chart("integral: the share of the exposure that has passed", _TIME, "share",
              {"integral": (t, np.interp(t, edges, integral))}),
        Chart("neighbouring frames", _TIME, "weight", everything, frozenset(windows)),
    )  # fmt: skip


def _reach(shutter: Any) -> tuple[float, float]:
    """The times that are drawn."""
    reach = max(1.5, 1.25 * max(map(abs, shutter.span)))
    return -reach, reach
