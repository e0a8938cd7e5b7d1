"""Report of bench.py's measurements: text, tables, curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..gpu.timing import TimestampClock
from .bench_figures import Bench, BenchFigure
from .results import Bars, Plot, Report, Table


def text(run: Bench) -> str:
    """A run's figures for people."""
    lines = [f"{run.machine['adapter']}; a copy moves {run.copy:.1f} GB/s", _clocked(run)]
    for f in run.figures:
        pixels = f.width * f.height
        lines.append(f"{f.width} x {f.height}, {f.method}, {f.samples} samples")
        rows = [("call: upload + frame + readback", f.call), ("  upload", f.upload),
                ("frame: from its recording to its end", f.wall),
                ("  recording, the calling thread", f.record), ("  gpu", f.gpu),
                ("  readback", f.readback), ("sum of all passes", f.summed),
                *((f"pass {_times(f, k)}", v) for k, v in f.passes.items()),
                ("numba tap", f.numba)]  # fmt: skip
        for name, milliseconds in rows:
            if milliseconds is not None:
                each = 1e6 * milliseconds / pixels
                lines.append(f"  {name:42}{milliseconds:9.2f} ms {each:8.1f} ns per pixel")
        if f.numba:
            lines.append(f"  frame / numba tap{f.wall / f.numba:34.2f}")
        if f.bandwidth:
            share = f.bandwidth / run.copy
            lines.append(f"  bandwidth, at least{f.bandwidth:32.2f} GB/s {share:6.0%} of a copy")
        lines.append(
            f"  memory held{f.memory / 2**20:40.2f} MB {f.memory / pixels:8.1f} B per pixel"
        )
    for v in run.videos:
        lines.append(f"{v.width} x {v.height}, video, flow {v.flow} ({v.how})")
        lines.append(
            f"  {v.rate:.3g} pictures a second; the thread works {v.thread:.1f} ms a picture"
        )
        asked = ", ".join(f"{each:.4g} {kind}" for kind, each in v.counts.items())
        lines.append(f"  a picture: {asked}")
    lines += run.notes
    return "\n".join(lines) + "\n"


def _times(f: BenchFigure, label: str) -> str:
    """A pass and how often it ran."""
    return label if f.counts.get(label, 1) == 1 else f"{label} x {f.counts[label]}"


def _clocked(run: Bench) -> str:
    """Return a description of the clock of the passes and of `gpu`."""
    if run.clock == TimestampClock.name:
        return (
            "Passes timed by the GPU's timestamps; gpu is from the begin of the first to the end "
            "of the last"
        )
    return (
        "Passes timed by wall clock, each submitted separately, gpu from the submission of all to "
        f"the end; of both, the {run.empty:.2f} ms of an empty submission are taken off"
    )


def against(run: Bench, before: Bench) -> Table:
    """This run over an earlier one: under 1 is faster now."""
    old = {f.key: f for f in before.figures}
    rows = []
    for f in run.figures:
        if (was := old.get(f.key)) is None:
            continue
        peers = f.wall / f.numba / (was.wall / was.numba) if f.numba and was.numba else None
        rows.append([*_first(f), round(was.wall, 2), round(f.wall, 2), round(f.wall / was.wall, 2),
                     None if peers is None else round(peers, 2)])  # fmt: skip
    columns = ["method", "size", "samples", "before [ms]", "now [ms]", "now / before",
               "the same, by numba"]  # fmt: skip
    videos = {v.key: v for v in before.videos}
    for v in run.videos:
        if (then := videos.get(v.key)) is not None:
            was_ms, now_ms = 1e3 / then.rate, 1e3 / v.rate
            rows.append([f"video, {v.flow}", f"{v.width} x {v.height}", None, round(was_ms, 2),
                         round(now_ms, 2), round(now_ms / was_ms, 2), None])  # fmt: skip
    note = f"Before: {before.machine.get('adapter')}, {before.machine.get('made')}."
    if not rows:
        note += " The two runs have no method, size and samples in common."
    return Table("Against an earlier run", columns, rows, note)


