"""`wgmb render`: built-in scenes."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from .._version import __version__
from ..batch import render_frames
from ..errors import InputError
from ..io.output import Output
from ..render import Render
from ..settings import SceneSettings, plain, size_of
from .blur import check_confidence, samples_of
from .exit_codes import DONE
from .options import BlurOptions, Look, Moments, SceneName, ShutterOptions, Target, When
from .terminal import note, progress


def render(
    scene: SceneName,
    output: Target,
    what: Moments = SceneSettings(),
    look: Look = BlurOptions(),
    when: When = ShutterOptions(),
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

    Example: wgmb render crossing -o crossing.png --method distributed --samples 256

    Parameters
    ----------
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
    fps = float(output.rate)
    picture = what.make(scene)
    look, when = look.resolved(picture), when.resolved(picture, fps)
    if look.holdout or look.scale:
        raise InputError("--holdout and --scale are for files: wgmb render has no layers to name")
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
    settings["samples"], settings["curve"] = samples_of(made), when.curve_read()
    if confidence:
        check_confidence(made, output)
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
