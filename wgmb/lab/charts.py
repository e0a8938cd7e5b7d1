"""The curves of a report as SVG."""

from __future__ import annotations

import math
from collections.abc import Mapping
from html import escape

from ..charts import Axes, log_ticks, ticks
from .results import Bars, Plot

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


_ROW, _NAME, _VALUE = 24, 110, 70  # height of a bar's row, room for its name and its sum [px]


def bars_svg(bars: Bars, colors: Mapping[str, str]) -> str:
    """A report's bars, in the colours by part, styled by the page they stand on."""
    sums = {name: sum(row.values()) for name, row in bars.rows.items()}
    scale = (_WIDTH - _NAME - _VALUE) / (max(sums.values(), default=0) or 1)
    parts = []
    for i, (name, row) in enumerate(bars.rows.items()):
        x, y = float(_NAME), i * _ROW + 4
        parts.append(f'<text x="{_NAME - 6}" y="{y + 12}" text-anchor="end">{escape(name)}</text>')
        for part, value in row.items():
            parts.append(
                f'<rect x="{x:.1f}" y="{y}" width="{scale * value:.1f}" height="{_ROW - 8}" '
                f'style="fill:{colors[part]}"><title>{escape(f"{name}, {part}: {value:.4g}")} '
                f"{escape(bars.unit)}</title></rect>"
            )
            x += scale * value
        told = f"{sums[name]:.3g} {bars.unit}"
        parts.append(f'<text x="{x + 6:.1f}" y="{y + 12}">{escape(told)}</text>')
    return (
        f'<svg viewBox="0 0 {_WIDTH} {len(bars.rows) * _ROW}" role="img" '
        f'aria-label="{escape(bars.title)}">{"".join(parts)}</svg>'
    )
