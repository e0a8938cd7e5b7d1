"""A Report as one page that needs no network, as JSON and as CSV."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..charts import Axes, log_ticks, ticks
from ..io.atomic import mode_of, write_file
from ..metrics import FLIP_GAIN, METRICS, display, flip_colors
from .cases import Case
from .results import Bars, Entry, Plot, Report, Table

_COLORS = 10  # in report.html
_TEMPLATE = Path(__file__).with_name("report.html")


def write(report: Report, path: Path, inputs: Iterable[Path] = ()) -> list[Path]:
    """Write the page to `path`, and .json and .csv beside it; returns the three paths.

    `inputs`: the files whose pictures it has; see atomic.mode_of.
    """
    mode = mode_of(path.parent, inputs)
    written = {
        path: page(report),
        path.with_suffix(".json"): json.dumps(as_json(report), indent=1) + "\n",
        path.with_suffix(".csv"): as_csv(report),
    }
    for file, text in written.items():
        write_file(file, text.encode(), mode=mode)
    return list(written)


def as_json(report: Report) -> dict[str, Any]:
    """All figures of a report; a number that is not finite is null."""
    return {
        "title": report.title,
        "command": report.command,
        "machine": report.machine,
        "cases": [
            {
                "name": c.name,
                "truth": c.about,
                "floor": c.floor and {k: _plain(v) for k, v in c.floor.items()},
            }
            for c in report.cases
        ],
        "entries": [_row(e) for e in report.entries],
        "tables": [
            {
                "title": t.title,
                "note": t.note,
                "columns": list(t.columns),
                "rows": [[_plain(v) for v in row] for row in t.rows],
            }
            for t in report.tables
        ],
        "plots": [
            {"title": p.title, "x": p.x, "y": p.y, "floor": p.floor, "curves": p.curves}
            for p in report.plots
        ],
        "notes": report.notes,
    }


def as_csv(report: Report) -> str:
    """One line an entry; where there are none, the tables one below the other."""
    text = io.StringIO()
    rows = [_row(e) for e in report.entries]
    if rows:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    for i, table in enumerate([] if rows else report.tables):
        lines = csv.writer(text, lineterminator="\n")
        lines.writerows([*([[]] if i else []), table.columns, *table.rows])
    return text.getvalue()


def _row(e: Entry) -> dict[str, Any]:
    own = {"case": e.case, "method": e.label, "kind": e.kind, "samples": e.samples,
           "seconds": e.seconds, "frame_seconds": e.frame_seconds, "budget": e.budget}  # fmt: skip
    return own | {name: _plain(value) for name, value in e.measures.items()}


def _plain(value: object):
    return None if isinstance(value, float) and not math.isfinite(value) else value


# ---- the page -------------------------------------------------------------------------------


def page(report: Report) -> str:
    """The report as HTML: styles, pictures, plots and script all within."""
    colors: dict[str, str] = {}
    for label in (e.label for e in report.entries if e.kind in ("samples", "time")):
        colors.setdefault(label, f"var(--c{len(colors) % _COLORS})")
    parts = [_head(report)]
    if len(report.cases) > 1:
        parts.append(_means(report, colors))
    parts += [_table(t, colors) for t in report.tables]
    parts += [_plots(report.plots, colors, report.bars)]
    parts += [_case(report, i, case, colors) for i, case in enumerate(report.cases)]
    parts.append(_foot(report))
    text = _TEMPLATE.read_text(encoding="utf-8")
    places = {"title": escape(report.title), "body": "\n".join(parts)}
    return re.sub(r"\{\{(title|body)\}\}", lambda place: places[place[1]], text)


def _head(report: Report) -> str:
    links = "".join(f'<a href="#case{i}">{escape(c.name)}</a>' for i, c in enumerate(report.cases))
    nav = f"<nav>{links}</nav>" if len(report.cases) > 1 else ""
    about = " · ".join(escape(f"{k} {v}") for k, v in report.machine.items())
    return (
        f"<h1>{escape(report.title)}</h1><p class=soft>{about}</p>"
        f"<pre>{escape(report.command)}</pre>{nav}"
    )


def _means(report: Report, colors: dict[str, str]) -> str:
    """Every method's mean over the cases, at equal samples."""
    by_label: dict[str, list[Entry]] = {}
    for e in report.entries:
        if e.on_page and e.kind != "time":
            by_label.setdefault(e.label, []).append(e)
    everywhere = {k: v for k, v in by_label.items() if len(v) == len(report.cases)}
    columns = ["method", *(m.title for m in METRICS.values())]
    rows = [
        [label, *(float(np.mean([e.measures[name] for e in found])) for name in METRICS)]
        for label, found in everywhere.items()
    ]
    note = f"Mean of {len(report.cases)} cases, {report.samples} samples each; best in green."
    return f"<h2>All cases</h2><p class=soft>{note}</p>" + _grid(columns, rows, colors, judged=1)


