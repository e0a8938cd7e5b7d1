"""Line charts as SVG, without a plotting library."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

import numpy as np

COLORS = ("#1f6fb4", "#d1495b", "#3a8f5c", "#8a5aa8", "#c77f1a", "#555555")
WIDTH, HEIGHT = 640, 260  # of a chart with its margins [px]
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 120, 38, 44


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
    low_x, high_x = float(every_x.min()), float(every_x.max())
    high_y = float(every_y.max()) * 1.08 or 1.0
    right, bottom = WIDTH - _RIGHT, HEIGHT - _BOTTOM

    def across(x):
        return _LEFT + (x - low_x) / ((high_x - low_x) or 1) * (right - _LEFT)

    def above(y):
        return bottom - y / high_y * (bottom - _TOP)

    drawn = [_text(_LEFT, 14, chart.title, weight="bold")]
    for x in _ticks(low_x, high_x):
        drawn.append(_line(across(x), bottom, across(x), _TOP, "#e4e4e4"))
        drawn.append(_text(across(x), bottom + 16, f"{x:g}", "middle"))
    for y in _ticks(0, high_y):
        drawn.append(_line(_LEFT, above(y), right, above(y), "#e4e4e4"))
        drawn.append(_text(_LEFT - 6, above(y) + 4, f"{y:g}", "end"))
    drawn.append(_line(_LEFT, bottom, right, bottom, "#333"))
    drawn.append(_text((_LEFT + right) / 2, HEIGHT - 10, chart.x, "middle"))
    drawn.append(_text(4, _TOP - 4, chart.y))
    strong = [label for label in chart.lines if label not in chart.faint]
    for label, (x, y) in chart.lines.items():
        shown = label in strong
        color = colors[label] if shown else "#bbbbbb"
        way = " ".join(f"{across(a):.2f},{above(b):.2f}" for a, b in zip(x, y, strict=True))
        wide = 2 if shown else 1
        drawn.append(
            f'<polyline points="{way}" fill="none" stroke="{color}" stroke-width="{wide}"/>'
        )
        if shown:
            row = _TOP + 14 + 18 * strong.index(label)
            drawn.append(_line(right + 10, row - 4, right + 26, row - 4, color, 2))
            drawn.append(_text(right + 31, row, label))
    return "".join(drawn)


def _ticks(low: float, high: float) -> np.ndarray:
    """Round numbers between the two, four to ten of them."""
    rough = (high - low) / 5 or 1
    scale = 10 ** np.floor(np.log10(rough))
    step = scale * min((s for s in (1, 2, 5, 10) if s * scale >= rough * 0.8), default=10)
    ticks = step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)
    return np.round(ticks, 10) + 0.0


def _line(x1, y1, x2, y2, color: str, wide: int = 1) -> str:
    return (
        f'<line x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" '
        f'stroke="{color}" stroke-width="{wide}"/>'
    )


def _text(x, y, text: str, anchor: str = "start", weight: str = "normal") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-weight="{weight}" '
        f'fill="#222">{escape(text)}</text>'
    )


def shutter_charts(shutter, name: str) -> tuple[Chart, Chart, Chart]:
    """A shutter's curve, its integral, and the sum of neighbouring frames' windows."""
    opens, closes = shutter.span
    reach = max(1.5, 1.25 * max(abs(opens), abs(closes)))
    t = np.linspace(-reach, reach, 1201)
    edges, integral = shutter.integral()
    axis = "time [frame intervals]"
    near = range(int(np.floor(-reach - closes)), int(np.ceil(reach - opens)) + 1)
    windows = {f"frame {n:+d}": (t, shutter.weight(t - n)) for n in near}
    everything = {**windows, "sum": (t, shutter.overlap(t))}
    return (
        Chart(f"{name}, {shutter.degrees:g} degrees", axis, "weight",
              {"curve": (t, shutter.weight(t))}),
        Chart("integral: the share of the exposure that has passed", axis, "share",
              {"integral": (t, np.interp(t, edges, integral))}),
        Chart("neighbouring frames", axis, "weight", everything, frozenset(windows)),
    )  # fmt: skip
