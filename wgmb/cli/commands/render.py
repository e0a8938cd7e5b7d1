"""`wgmb render`: built-in scenes."""

from __future__ import annotations

import time

from ...errors import InputError, counted
from ...render import Render
from ...run.job import check_confidence
from ...run.scene import RenderedFrames, render_frames
from ...settings import size_of
from ...settings.color import DisplaySettings, color_record
from ...settings.record import record
from ..exit_codes import DONE
from ..options import (
    Adapter,
    Confidence,
    ConfigFile,
    DisplayOptions,
    Outputs,
    Quiet,
    SceneBlurOptions,
    SceneBlurs,
    SceneName,
    SceneOptions,
    SceneTimes,
    ShutterOptions,
    Shutters,
    Verbose,
)
from ..terminal import note, progress


def render(
    scene: SceneName,
    output: Outputs,
    options: SceneTimes = SceneOptions(),
    blur: SceneBlurs = SceneBlurOptions(),
    shutter: Shutters = ShutterOptions(),
    color: DisplayOptions = DisplaySettings(),
    *,
    sharp: bool = False,
    passes: bool = False,
    confidence: Confidence = False,
    config: ConfigFile = None,
    adapter: Adapter = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> int:
    """Render a built-in scene with motion blur.

    Example: wgmb render crossing -o crossing.png --method distributed --samples 256

    Parameters
    ----------
    sharp
        Render without blur.
    passes
        EXR: add layers for depth, motion, normal, object index and light, as input for `wgmb blur`.
    confidence
        Add confidence layers, confidence.* (EXR output, method gather); doubles the time.
    config
        TOML file with options in its table [render], as saved by `wgmb view`.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Print the GPU and settings in use.
    quiet
        Print errors only.
    """
    fps = float(output.rate)
    picture = options.make(scene)
    blur, shutter = blur.resolved(picture), shutter.resolved(picture, fps)
    if blur.holdout or blur.scale:
        raise InputError("--holdout and --scale need input files; use them with wgmb blur")
    if passes and not output.is_exr:
        raise InputError(f"--passes needs an .exr output, got {output.output}")
    if passes and output.layers == "picture":
        raise InputError("--passes cannot be combined with --layers picture")
    moments = options.moments(fps)
    if confidence and sharp:
        raise InputError("--confidence cannot be combined with --sharp")
    made = blur.make(shutter.make(), adapter)
    renderer = Render(
        picture, made, size=size_of(options.size), fps=fps, antialias=options.antialias
    )
    how = {"scene": scene, "sharp": sharp, "passes": passes, "fps": fps}
    settings = record(output, blur, shutter, options, **how, samples=blur.settled_samples())
    if confidence:
        check_confidence(made.method.name, output)
        settings["confidence"] = True
    shown = color.open(needed=not output.is_exr)
    settings |= color_record(shown, output.output)
    files = output.make(settings, list(moments), display=shown)
    if color.remark and not (quiet or output.is_exr):
        note(color.remark)
    if verbose:
        note(f"adapter: {renderer.blur.device.adapter.summary}")
        note(f"settings: {files.settings}")
    frames = RenderedFrames(renderer, moments, sharp=sharp, passes=passes, confidence=confidence)
    started = time.perf_counter()
    with progress(len(moments), quiet, "rendering") as tick:
        report = render_frames(frames, files, output.resume, tick)
    if not quiet:
        seconds, skipped = time.perf_counter() - started, len(report.skipped)
        done = f"{counted(len(report.done), 'frame')} in {seconds:.1f} s -> {files.pattern}"
        note(done + (f", {skipped} already done" if skipped else ""))
    return DONE