def _case(report: Report, index: int, case: Case, colors: dict[str, str]) -> str:
    truth = Entry(case.name, "truth", "truth", {}, picture=case.truth)
    still = [e for e in report.of(case.name, on_page=True) if e.kind != "time"]
    timed = report.of(case.name, kind="time")
    parts = [
        f'<h2 id="case{index}">{escape(case.name)}</h2>',
        f"<p class=soft>Truth: {escape(case.about)}</p>",
        _viewer(index, [*still, truth, *timed]),
        f"<h3>Equal samples: {report.samples}</h3>",
        _cards(index, case, [*still, truth]),
    ]
    for budget in sorted({e.budget for e in timed if e.budget is not None}):
        parts.append(f"<h3>Equal time: {1e3 * budget:.0f} ms</h3>")
        parts.append(_cards(index, case, [e for e in timed if e.budget == budget]))
    parts.append("<h3>Figures</h3>")
    parts.append(_figures(report.of(case.name), colors))
    if case.scene_frame is not None:
        parts.append(
            "<p class=soft>Times of methods that take rendered frames include rendering one.</p>"
        )
    parts.append("<h3>Error against time and samples</h3>")
    parts.append(_plots(_curves(report.of(case.name, kind="samples"), case.floor or {}), colors))
    return "\n".join(parts)


def _viewer(index: int, entries: list[Entry]) -> str:
    names = [_name(e) for e in entries]
    right = next(i for i, e in enumerate(entries) if e.kind == "truth")
    left = next((i for i, e in enumerate(entries) if e.kind == "samples"), 0)

    def picker(side: str, chosen: int) -> str:
        options = "".join(
            f"<option{' selected' if i == chosen else ''}>{escape(name)}</option>"
            for i, name in enumerate(names)
        )
        return f'<label>{side} <select class="{side}">{options}</select></label>'

    return (
        f'<div class="viewer" data-case="{index}"><div class="stage" style="--at:50%">'
        '<img class="right" alt=""><img class="left" alt=""><div class="bar"></div>'
        '<span class="name-left"></span><span class="name-right"></span>'
        '<input type="range" min="0" max="100" step="0.1" value="50" aria-label="compare"></div>'
        f'<div class="pick">{picker("left", left)}{picker("right", right)}'
        '<label><input type="checkbox"> error maps</label></div></div>'
    )


def _name(e: Entry) -> str:
    if e.kind == "time" and e.budget is not None:
        return f"{e.label}, {e.samples} in {1e3 * e.budget:.0f} ms"
    return e.label if e.samples is None else f"{e.label}, {e.samples}"


def _cards(index: int, case: Case, entries: Iterable[Entry]) -> str:
    return f'<div class="cards">{"".join(_card(index, case, e) for e in entries)}</div>'


def _card(index: int, case: Case, e: Entry) -> str:
    assert e.picture is not None
    name = escape(_name(e))
    images = f'<img src="{_uri(display(e.picture))}" alt="{name}">'
    about = "reference for the other images"
    if e.measures:
        errors = flip_colors(e.picture, case.truth)
        images += f'<img src="{_uri(errors)}" alt="error of {name}">'
        about = f"FLIP {e.measures['flip']:.4f} · PSNR {e.measures['psnr']:.1f} dB"
        if e.seconds is not None:
            about += f" · {1e3 * e.seconds:.0f} ms"
    return (
        f'<figure class="card" data-case="{index}" data-name="{name}">'
        f'<button title="show on the left above">{images}</button>'
        f"<figcaption><b>{name}</b><br>{about}</figcaption></figure>"
    )


def _uri(values: np.ndarray) -> str:
    """A picture of display values 0..1 within the page."""
    data = io.BytesIO()
    levels = (255 * np.clip(values, 0, 1) + 0.5).astype(np.uint8)
    Image.fromarray(levels).save(data, "WEBP", quality=90, method=4)
    return "data:image/webp;base64," + base64.b64encode(data.getvalue()).decode()


def _figures(entries: list[Entry], colors: dict[str, str]) -> str:
    framed = any(e.frame_seconds for e in entries)
    columns = ["method", "samples", "time [ms]", *["without frame [ms]"][: int(framed)]]
    columns += [m.title for m in METRICS.values()]
    rows, floor = [], None
    for e in entries:
        times: list[float | None] = [None, None]
        if e.seconds is not None:
            times = [round(1e3 * s, 2) for s in (e.seconds, e.seconds - e.frame_seconds)]
        rows.append([e.label, e.samples, *times[: 1 + framed], *e.measures.values()])
        floor = rows[-1] if e.kind == "floor" else floor
    return _grid(columns, rows, colors, judged=3 + framed, floor=floor)


def _table(table: Table, colors: dict[str, str]) -> str:
    note = f"<p class=soft>{escape(table.note)}</p>" if table.note else ""
    return f"<h3>{escape(table.title)}</h3>{note}{_grid(table.columns, table.rows, colors)}"


