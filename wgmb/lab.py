"""The laboratory's commands: `wgmb compare` and `wgmb bench`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from . import gpu, terminal
from .blur import METHODS
from .cases import Case, Contender, Staged, Tell, clip_case, make_scene, scene_case
from .compare import Laboratory, crossings
from .errors import InputError
from .experiments import EXPERIMENTS
from .findings import Report, machine
from .options import CompareOptions, InputOptions, ShutterOptions, size_of, whole_numbers
from .pipeline import Blur
from .report import write
from .shutter import Shutter
from .terminal import note, out


def compare(
    *scene: str,
    output: Annotated[Path, Parameter(alias="-o")],
    who: CompareOptions | None = None,
    when: ShutterOptions | None = None,
    given: InputOptions | None = None,
    size: str = "480x270",
    time: float = 0.0,
    rays: int = 3,
    truth: Annotated[list[Path] | None, Parameter(consume_multiple=True)] = None,
    inputs: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    frame: int | None = None,
    peer: tuple[str, ...] = (),
    experiment: str | None = None,
    adapter: str | None = None,
    overwrite: bool = False,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Judge and time methods against a truth; writes a page, and JSON and CSV beside it.

    Example: wgmb compare crossing fence:speed=5 --methods tap,reproject -o report.html

    Example: wgmb compare --truth t.exr --inputs 'shot.####.exr' --frame 2 -o report.html

    Parameters
    ----------
    scene
        Built-in scenes, NAME[:SETTING=VALUE]...
    output
        The page, .html.
    size
        Of scenes' pictures.
    time
        Moment of the scenes in seconds.
    rays
        Antialiasing of scenes' sharp frames: rays a pixel's side.
    truth
        What the blurred frame should look like: a file, or two that were rendered with half the
        samples and other seeds, whose mean it is: their difference tells how noisy it is.
    inputs
        Rendered frames: a pattern, or the files of the frame before, this one and the next.
    frame
        Number of the pattern's frame that the truth shows.
    peer
        NAME=FILE: another program's picture of it; may be repeated.
    experiment
        Repeat a paper's experiment instead: taylor, chen or rosado.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    overwrite
        Replace files that exist.
    quiet
        Print errors only.
    """
    who, when, given = who or CompareOptions(), when or ShutterOptions(), given or InputOptions()
    pages = _pages(output)
    for file in pages:
        if file.exists() and not overwrite:
            raise InputError(f"{file} exists; --overwrite replaces it")
    if (truth is None) != (not inputs) or bool(scene) + bool(inputs) + bool(experiment) != 1:
        raise InputError("give scenes, or --truth with --inputs, or --experiment")
    device = gpu.open_device(adapter)
    tell = _teller(quiet)
    lab = Laboratory(device, rounds=who.rounds, tell=tell)
    report = Report("", _command_line(), machine(device), who.samples)
    wanted, contenders = size_of(size), who.contenders()
    steps, budgets = who.steps(), who.budgets()
    if experiment:
        if experiment not in EXPERIMENTS:
            known = ", ".join(EXPERIMENTS)
            raise InputError(f"experiment must be one of {known}, got {experiment!r}")
        report.title = f"{experiment.capitalize()}'s experiment"
        EXPERIMENTS[experiment](lab, report, wanted)
        write(report, output)
        tell(f"-> {output}")
        return 0
    reference = Contender.parse(who.reference)
    peers = {name: Path(file) for name, _, file in (p.partition("=") for p in peer)}
    cases: list[Callable[[], Case]] = []
    for name, made in map(make_scene, scene):
        staged = Staged(made, time, wanted, rays=rays)
        for degrees, shutter in who.exposures(when, made).items():
            cases.append(partial(scene_case, f"{name}, {degrees}", shutter, reference,
                                 staged, device, tell))  # fmt: skip
    if truth is not None and inputs:
        name = truth[0].parent.name or truth[0].stem
        for degrees, shutter in who.exposures(when).items():
            cases.append(partial(clip_case, f"{name}, {degrees}", shutter, inputs, frame,
                                 truth, peers, given.open))  # fmt: skip
    able = contenders if who.methods or scene else [c for c in contenders if not c.needs_scene]
    for make in cases:
        case = make()
        lab.compare(report, case, able, steps, budgets)
        if found := crossings(report, case):
            report.tables.append(found)
    report.title = "Motion blur compared: " + ", ".join(c.name for c in report.cases)
    write(report, output)
    tell(f"-> {output}")
    return 0


