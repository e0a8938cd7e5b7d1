"""The command line: options into the library's words, errors into one line and an exit code.

Exit codes: 0 done, 1 some frames failed or the output cannot be written, 2 usage or input,
3 no adapter or display, 130 interrupted.
"""

from __future__ import annotations

import logging
import os
import re
import signal
import sys
import time
import warnings
from pathlib import Path
from typing import Annotated

import cyclopts
from cyclopts import Parameter
from cyclopts.config import Dict

from . import __version__, gpu, lab, seeing, terminal
from .errors import DeviceError, Error, InputError
from .info import describe
from .options import (
    BlurOptions,
    InputOptions,
    OutputOptions,
    SceneOptions,
    ShutterOptions,
    plain,
    size_of,
)
from .output import Output
from .pipeline import Blur
from .render import Render, render_frames
from .run import Report, blur_sequence
from .source import about, odd_sizes
from .terminal import note, out, progress
from .toml import parse, text_of

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
    output: OutputOptions,
    look: BlurOptions | None = None,
    when: ShutterOptions | None = None,
    given: InputOptions | None = None,
    *,
    confidence: bool = False,
    config: Path | None = None,
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
    confidence
        EXR, gather: with how sure the result is, as layers confidence.*; takes twice as long.
    config
        TOML file whose table [blur] holds options, as `wgmb view` saves it.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Say which GPU, layers and settings are used.
    quiet
        Print errors only.
    """
    look, given = look or BlurOptions(), given or InputOptions()
    when = (when or ShutterOptions()).settled()
    clip = given.open(pattern, look.keep, look.scale)
    look = look.settled(clip=clip)
    made = look.make(when.make(), adapter)
    settings = _settings(look, when, given) | {"samples": _samples(made)} | output.looks
    settings["curve"] = when.curve_read()
    if confidence:
        _check_confidence(made, output)
        settings["confidence"] = True
    files = Output(
        output.output,
        settings=settings,
        numbers=clip.numbers,
        bits=output.bits,
        fps=output.rate,
        inputs=clip.inputs,
        overwrite=output.overwrite,
        resume=output.resume,
        layers=output.layers,
        compression=output.compression,
    )
    if verbose:
        note(f"adapter: {made.device.adapter.summary}")
        note(f"settings: {files.settings}")
    started = time.perf_counter()
    with progress(len(clip.numbers), quiet) as tick:
        report = blur_sequence(
            clip, made, files, resume=output.resume, confidence=confidence, progress=tick
        )
    took = f"{time.perf_counter() - started:.1f} s with {made.method.name}"
    return _conclude(clip, files, report, took, quiet, verbose)


def _settings(look: BlurOptions, when: ShutterOptions, given: InputOptions) -> dict:
    """Everything that changes a result, as it is written into the files."""
    every = {"wgmb": __version__} | plain(look) | plain(when) | plain(given)
    for not_a_look in ("frames", "skip_missing", "max_mb"):
        del every[not_a_look]
    return every


def _check_confidence(made: Blur, output: OutputOptions) -> None:
    layers = ", ".join(made.confidence)
    if not output.output.lower().endswith(".exr"):
        raise InputError(f"--confidence ({layers}) needs an .exr output, got {output.output}")


def _samples(blur: Blur) -> int | str:
    return "auto" if blur.auto else blur.samples


def _conclude(clip, files, report: Report, took: str, quiet: bool, verbose: bool) -> int:
    """Say what became of the run; return the exit code."""
    for number, why in sorted(report.failed.items()):
        note(f"wgmb: frame {number} failed: {why}")
    if report.stopped:
        rest = len(clip.numbers) - len(report.done) - len(report.skipped) - len(report.failed)
        note(f"wgmb: stopped: {report.stopped}; {rest} other frames were not written")
    if not quiet:
        for number, bad in sorted(report.bad.items()):
            what = ", ".join(f"{n} in {name}" for name, n in bad.items())
            note(f"frame {number}: pixels that are not finite were given no weight: {what}")
        if verbose or "because" in clip.finding or "check them" in clip.finding:
            note(f"vectors: {clip.finding}")
        if clip.cuts:
            note(f"camera cut before frame {', '.join(map(str, sorted(clip.cuts)))}")
        if odd := odd_sizes({n: clip.sizes[n] for n in report.done}):
            note(odd)
        done = f"{len(report.done)} frames in {took} -> {files.pattern}"
        note(done + (f", {len(report.skipped)} were there" if report.skipped else ""))
    if report.failed:
        note(f"wgmb: {len(report.failed)} of {len(clip.numbers)} frames failed")
    return SOME_FAILED if report.failed or report.stopped else DONE


@app.command
def render(
    scene: str,
    output: OutputOptions,
    what: SceneOptions | None = None,
    look: BlurOptions | None = None,
    when: ShutterOptions | None = None,
    *,
    sharp: bool = False,
    passes: bool = False,
    confidence: bool = False,
    config: Path | None = None,
    adapter: str | None = None,
    verbose: Annotated[bool, Parameter(alias="-v")] = False,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Render a built-in scene with motion blur.

    Scenes: translation, scaling, rotation, crossing, wheel, fence, bounce, hdr; torusphere.

    Example: wgmb render crossing -o crossing.png --method distributed --samples 256

    Parameters
    ----------
    scene
        Its name.
    sharp
        Without blur.
    passes
        EXR: with depth, motion, normal and object index, so that `wgmb blur` can take it on.
    confidence
        EXR, gather: with how sure the result is, as layers confidence.*; takes twice as long.
    config
        TOML file whose table [render] holds options, as `wgmb view` saves it.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Say which GPU and settings are used.
    quiet
        Print errors only.
    """
    what, look, when = what or SceneOptions(), look or BlurOptions(), when or ShutterOptions()
    fps = float(output.rate)
    picture = what.make(scene)
    look, when = look.settled(picture), when.settled(picture, fps)
    if look.keep or look.scale:
        raise InputError("--keep and --scale are for files: wgmb render has no layers to name")
    if passes and not output.output.lower().endswith(".exr"):
        raise InputError(f"--passes need an .exr output, got {output.output}")
    if passes and output.layers == "picture":
        raise InputError("--passes writes layers, --layers picture leaves them out: say one")
    moments = what.moments(fps)
    if confidence and sharp:
        raise InputError("--sharp is without blur: there is no --confidence to tell")
    made = look.make(when.make(), adapter)
    renderer = Render(picture, made, size=size_of(what.size), fps=fps, rays=what.rays)
    settings = {"scene": scene, "sharp": sharp, "passes": passes} | output.looks
    settings |= plain(look) | plain(when) | plain(what) | {"wgmb": __version__, "fps": fps}
    settings["samples"], settings["curve"] = _samples(made), when.curve_read()
    if confidence:
        _check_confidence(made, output)
        settings["confidence"] = True
    files = Output(
        output.output,
        settings=settings,
        numbers=list(moments),
        bits=output.bits,
        fps=output.rate,
        overwrite=output.overwrite,
        resume=output.resume,
        layers=output.layers,
        compression=output.compression,
    )
    if verbose:
        note(f"adapter: {renderer.blur.device.adapter.summary}")
        note(f"settings: {files.settings}")
    started = time.perf_counter()
    with progress(len(moments), quiet, "rendering") as tick:
        try:
            skipped = render_frames(
                renderer, moments, files, sharp, passes, confidence, output.resume, tick
            )
        except BaseException:
            files.abandon()
            raise
    if not quiet:
        seconds, made = time.perf_counter() - started, len(moments) - skipped
        done = f"{made} frames in {seconds:.1f} s -> {files.pattern}"
        note(done + (f", {skipped} were there" if skipped else ""))
    return DONE


