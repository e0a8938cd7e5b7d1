"""The command line: options into the library's words, errors into one line and an exit code.

Exit codes: 0 done, 1 some frames failed, 2 usage or input, 3 no adapter, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import logging
import os
import shlex
import signal
import sys
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import cyclopts
from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from . import __version__, compare, gpu, scenes
from . import report as report_
from .blur import METHODS
from .errors import DeviceError, Error, InputError
from .experiments import EXPERIMENTS
from .info import describe
from .options import (
    BlurOptions,
    CompareOptions,
    InputOptions,
    OutputOptions,
    SceneOptions,
    ShutterOptions,
    size_of,
    whole_numbers,
)
from .output import Output
from .render import Render, render_frames
from .run import Report, blur_sequence

DONE, SOME_FAILED, USAGE, NO_DEVICE, INTERRUPTED = 0, 1, 2, 3, 130

app = cyclopts.App(
    name="wgmb",
    version=__version__,
    help="GPU motion blur for rendered frames.\n\n"
    "Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --shutter 180",
    result_action="return_value",
    suppress_keyboard_interrupt=False,
    default_parameter=Parameter(negative=()),
)


@app.command
def blur(
    pattern: str,
    /,
    output: OutputOptions,
    look: BlurOptions | None = None,
    when: ShutterOptions | None = None,
    given: InputOptions | None = None,
    *,
    adapter: str | None = None,
    verbose: Annotated[bool, Parameter(alias="-v")] = False,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Blur rendered frames.

    Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --shutter 180 --frames 1-100

    Parameters
    ----------
    pattern
        Frames to blur: shot.####.exr, shot.%04d.exr, or one file.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Say which GPU, layers and settings are used.
    quiet
        Print errors only.
    """
    look, when, given = look or BlurOptions(), when or ShutterOptions(), given or InputOptions()
    say = Console(stderr=True, highlight=False, soft_wrap=True)
    clip = given.open(pattern, look.keep, look.scale)
    made = look.make(when.make(), adapter)
    settings = _settings(look, when, given) | {"bits": output.bits}
    files = Output(
        output.output,
        settings=settings,
        numbers=clip.numbers,
        bits=output.bits,
        fps=output.rate,
        overwrite=output.overwrite,
        resume=output.resume,
    )
    if verbose:
        say.print(f"adapter: {made.device.adapter.summary}", markup=False)
        say.print(f"settings: {files.settings}", markup=False)
    started = time.perf_counter()
    with _progress(say, len(clip.numbers), quiet) as tick:
        report = blur_sequence(clip, made, files, resume=output.resume, progress=tick)
    return _conclude(say, clip, files, report, time.perf_counter() - started, quiet, verbose)


def _settings(look: BlurOptions, when: ShutterOptions, given: InputOptions) -> dict:
    """Everything that changes a result, as it is written into the files."""
    every = {"wgmb": __version__} | _plain(look) | _plain(when) | _plain(given)
    for not_a_look in ("frames", "skip_missing"):
        del every[not_a_look]
    return every


def _plain(options) -> dict:
    return {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items()}