def bench(
    *,
    methods: str | None = None,
    samples: str = "16",
    size: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    rounds: int = 9,
    seconds: float = 60.0,
    output: Annotated[Path | None, Parameter(alias="-o")] = None,
    save: Path | None = None,
    against: Path | None = None,
    article: bool = False,
    adapter: str | None = None,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Time methods on this machine: median milliseconds a frame, transfers apart.

    Example: wgmb bench --methods tap,reproject --size 960x540 1920x1080 --samples 4,16,64

    Example: wgmb bench --methods all --size 960x540 1920x1080 3840x2160 --samples 4,16,64

    Ctrl-C ends it with what was measured until then.

    Parameters
    ----------
    methods
        NAME[:OPTION=VALUE]..., separated by commas, or all; by default those that blur rendered
        frames. The others are timed on a built-in scene.
    samples
        Numbers of samples, separated by commas.
    size
        Pictures to time it on; 1920x1080 by default.
    rounds
        How often everything is done.
    seconds
        For a method at one size with one number of samples: where it would take longer it gets
        fewer rounds, or is left out.
    output
        A page with tables and plots, .html; JSON and CSV beside it.
    save
        Keep the figures, for --against.
    against
        Compare with figures kept earlier.
    article
        Instead, the torusphere (640x360: beside the article's own shader on two cores).
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    quiet
        Do not say how far it is.
    """
    from . import bench_page, peers
    from .bench import Bench
    from .bench import bench as measure

    device, sizes = gpu.open_device(adapter), [size_of(text) for text in size or ["1920x1080"]]
    if article:
        blur = Blur("volume", device=device, shutter=Shutter(720, curve="cosine"))
        for width, height in sizes:
            _tell_article(peers.bench_torusphere(blur, width, height, rounds), width, height)
        return 0
    contenders = [Contender(name) for name in METHODS]
    if methods is None:
        contenders = [c for c in contenders if not c.needs_scene]
    elif methods != "all":
        contenders = [Contender.parse(text) for text in methods.split(",")]
    if wrong := [c for c in contenders if c.samples]:
        raise InputError(
            f"bench takes samples from --samples, got {wrong[0].label}:{wrong[0].samples}"
        )
    labels = [c.label for c in contenders]
    if twice := [label for label in labels if labels.count(label) > 1]:
        raise InputError(f"methods must differ, got {twice[0]} twice")
    pages = _pages(output) if output else []
    if save and save.resolve() in [page.resolve() for page in pages]:
        raise InputError(f"{save} is written beside {output} already; save the figures elsewhere")
    if save and not save.parent.is_dir():
        raise InputError(f"there is no folder {save.parent}")
    counts = whole_numbers("samples", samples)
    before = Bench.load(against) if against else None
    run = measure(device, contenders, sizes, counts, rounds, seconds, _teller(quiet))
    if save:
        run.save(save)
    for line in bench_page.text(run).splitlines():
        out(line)
    if before:
        table = bench_page.against(run, before)
        out(table.note)
        for row in (table.columns, *table.rows):
            out("".join(f"{cell!s:>20}" for cell in row))
    if output:
        write(bench_page.report(run, _command_line(), before), output)
    terminal.check()
    return 0


def _pages(output: Path) -> list[Path]:
    """The page and what is written beside it; that it can be, before the work."""
    if output.suffix != ".html":
        raise InputError(f"output must be a page such as report.html, got {output}")
    if not output.parent.is_dir():
        raise InputError(f"there is no folder {output.parent}")
    return [output.with_suffix(suffix) for suffix in (".html", ".json", ".csv")]


def _tell_article(found: dict, width: int, height: int) -> None:
    from .peers import ARTICLE

    out(f"{width} x {height}, torusphere, published density")
    for time_, (frame, recording, work) in found.items():
        line = f"  iTime {time_:<6g}{frame:9.2f} ms a frame, {recording:.2f} of them recording, "
        line += f"{work:.2f} ms of all cores"
        if (width, height) == (640, 360):
            ratios = frame / ARTICLE[time_], work / 2 / ARTICLE[time_]
            line += "; to the article's shader {:.2f}, as work of two free cores {:.2f}".format(
                *ratios
            )
        out(line)


def _teller(quiet: bool) -> Tell:
    """What says on stderr how far the work is, and hears Ctrl-C."""

    def tell(text: str) -> None:
        terminal.check()
        if not quiet:
            note(text)

    return tell


def _command_line() -> str:
    return shlex.join(["wgmb", *sys.argv[1:]])