@app.command
def view(
    what: str | None = None,
    given: InputOptions | None = None,
    look: BlurOptions | None = None,
    when: ShutterOptions | None = None,
    *,
    config: Path | None = None,
    window: str = "1280x720",
    adapter: str | None = None,
) -> int:
    """Look at a scene or at frames interactively.

    Example: wgmb view wheel
    Example: wgmb view 'shot.####.exr' --method reproject

    Parameters
    ----------
    what
        A scene, a file or a pattern; crossing if there is no --config either.
    config
        TOML file that the viewer saved: begin as it says.
    window
        Width x height of the window.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    """
    try:
        from . import viewer
    except ImportError as error:  # of a system library: the packages are required
        raise DeviceError(
            f"the viewer cannot be loaded: {error}; on Debian, Ubuntu: "
            "apt-get install libx11-6 libxext6"
        ) from None
    state = viewer.State()
    if config is not None:
        state = viewer.State.read(config)
    if what is not None:
        state = state.opened(what)
    given, look, when = given or InputOptions(), look or BlurOptions(), when or ShutterOptions()
    state = state.told(vars(given) | vars(look) | vars(when))
    viewer.view(state, adapter=adapter, size=size_of(window))
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
    for name, text in lines:
        out(f"{name:10}{text}")
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
        out(f"{'*' if same else ' '} {i}: {adapter.summary}")
    if chosen is None:
        gpu.choose_adapter()  # says why
    return DONE


