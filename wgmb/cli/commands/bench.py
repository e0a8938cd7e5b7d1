"""`wgmb bench`: time methods on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ... import gpu
from ...errors import InputError
from ...lab.cases import Candidate
from ...lab.report import write
from ...methods import METHODS
from ...settings import size_of
from .. import terminal
from ..console import Console
from ..options import Adapter, Quiet
from ..pages import command_line, pages_of, whole_numbers
from ..terminal import out


def bench(
    *,
    methods: str | None = None,
    samples: str = "16",
    flow: str | None = None,
    size: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    rounds: int = 9,
    seconds: float = 60.0,
    output: Annotated[Path | None, Parameter(alias="-o")] = None,
    save: Path | None = None,
    against: Path | None = None,
    article: bool = False,
    adapter: Adapter = None,
    quiet: Quiet = False,
) -> int:
    """Time methods and videos here: median milliseconds per frame, transfers apart.

    Example: wgmb bench --methods tap,reproject --size 960x540 1920x1080 --samples 4,16,64

    Example: wgmb bench --methods all --size 960x540 1920x1080 3840x2160 --samples 4,16,64

    Example: wgmb bench --flow none,dis,search:draft

    Ctrl-C stops early and reports the measurements so far.

    Parameters
    ----------
    methods
        NAME[:OPTION=VALUE]..., separated by commas, or all; by default those that blur rendered
        frames. The others are timed on a built-in scene.
    samples
        Sample counts, separated by commas.
    flow
        NAME[:QUALITY]..., separated by commas, such as none,dis,search:fast: sources of motion by
        which pictures of a video are timed, too; auto unless --methods is set.
    size
        Image sizes; 1920x1080 by default.
    rounds
        Number of timing rounds.
    seconds
        Time limit per method, size and sample count; runs expected to exceed it get fewer rounds
        or are skipped and listed.
    output
        Report with tables and plots, .html; JSON and CSV files are written next to it.
    save
        Save the measurements, for use with --against.
    against
        Compare with measurements saved earlier.
    article
        Time the torusphere instead (at 640x360 compared with the article's shader on two cores).
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    quiet
        Hide the progress.
    """
    from ...lab import baselines, bench_report
    from ...lab.bench import bench as measure
    from ...lab.bench_figures import Bench
    from ...lab.video_bench import flow_settings

    device, sizes = gpu.open_device(adapter), [size_of(text) for text in size or ["1920x1080"]]
    if article:
        blur = baselines.article_blur(device)
        for width, height in sizes:
            _tell_article(baselines.bench_torusphere(blur, width, height, rounds), width, height)
        return 0
    candidates = [Candidate(name) for name in METHODS]
    flows = list(dict.fromkeys(flow.split(","))) if flow else [] if methods else ["auto"]
    for one in flows:
        flow_settings(one, device)
    if methods is None:
        candidates = [c for c in candidates if not c.needs_scene and not flow]
    elif methods != "all":
        candidates = [Candidate.parse(text) for text in methods.split(",")]
    if wrong := [c for c in candidates if c.samples]:
        raise InputError(
            f"set the number of samples with --samples, not {wrong[0].label}:{wrong[0].samples}"
        )
    labels = [c.label for c in candidates]
    if twice := [label for label in labels if labels.count(label) > 1]:
        raise InputError(f"methods must differ, got {twice[0]} twice")
    pages = pages_of(output) if output else []
    if save and save.resolve() in [page.resolve() for page in pages]:
        raise InputError(f"--save {save} is also written by --output {output}; rename one")
    if save and not save.parent.is_dir():
        raise InputError(f"no such folder: {save.parent}")
    counts = whole_numbers("samples", samples)
    before = Bench.load(against) if against else None
    say = Console(quiet).say_running
    run = measure(device, candidates, sizes, counts, rounds, seconds, say, flows)
    if save:
        run.save(save)
    for line in bench_report.text(run).splitlines():
        out(line)
    if before:
        table = bench_report.against(run, before)
        out(table.note)
        for row in (table.columns, *table.rows):
            out("".join(f"{cell!s:>20}" for cell in row))
    if output:
        write(bench_report.report(run, command_line(), before), output)
    terminal.check()
    return 0


def _tell_article(results: dict[float, tuple[float, ...]], width: int, height: int) -> None:
    from ...lab.baselines import ARTICLE

    out(f"{width} x {height}, torusphere, published density")
    for time_, (frame, recording, work) in results.items():
        line = f"  iTime {time_:<6g}{frame:9.2f} ms per frame, {recording:.2f} of it recording, "
        line += f"{work:.2f} ms of CPU time on all cores"
        if (width, height) == (640, 360):
            ratios = frame / ARTICLE[time_], work / 2 / ARTICLE[time_]
            line += "; {:.2f} times the article's shader, {:.2f} times with two free cores".format(
                *ratios
            )
        out(line)