def _grid(
    columns: Sequence[object],
    rows: Sequence[Sequence[Any]],
    colors: dict[str, str],
    judged: int | None = None,
    floor: Sequence[Any] | None = None,
) -> str:
    """A sortable table; from column `judged` on stand the METRICS, the best of each marked.

    The row `floor` takes no part in that.
    """
    heads = "".join(
        f'<th scope="col"><button type="button">{escape(str(c))}</button></th>' for c in columns
    )
    best: dict[int, float] = {}
    ranked = [row for row in rows if row is not floor]
    if judged is not None and len(ranked) > 1:
        for i, m in enumerate(METRICS.values(), judged):
            best[i] = (max if m.more_is_better else min)(row[i] for row in ranked)
    digits = {i: _digits(row[i] for row in rows) for i in range(len(columns))}
    if judged is not None:
        digits |= {i: m.digits for i, m in enumerate(METRICS.values(), judged)}
    lines = []
    for row in rows:
        cells = []
        for i, value in enumerate(row):
            wins = i in best and value == best[i] and row is not floor
            mark = " class=best" if wins else ""
            key = f' data-value="{value}"' if isinstance(value, int | float) else ""
            key = ' data-value=""' if value is None else key
            text = escape(_text(value, digits[i]))
            if i == 0 and str(value) in colors:
                text = f'<span class="dot" style="background:{colors[str(value)]}"></span>{text}'
            cells.append(f"<td{mark}{key}>{text}</td>")
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return (
        f'<div class="scroll"><table class="sort"><thead><tr>{heads}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def _digits(values: Iterable[object]) -> int:
    """Decimals that the numbers of a column need, four at most."""
    numbers = [f"{v:.4f}".rstrip("0") for v in values if isinstance(v, float) and math.isfinite(v)]
    return max((len(n.partition(".")[2]) for n in numbers), default=0)


def _text(value: object, digits: int) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        if math.isinf(value):
            return "∞"
        return f"{value + 0.0:.{digits}f}"
    return str(value)


def _foot(report: Report) -> str:
    notes = "".join(f"<p>{escape(n)}</p>" for n in report.notes)
    if not report.cases:
        return notes and f"<h2>Notes</h2>{notes}"
    metrics = "".join(f"<dt>{m.title}</dt><dd>{m.about}</dd>" for m in METRICS.values())
    return (
        f"<h2>How to read this</h2>{notes}<dl>{metrics}<dt>error maps</dt>"
        f"<dd>{FLIP_GAIN:g} times FLIP per pixel: black is identical, white very different</dd>"
        "<dt>time</dt><dd>wall clock from recording to the end of the GPU's work, the minimum of "
        "several rounds; only times on one page are comparable</dd>"
        "<dt>noise floor</dt><dd>score of a perfect image, limited by noise in the truth: each of "
        "two independent halves of the truth against their mean</dd></dl>"
        "<p class=soft>Scores were computed from floating-point images; the images on this page "
        "are compressed. JSON and CSV files are next to it.</p>"
    )


# ---- plots ----------------------------------------------------------------------------------


def _curves(entries: list[Entry], floor: dict[str, float]) -> list[Plot]:
    plots = []
    for metric in ("flip", "psnr"):
        m = METRICS[metric]
        unit = " [dB]" if metric == "psnr" else ""
        for title, x, key in (("time", "ms", lambda e: 1e3 * (e.seconds or 0)),
                              ("samples", "samples", lambda e: e.samples)):  # fmt: skip
            curves: dict[str, list[tuple[float, float]]] = {}
            for e in entries:
                curves.setdefault(e.label, []).append((key(e), e.measures[metric]))
            better = "higher is better" if m.more_is_better else "lower is better"
            plots.append(
                Plot(f"{m.title} against {title}", x, f"{m.title}{unit}, {better}", curves,
                     floor=floor.get(metric))
            )  # fmt: skip
    return plots


def _plots(plots: Iterable[Plot], colors: dict[str, str], bars: Iterable[Bars] = ()) -> str:
    drawn = "".join(map(_bars, bars)) + "".join(_plot(p, colors) for p in plots)
    return f'<div class="plots">{drawn}</div>' if drawn else ""


def _plot(plot: Plot, colors: dict[str, str]) -> str:
    named = {k: colors.get(k, f"var(--c{i % _COLORS})") for i, k in enumerate(plot.curves)}
    return _figure(plot.title, plot_svg(plot, named), named)


def _bars(bars: Bars) -> str:
    parts = dict.fromkeys(part for row in bars.rows.values() for part in row)
    named = {part: f"var(--c{i % _COLORS})" for i, part in enumerate(parts)}
    return _figure(bars.title, bars_svg(bars, named), named)


def _figure(title: str, drawing: str, colors: dict[str, str]) -> str:
    legend = "".join(
        f'<span><i class="dot" style="background:{color}"></i>{escape(name)}</span>'
        for name, color in colors.items()
    )
    return (
        f'<figure class="plot"><figcaption><b>{escape(title)}</b></figcaption>'
        f"{drawing}<figcaption>{legend}</figcaption></figure>"
    )


# ---- the curves of a report as SVG ------------------------------------------------------------


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