def report(run: Bench, command: str, before: Bench | None = None) -> Report:
    """The figures as tables and plots, for report.py."""
    made = Report("Speed of the methods", command, run.machine, 0)
    columns = ["method", "size", "samples", "frame [ms]", "ns per pixel", "/ numba tap"]
    columns += [
        "recording [ms]",
        "GPU [ms]",
        "sum of passes [ms]",
        "upload [ms]",
        "readback [ms]",
        "call [ms]",
        "bandwidth, at least [GB/s]",
        "of a copy",
    ]
    rows = []
    for f in run.figures:
        each, moved = 1e6 * f.wall / (f.width * f.height), f.bandwidth
        values = (f.wall, each, f.numba and f.wall / f.numba, f.record, f.gpu, f.summed, f.upload,
                  f.readback, f.call, moved, moved and moved / run.copy)  # fmt: skip
        rows.append([*_first(f), *map(_round, values), f.memory >> 20, f.peak >> 20])
    columns += ["memory held [MB]", "peak of the process [MB]"]
    note = (
        "A frame is timed from the recording of its passes to the end of the work. A call takes "
        "arrays and returns one: upload, frame and readback. "
        f"A copy moves {run.copy:.1f} GB/s. Bytes count inputs and output, each once. "
        "Memory of a method is that of its textures and buffers, including inputs and output; "
        "memory of the process is the peak so far over all methods, in the order of the rows."
    )
    made.tables.append(Table("Every method", columns, rows, note))
    passes = [
        [*_first(f), k, f.counts.get(k, 1), round(v, 3), round(v / total, 3) if total else None]
        for f in run.figures
        for total in [sum(f.passes.values())]
        for k, v in f.passes.items()
    ]
    columns = ["method", "size", "samples", "pass", "times", "all of them [ms]", "share"]
    made.tables.append(Table("Every pass", columns, passes, f"{_clocked(run)}."))
    if run.videos:
        made.tables.append(_videos(run))
    made.notes += run.notes
    if before:
        made.tables.append(against(run, before))
    made.bars += _bars(run.figures)
    made.plots += _curves(run.figures)
    return made


def _videos(run: Bench) -> Table:
    """Pictures of videos."""
    kinds = list(run.videos[0].counts)
    columns = ["flow", "size", "pictures a second", "thread [ms a picture]", *kinds, "timed"]
    rows = [
        [v.flow, f"{v.width} x {v.height}", *map(_round, (v.rate, v.thread, *v.counts.values())),
         v.pictures]
        for v in run.videos
    ]  # fmt: skip
    note = (
        "Pictures that lie in memory, blurred by the default settings at 180 degrees. Thread: time "
        "in which the calling thread works. The other columns count calls of wgpu a picture, "
        "of all threads, and objects of wgpu that are made."
    )
    return Table("Videos", columns, rows, note)


def _bars(figures: Sequence[BenchFigure]) -> list[Bars]:
    """The parts of a call by method, for each size and number of samples."""
    bars: dict[tuple[Any, ...], Bars] = {}
    for f in figures:
        title = f"Time of a frame, {f.width} x {f.height}, {f.samples} samples"
        one = bars.setdefault((f.size, f.samples), Bars(title, "ms", {}))
        parts = {"upload": f.upload, "frame": f.wall, "readback": f.readback}
        one.rows[f.method] = {name: ms for name, ms in parts.items() if ms is not None}
    return list(bars.values())


def _curves(figures: Sequence[BenchFigure]) -> list[Plot]:
    """Time a pixel against size, time and passes against samples, where there are several."""
    sizes = sorted({(f.width * f.height, f.width, f.height) for f in figures})
    counts = sorted({f.samples for f in figures})
    plots = []
    if len(sizes) > 1:
        curves: dict[str, list[tuple[float, float]]] = {}
        for f in figures:
            if f.samples == counts[len(counts) // 2]:
                pixels = f.width * f.height
                curves.setdefault(f.method, []).append((pixels / 1e6, 1e6 * f.wall / pixels))
        title = f"Time per pixel, {counts[len(counts) // 2]} samples"
        plots.append(Plot(title, "megapixels", "ns per pixel", curves))
    if len(counts) > 1:
        _, width, height = sizes[len(sizes) // 2]
        curves = {}
        for f in figures:
            if (f.width, f.height) == (width, height):
                curves.setdefault(f.method, []).append((f.samples, f.wall))
        plots.append(Plot(f"Time against samples, {width} x {height}", "samples", "ms", curves))
        plots += _pass_curves([f for f in figures if f.size == (width, height)])
    return plots


def _pass_curves(figures: Sequence[BenchFigure]) -> list[Plot]:
    """Every pass against samples, of each method that has several."""
    plots: dict[str, Plot] = {}
    for f in figures:
        title = f"{f.method}: its passes, {f.width} x {f.height}"
        plot = plots.setdefault(f.method, Plot(title, "samples", "ms", {}))
        for label, milliseconds in f.passes.items():
            plot.curves.setdefault(label, []).append((f.samples, milliseconds))
    several = (p for p in plots.values() if len(p.curves) > 1)
    return [p for p in several if any(len(curve) > 1 for curve in p.curves.values())]


def _first(f: BenchFigure) -> list[Any]:
    return [f.method, f"{f.width} x {f.height}", f.samples]


def _round(value: float | None) -> float | None:
    return None if value is None else round(value, 2)
