"""The curves of a report as SVG."""

from __future__ import annotations

import math
from collections.abc import Mapping
from html import escape

from ..charts import Axes, log_ticks, ticks
from .results import Plot

_WIDTH, _HEIGHT, _MARGINS = 380, 240, (46, 12, 10, 34)


def plot_svg(plot: Plot, colors: Mapping[str, str]) -> str:
    """A report's curves, in the colours by name, styled by the page they stand on."""
    points = [p for curve in plot.curves.values() for p in curve if all(map(math.isfinite, p))]
    if not points:
        return ""
    xs, ys = ([p[i] for p in points] for i in (0, 1))
    x_ticks = log_ticks(min(xs), max(xs)) if plot.log else ticks(min(xs), max(xs))
    floor = [plot.floor] if plot.floor is not None and math.isfinite(plot.floor) else []
    y_ticks = ticks(min(ys + floor), max(ys + floor))
    x_range = min(*x_ticks, *xs), max(*x_ticks, *xs)
    y_range = y_ticks[0], y_ticks[-1]
    axes = Axes(_WIDTH, _HEIGHT, _MARGINS, x_range, y_range, plot.log)
    left, right = axes.left, axes.right

    def place(x: float, y: float) -> tuple[float, float]:
        return round(axes.x(x), 1), round(axes.y(y), 1)

    parts = [
        axes.grid(x_ticks, y_ticks, 'class="grid"'),
        f'<text x="{right}" y="{_HEIGHT - 4}" text-anchor="end">{escape(plot.x)}</text>'
        f'<text x="{left}" y="{_HEIGHT - 4}">{escape(plot.y)}</text>',
    ]
    for level in floor:
        y = round(axes.y(level), 1)
        parts.append(
            f'<line class="floor" x1="{left}" x2="{right}" y1="{y}" y2="{y}">'
            f"<title>noise floor of the truth: {level:.4g}</title></line>"
            f'<text x="{left + 4}" y="{y + (-4 if y > axes.top + 16 else 13)}">noise floor</text>'
        )
    for name, curve in plot.curves.items():
        at = [(*place(a, b), a, b) for a, b in sorted(curve) if math.isfinite(b)]
        line = "M" + "L".join(f"{a},{b}" for a, b, *_ in at)
        parts.append(f'<path d="{line}" style="stroke:{colors[name]}"/>')
        parts += [
            f'<circle cx="{a}" cy="{b}" r="3.5" style="fill:{colors[name]}">'
            f"<title>{escape(name)}: {p:.4g} {escape(plot.x)}, {q:.4g}</title></circle>"
            for a, b, p, q in at
        ]
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" '
        f'aria-label="{escape(plot.title)}">{"".join(parts)}</svg>'
    )