app.command(lab.compare)
app.command(lab.bench)
app.command(seeing.perceive)
app.command(seeing.shutter)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    terminal.own_streams()
    terminal.interrupted.clear()
    words = sys.argv[1:] if arguments is None else arguments
    try:
        signal.signal(signal.SIGTERM, terminal.interrupt)
        signal.signal(signal.SIGINT, terminal.interrupt)  # a shell may have set it to be ignored
        warnings.simplefilter("ignore")  # libraries' remarks on damaged files; ours are errors
        for name in ("tifffile", "wgpu"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        _check_text(words)
        app.config = _config(words)
        result = app(words, exit_on_error=False, print_error=False)
        terminal.flush()
        return result if isinstance(result, int) else DONE
    except cyclopts.CycloptsError as error:
        return _say_why(f"{error}{_hint(words)}", USAGE)
    except DeviceError as error:
        return _say_why(str(error), NO_DEVICE)
    except Error as error:
        return _say_why(str(error), USAGE)
    except OSError as error:
        why = error.strerror.lower() if error.strerror else str(error)
        if error.filename is not None:  # what was named cannot be opened
            return _say_why(f"{error.filename}: {why}", USAGE)
        return _say_why(why, SOME_FAILED)
    except MemoryError:
        return _say_why("there is not enough memory", SOME_FAILED)
    except KeyboardInterrupt:
        return _say_why("interrupted", INTERRUPTED)


def _check_text(words: list[str]) -> None:
    """Names go into files and libraries that take text only."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            shown = os.fsencode(word).decode("utf-8", "backslashreplace")
            raise InputError(f"{shown}: not UTF-8; please rename the file or folder") from None


def _hint(words: list[str]) -> str:
    """What may be meant where a file's name was taken for an option."""
    for word in words:
        if re.fullmatch(r"-[^=]*\.[A-Za-z]\w*", word):
            return f" For a file whose name begins with -, write ./{word}"
    return ""


def _config(words: list[str]) -> tuple[Dict, ...]:
    """The file named by --config; what stands on the command line wins over it."""
    for i, word in enumerate(words if words[:1] != ["view"] else []):
        name, _, given = word.partition("=")
        if name == "--config" and (given or words[i + 1 :]):
            path = Path(given or "".join(words[i + 1 : i + 2]))
            with about(path):
                return (Dict(parse(text_of(path)), source=str(path)),)
    return ()


def _say_why(text: str, code: int) -> int:
    terminal.note(f"wgmb: {' '.join(text.split())}")
    return code


def run(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    sys.unraisablehook = terminal.hush
    code = main(arguments)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    terminal.drop_streams()
    sys.exit(code)