@contextlib.contextmanager
def _progress(say: Console, frames: int, quiet: bool, doing: str = "blurring"):
    """A bar with frames/s and time left where somebody watches; nothing elsewhere."""
    if quiet or not say.is_terminal:
        yield None
        return
    columns = (
        "{task.description}",
        BarColumn(),
        "{task.completed}/{task.total}",
        TextColumn("{task.fields[speed]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=say, transient=True) as bar:
        task = bar.add_task(doing, total=frames, speed="")
        started, made = time.perf_counter(), [0]

        def tick(number: int, what: str) -> None:
            made[0] += what == "done"
            speed = made[0] / (time.perf_counter() - started)
            bar.update(
                task, advance=1, description=f"frame {number}", speed=f"{speed:.1f} frames/s"
            )

        yield tick


def _conclude(say, clip, files, report: Report, seconds: float, quiet: bool, verbose: bool) -> int:
    """Say what became of the run; return the exit code."""

    def line(text: str) -> None:
        say.print(text, markup=False)

    for number, why in sorted(report.failed.items()):
        line(f"wgmb: frame {number} failed: {why}")
    if not quiet:
        for number, bad in sorted(report.bad.items()):
            what = ", ".join(f"{n} in {name}" for name, n in bad.items())
            line(f"frame {number}: pixels that are not finite were given no weight: {what}")
        if verbose or "because" in clip.finding or "check them" in clip.finding:
            line(f"vectors: {clip.finding}")
        done = f"{len(report.done)} frames in {seconds:.1f} s -> {files.pattern}"
        line(done + (f", {len(report.skipped)} were there" if report.skipped else ""))
    if report.failed:
        line(f"wgmb: {len(report.failed)} of {len(clip.numbers)} frames failed")
        return SOME_FAILED
    return DONE


@app.command
def render(
    scene: str,
    /,
    output: OutputOptions,
    what: SceneOptions | None = None,
    look: BlurOptions | None = None,
    when: ShutterOptions | None = None,
    *,
    sharp: bool = False,
    passes: bool = False,
    adapter: str | None = None,
    verbose: Annotated[bool, Parameter(alias="-v")] = False,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Render a built-in scene with motion blur.

    Scenes: translation, scaling, rotation, crossing, wheel, fence, bounce, hdr.

    Example: wgmb render crossing -o crossing.png --method distributed --samples 256

    Parameters
    ----------
    scene
        Its name.
    sharp
        Without blur.
    passes
        EXR: with depth, motion, normal and object index, so that `wgmb blur` can take it on.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Say which GPU and settings are used.
    quiet
        Print errors only.
    """
    what, look, when = what or SceneOptions(), look or BlurOptions(), when or ShutterOptions()
    if look.keep or look.scale:
        raise InputError("--keep and --scale are for files: wgmb render has no layers to name")
    if passes and not output.output.lower().endswith(".exr"):
        raise InputError(f"--passes need an .exr output, got {output.output}")
    fps = float(output.rate)
    moments = what.moments(fps)
    picture = scenes.make(scene, **what.settings())
    renderer = Render(
        picture, look.make(when.make(), adapter), size=size_of(what.size), fps=fps, rays=what.rays
    )
    settings = {"scene": scene, "sharp": sharp, "passes": passes, "bits": output.bits}
    settings |= _plain(look) | _plain(when) | _plain(what) | {"wgmb": __version__, "fps": fps}
    files = Output(
        output.output,
        settings=settings,
        numbers=list(moments),
        bits=output.bits,
        fps=output.rate,
        overwrite=output.overwrite,
        resume=output.resume,
    )
    say = Console(stderr=True, highlight=False, soft_wrap=True)
    if verbose:
        say.print(f"adapter: {renderer.blur.device.adapter.summary}", markup=False)
        say.print(f"settings: {files.settings}", markup=False)
    started = time.perf_counter()
    with _progress(say, len(moments), quiet, "rendering") as tick:
        try:
            skipped = render_frames(renderer, moments, files, sharp, passes, output.resume, tick)
        except BaseException:
            files.abandon()
            raise
    if not quiet:
        seconds, made = time.perf_counter() - started, len(moments) - skipped
        done = f"{made} frames in {seconds:.1f} s -> {files.pattern}"
        say.print(done + (f", {skipped} were there" if skipped else ""), markup=False)
    return DONE


@app.command
def info(
    pattern: str,
    /,
    given: InputOptions | None = None,
    *,
    output: Annotated[Path | None, Parameter(alias="-o")] = None,
    overwrite: bool = False,
) -> int:
    """Say what a frame holds: layers, sizes, what its motion vectors mean, speeds.

    Example: wgmb info 'shot.####.exr' --frames 10 -o motion.png

    Parameters
    ----------
    pattern
        A file, or a pattern (its first frame is shown, neighbours test the vectors).
    output
        Draw the motion as a picture: hue is direction, brightness speed.
    overwrite
        Replace that picture if it exists.
    """
    given = given or InputOptions()
    clip = given.open(pattern)
    if output is not None and output.exists() and not overwrite:
        raise InputError(f"{output} exists; --overwrite replaces it")
    lines = describe(clip, output)
    say = Console(highlight=False, soft_wrap=True)
    for name, text in lines:
        say.print(f"{name:10}{text}", markup=False)
    return DONE


@app.command
def devices() -> int:
    """List the GPUs that --adapter (or WGMB_ADAPTER) can choose; * is the default.

    Example: WGMB_ADAPTER=llvmpipe wgmb devices
    """
    found = gpu.adapters()
    try:
        chosen = gpu.choose_adapter()
    except DeviceError:
        chosen = None
    for i, adapter in enumerate(found):
        same = chosen is not None and adapter.summary == chosen.summary
        sys.stdout.write(f"{'*' if same else ' '} {i}: {adapter.summary}\n")
    if chosen is None:
        gpu.choose_adapter()  # says why
    return DONE


@app.command(name="compare")
def compare_(
    *scene: str,
    output: Annotated[Path, Parameter(alias="-o")],
    who: CompareOptions | None = None,
    when: ShutterOptions | None = None,
    given: InputOptions | None = None,
    size: str = "480x270",
    time: float = 0.0,
    rays: int = 3,
    truth: Path | None = None,
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
        What the blurred frame should look like.
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
    pages = [output.with_suffix(suffix) for suffix in (".html", ".json", ".csv")]
    if output.suffix != ".html":
        raise InputError(f"output must be a page such as report.html, got {output}")
    for file in pages:
        if file.exists() and not overwrite:
            raise InputError(f"{file} exists; --overwrite replaces it")
    if (truth is None) != (not inputs) or bool(scene) + bool(inputs) + bool(experiment) != 1:
        raise InputError("give scenes, or --truth with --inputs, or --experiment")
    device = gpu.open_device(adapter)
    say = Console(stderr=True, highlight=False, soft_wrap=True)

    def tell(text: str) -> None:
        if not quiet:
            say.print(text, markup=False)

    lab = compare.Laboratory(device, rounds=who.rounds, tell=tell)
    report = compare.Report("", _command_line(), compare.machine(device), who.samples)
    wanted, contenders = size_of(size), who.contenders()
    steps, budgets = who.steps(), who.budgets()
    if experiment:
        if experiment not in EXPERIMENTS:
            known = ", ".join(EXPERIMENTS)
            raise InputError(f"experiment must be one of {known}, got {experiment!r}")
        report.title = f"{experiment.capitalize()}'s experiment"
        EXPERIMENTS[experiment](lab, report, wanted)
        report_.write(report, output)
        tell(f"-> {output}")
        return DONE
    reference = compare.Contender.parse(who.reference)
    peers = {name: Path(file) for name, _, file in (p.partition("=") for p in peer)}
    cases: list[Callable[[], compare.Case]] = []
    for degrees, shutter in who.exposures(when).items():
        for name, made in map(compare.make_scene, scene):
            staged = compare.Staged(made, time, wanted, rays=rays)
            cases.append(partial(compare.scene_case, f"{name}, {degrees}", shutter, reference,
                                 staged, device, tell))  # fmt: skip
        if truth is not None and inputs:
            cases.append(partial(compare.clip_case, f"{truth.parent.name or truth.stem}, {degrees}",
                                 shutter, inputs, frame, truth, peers, given.open))  # fmt: skip
    able = contenders if who.methods or scene else [c for c in contenders if not c.needs_scene]
    for make in cases:
        case = make()
        lab.compare(report, case, able, steps, budgets)
        if found := compare.crossings(report, case):
            report.tables.append(found)
    report.title = "Motion blur compared: " + ", ".join(c.name for c in report.cases)
    report_.write(report, output)
    tell(f"-> {output}")
    return DONE


def _command_line() -> str:
    return shlex.join(["wgmb", *sys.argv[1:]])


@app.command
def bench(
    *,
    methods: str | None = None,
    samples: str = "16",
    size: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    rounds: int = 9,
    output: Annotated[Path | None, Parameter(alias="-o")] = None,
    save: Path | None = None,
    against: Path | None = None,
    adapter: str | None = None,
) -> int:
    """Time methods on this machine: median milliseconds a frame, transfers apart.

    Example: wgmb bench --methods tap,reproject --size 960x540 1920x1080 --samples 4,16,64

    Parameters
    ----------
    methods
        NAME[:OPTION=VALUE]..., separated by commas; all that blur rendered frames by default.
    samples
        Numbers of samples, separated by commas.
    size
        Pictures to time it on; 1920x1080 by default.
    rounds
        How often everything is done.
    output
        A page with tables and plots, .html; JSON and CSV beside it.
    save
        Keep the figures, for --against.
    against
        Compare with figures kept earlier.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    """
    from . import bench as measure

    every = map(compare.Contender, METHODS)
    contenders = (
        [compare.Contender.parse(text) for text in methods.split(",")]
        if methods
        else [c for c in every if not c.needs_scene]
    )
    counts = whole_numbers("samples", samples)
    sizes = [size_of(text) for text in size or ["1920x1080"]]
    before = measure.Bench.load(against) if against else None
    run = measure.bench(gpu.open_device(adapter), contenders, sizes, counts, rounds)
    sys.stdout.write(measure.text(run))
    if before:
        table = measure.against(run, before)
        for row in (table.columns, *table.rows):
            sys.stdout.write("".join(f"{cell!s:>20}" for cell in row) + "\n")
    if output:
        report_.write(measure.report(run, _command_line(), before), output)
    if save:
        run.save(save)
    return DONE


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    _own_streams()
    signal.signal(signal.SIGTERM, _interrupted)
    signal.signal(signal.SIGINT, _interrupted)  # a shell may have set it to be ignored
    warnings.simplefilter("ignore")  # libraries' remarks on damaged files; ours are errors
    logging.getLogger("tifffile").setLevel(logging.CRITICAL)
    try:
        result = app(arguments, exit_on_error=False, print_error=False)
        sys.stdout.flush()
        return result if isinstance(result, int) else DONE
    except cyclopts.CycloptsError as error:
        return _say_why(str(error), USAGE)
    except DeviceError as error:
        return _say_why(str(error), NO_DEVICE)
    except Error as error:
        return _say_why(str(error), USAGE)
    except OSError as error:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - whoever read us may be gone
        return _say_why(str(error), SOME_FAILED)
    except KeyboardInterrupt:
        return _say_why("interrupted", INTERRUPTED)


def _interrupted(*_) -> None:
    raise KeyboardInterrupt


def _say_why(text: str, code: int) -> int:
    with contextlib.suppress(OSError):
        sys.stderr.write(f"wgmb: {' '.join(text.split())}\n")
    return code


def _own_streams() -> None:
    """Move Python's output off descriptors 1 and 2, so that native chatter can be held back."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        try:
            if stream.fileno() > 2:
                continue
            stream.flush()
            own = os.fdopen(
                os.dup(stream.fileno()),
                "w",
                buffering=1,
                encoding=stream.encoding,
                errors="replace",
            )
        except (OSError, ValueError, AttributeError):
            continue
        setattr(sys, name, own)


def run() -> None:
    """The `wgmb` command."""
    sys.exit(main())
