"""`wgmb render`: built-in scenes."""

from __future__ import annotations

import json
import time

from ...run.scene import SceneRequest
from ...settings.color import DisplaySettings
from .. import run_log
from ..console import Console, done_line
from ..exit_codes import DONE
from ..options import (
    Adapter,
    Confidence,
    ConfigFile,
    DisplayOptions,
    LogJson,
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
    log_json: LogJson = None,
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
    run_log.begin(log_json, "render", output.output)
    request = SceneRequest(
        scene=scene,
        output=output,
        options=options,
        blur=blur,
        shutter=shutter,
        color=color,
        sharp=sharp,
        passes=passes,
        confidence=confidence,
    )
    run = request.open(adapter)
    console = Console(quiet, verbose)
    console.say(shutter.remark, "" if output.is_exr else color.remark)
    console.detail(f"adapter: {run.render.blur.device.adapter.summary}")
    console.detail(f"settings: {run.output.settings}")
    started = time.perf_counter()
    files = run.output
    run_log.start([scene], files.pattern, json.loads(files.settings), run.frames.total)
    with console.progress(run.frames.total, "rendering") as tick:
        report = run(run_log.logged(tick, files.pattern))
    took = f"{time.perf_counter() - started:.1f} s"
    console.say(done_line(report, took, run.output.pattern))
    return DONE
