"""`wgmb perceive`: simulate a viewer's perception."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from ... import charts
from ...cone import VIDEOS
from ...errors import InputError, counted
from ...extras import needed_by
from ...io.atomic import write_file
from ...perceive.frames import perceive as perceive_frames
from ...perceive.settings import PerceptionSettings
from ...perceive.shutter_study import best_shutter, compare, perception_charts
from ...scene import builtin
from ...sequence.frame_file import is_video
from ...settings import OutputSettings
from ...settings.groups import changed
from .. import run_log
from ..console import Console, done_line
from ..exit_codes import DONE, SOME_FAILED
from ..help import MAIN
from ..options import Adapter, InputOptions, Inputs, LogJson, PerceivedOutputs, Quiet
from ..terminal import out

if TYPE_CHECKING:
    from ...perceive.video import PerceivedVideo

Who = Annotated[PerceptionSettings, Parameter(name="*", group=MAIN)]


def perceive(
    pattern: str | None = None,
    /,
    *,
    output: PerceivedOutputs,
    input: Inputs = InputOptions(),
    perception: Who = PerceptionSettings(),
    report: bool = False,
    speed: float | None = None,
    adapter: Adapter = None,
    log_json: LogJson = None,
    quiet: Quiet = False,
) -> int:
    """Simulate a viewer's perception: each frame is held, and earlier ones fade.

    A scene name instead of files simulates continuous time, at --nature images per second. The
    pictures of a video are held for their own times.

    Example: wgmb perceive 'blurred.####.exr' -o 'seen.####.exr' --fps 60

    Example: wgmb perceive clip.mp4 -o seen.mp4

    Example: wgmb perceive --report -o report.svg --fps 60 --speed 40

    Parameters
    ----------
    pattern
        Frames: shot.####.exr, shot.%04d.exr, or one file; a video; or a scene of `wgmb render`.
    report
        Plot the difference between perceived videos and perceived nature over speed, per shutter.
    speed
        With --report: recommend a shutter for the report's disk at this speed, rad/s.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    quiet
        Print errors only.
    """
    console = Console(quiet)
    if report:
        if log_json is not None:
            raise InputError("--log-json is for frames and videos; --report makes none")
        if pattern is not None:
            raise InputError(f"--report takes no input, got {pattern!r}")
        perception.check(of_scene=False)
        output.check()
        for name in changed(input):
            raise InputError(f"`{name}` is for files; --report takes none")
        return _report(output, perception, speed, console)
    run_log.begin(log_json, "perceive", output.output)
    if pattern is None:
        raise InputError("perceive needs frames, a video, a scene, or --report")
    if speed is not None:
        raise InputError("--speed needs --report")
    if output.resume:
        raise InputError(
            "--resume is not available for perceive: each frame depends on the previous ones"
        )
    if pattern not in builtin.SCENES and is_video(pattern):
        with needed_by(pattern, "video"):
            from ...perceive.video import perceive_video
        video = perceive_video(pattern, output, input, perception, adapter)
        return _write_video(video, pattern, console)
    run = perceive_frames(pattern, output, input, perception, adapter)
    files = run.output
    settings, count = json.loads(files.settings), len(run.frames.numbers)
    run_log.start([pattern], files.pattern, settings, count, run.made_of)
    started = time.perf_counter()
    with console.progress(len(run.frames.numbers), "perceiving") as tick:
        made = run(run_log.logged(tick, files.pattern))
    took = f"{time.perf_counter() - started:.1f} s"
    console.say(done_line(made, took, run.output.pattern))
    return DONE


def _write_video(video: PerceivedVideo, path: str, console: Console) -> int:
    """Write a perceived video, and say so."""
    console.say(*(f"{path}: {text}" for text in video.reader.notes))
    target = video.output.output
    run_log.start([path], target, video.settings, len(video.wanted), [path])
    with console.progress(len(video.wanted), "perceiving") as tick:
        report = video(run_log.logged_video(tick, target))
    console.say(*(f"{report.output}: {text}" for text in report.left_out))
    run_log.video(path, target, "done", report.seconds, report.loss)
    took = f"{report.seconds:.1f} s"
    console.say(f"{counted(report.frames, 'frame')} in {took} -> {report.output}")
    if report.loss:
        console.complain(report.loss)
        return SOME_FAILED
    return DONE


def _report(
    output: OutputSettings, perception: PerceptionSettings, speed: float | None, console: Console
) -> int:
    fps, path = float(output.rate), Path(output.output)
    if path.suffix.lower() != ".svg":
        raise InputError(f"output {path}: the name of a report must end in .svg")
    if path.exists() and not output.overwrite:
        raise InputError(f"{path} exists; --overwrite replaces it")
    best = best_shutter(speed, fps, perception.cone) if speed is not None else None
    speeds = np.linspace(fps / 12, fps * 5 / 3, 20)
    sharpness = compare(fps, speeds, perception.cone)
    write_file(path, charts.svg(*perception_charts(sharpness, speeds, fps)).encode())
    if not console.quiet:
        out("rad/s    " + "".join(f"{name:>11}" for name in sharpness))
        for i in range(3, len(speeds), 4):
            row = "".join(f"{values[i]:11.4f}" for values in sharpness.values())
            out(f"{speeds[i]:<9.1f}{row}")
    if best is not None and speed is not None:
        name, off = best
        degrees = VIDEOS[name].degrees
        out(
            f"at {speed:g} rad/s and {fps:g} frames per second the disk moves {speed / fps:.2f} of "
            f"its width per frame; the closest is --curve {name} --shutter {degrees:g} "
            f"(difference {off:.4f})"
        )
    return DONE
