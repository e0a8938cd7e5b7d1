"""`wgmb blur`: rendered frames and videos."""

from __future__ import annotations

import re
import time
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from ...errors import InputError
from ...extras import needed_by
from ...io.frame_numbers import frame_numbers
from ...io.pipes import is_pipe
from ...run.job import Job, settle
from ...run.job_file import read_job
from ...run.request import BlurRequest
from ...sequence.frame_file import is_video
from ...settings.color import ColorSettings, option_name
from ...settings.groups import SettingsGroups
from ..conclusion import conclude
from ..help import INPUT, RUN, VIDEO
from ..names import is_batch
from ..options import (
    Adapter,
    Colors,
    Confidence,
    ConfigFile,
    FrameBlurOptions,
    FrameBlurs,
    InputOptions,
    Inputs,
    Outputs,
    Quiet,
    ShutterOptions,
    Shutters,
    Verbose,
    VideoOptions,
    Videos,
)
from ..spelling import as_options
from ..terminal import check, muted, note, progress

NOT_WITH_JOB = (
    "--job holds all settings, and frames that are done are kept; only --frames, --workers, "
    "--cluster, --adapter, --verbose and --quiet can be combined with it"
)


def blur(
    patterns: Annotated[tuple[str, ...], Parameter(name="pattern")] = (),
    output: Outputs | None = None,
    blur: FrameBlurs = FrameBlurOptions(),
    shutter: Shutters = ShutterOptions(),
    input: Inputs = InputOptions(),
    color: Colors = ColorSettings(),
    video: Videos = VideoOptions(),
    *,
    job: Annotated[Path | None, Parameter(group=RUN)] = None,
    workers: Annotated[int | Literal["auto"] | None, Parameter(group=RUN)] = None,
    cluster: Annotated[str | None, Parameter(group=RUN)] = None,
    fps_in: Annotated[str | None, Parameter(group=INPUT)] = None,
    color_in: Annotated[
        Literal["bt601", "bt709", "bt2020-pq", "bt2020-hlg"] | None, Parameter(group=VIDEO)
    ] = None,
    trial: Annotated[int | None, Parameter(name="--try", group=VIDEO)] = None,
    confidence: Confidence = False,
    config: ConfigFile = None,
    adapter: Adapter = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> int:
    """Blur rendered frames or videos.

    Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --shutter 180 --frames 1-100

    Example: wgmb blur in.mp4 -o out.mp4 --shutter 180 --fps 60

    Example: wgmb blur a.mp4 b.mkv -o out/ --fps 60

    Example: wgmb blur in.mp4 -o try.mp4 --try 5

    Example: wgmb blur night.mp4 -o out.mp4 --highlights 8

    Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --fps-in 240 --fps 60

    Example: ffmpeg -i in.mp4 -f yuv4mpegpipe - | wgmb blur - -o - --fps 60 | ffmpeg -i - out.mp4

    Example: wgmb blur --job shot.json --frames 17-32

    Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --cluster tcp://farm:8786

    Parameters
    ----------
    patterns
        Frames: shot.####.exr, shot.%04d.exr, or one file. Or videos: files, folders, or patterns
        such as 'clips/*.mp4'; for several, the output is a folder, or a name with {name}.
    job
        Job file of `wgmb job`, which holds all settings; --frames selects a part of the frames.
    workers
        Number of processes on this machine that share the frames; auto: one for each GPU.
    cluster
        Scheduler of dask.distributed whose workers share the frames, such as tcp://farm:8786.
    fps_in
        Rate of the rendered frames, to convert them to --fps; of a pipe, if it states none or
        another.
    color_in
        Colours of a pipe, which does not state them; by default as players assume.
    trial
        Blur only so many places of a video, a second each, beside the original; into an image file,
        a frame of each.
    confidence
        Add confidence layers, confidence.* (EXR output, method gather); doubles the time.
    config
        TOML file with options in its table [blur], as saved by `wgmb view`.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Print the GPU, layers and settings in use.
    quiet
        Print errors only.
    """
    crew = _crew(workers, cluster)
    if job is not None:
        rest = replace(input, frames=None), blur, shutter, color, video
        is_changed = output or trial or any(group != type(group)() for group in rest)
        if patterns or confidence or fps_in or config or is_changed:
            raise InputError(NOT_WITH_JOB)
        return blur_job(job, input.frames, crew, adapter, verbose, quiet)
    if not patterns:
        raise InputError("no input: name frames such as 'shot.####.exr', or a video")
    if output is None:
        such = "out.mp4" if is_video(patterns[0]) else "'blurred.####.exr'"
        raise InputError(f"--output is missing, such as -o {such}")
    groups = SettingsGroups(blur=blur, shutter=shutter, input=input, color=color, video=video)
    pattern = patterns[0]
    if is_pipe(pattern) or is_pipe(output.output):
        with needed_by("a pipe", "video"):
            from ...run.video import VideoRequest
            from .blur_pipe import blur_pipe
        if len(patterns) > 1 or confidence or crew or trial is not None:
            raise InputError(
                "a pipe stands alone: one input, and no --confidence, --try or --workers"
            )
        return blur_pipe(pattern, output, VideoRequest.of(groups), adapter, quiet, fps_in, color_in)
    if color_in:
        raise InputError("--color-in is for pipes; files state their colours, or are assumed to")
    if is_batch(patterns, output.output) or is_video(pattern):
        with needed_by(pattern, "video"):
            from ...run.video import VideoRequest
            from .blur_video import blur_video
            from .blur_videos import blur_videos
        if confidence or fps_in or crew:
            option = "--fps-in" if fps_in else "--confidence"
            if crew and not (confidence or fps_in):
                option = "--workers" if workers else "--cluster"
            raise InputError(f"{option} is for rendered frames")
        _tell_unused(color, quiet)
        how = VideoRequest.of(groups), adapter, quiet, verbose
        if is_batch(patterns, output.output):
            if trial is not None:
                raise InputError("--try is for one video, and its output is a file")
            return blur_videos(patterns, output, *how)
        return blur_video(pattern, output, *how, trial)
    if trial is not None:
        raise InputError("--try is for videos; of frames, --frames selects some")
    request = BlurRequest.of(
        groups, pattern=pattern, output=output, confidence=confidence, fps_in=fps_in
    )
    made = settle(request, adapter)
    if crew and made.request.conversion:
        option = "--fps-in" if fps_in else "--flow none"
        raise InputError(f"{option} cannot be combined with --workers or --cluster")
    if crew:
        return blur_on_farm(made, *crew, adapter, verbose, quiet)
    return blur_frames(made, adapter, verbose, quiet)


def _tell_unused(color: ColorSettings, quiet: bool) -> None:
    """Say which colour options have no part in the blur of videos; InputError for a time."""
    plain = ColorSettings()
    if color.from_ and re.fullmatch(r"[\d:.]+", color.from_):
        raise InputError(
            f"--from is a colour space, got {color.from_}; a part of a video is --begin and --end"
        )
    used = [f.name for f in fields(plain) if getattr(color, f.name) != getattr(plain, f.name)]
    if used and not quiet:
        options = ", ".join(map(option_name, used))
        note(f"videos keep their own colours: {options} not used")


Crew = tuple[int | None, str | None]
"""Number of workers to start here, None for a suitable one; or the scheduler of other workers."""


def _crew(workers: int | Literal["auto"] | None, cluster: str | None) -> Crew | None:
    if workers is None and cluster is None:
        return None
    if workers is not None and cluster is not None:
        raise InputError("choose either --workers, on this machine, or --cluster")
    count = None if workers == "auto" else workers
    if count is not None and not 1 <= count <= 256:
        raise InputError(f"--workers must be 1 to 256 or auto, got {count}")
    return count, cluster


def blur_job(
    path: Path,
    frames: str | None,
    crew: Crew | None,
    adapter: str | None,
    verbose: bool,
    quiet: bool,
) -> int:
    """Blur some frames of a job file, or all; returns the exit code."""
    kept = read_job(path)
    numbers = kept.job.chosen(frame_numbers(frames) if frames else kept.job.numbers)
    kept.check(numbers, str(path))
    if crew:
        return blur_on_farm(replace(kept.job, numbers=numbers), *crew, adapter, verbose, quiet)
    return blur_frames(kept.job, adapter, verbose, quiet, numbers)


def blur_on_farm(
    job: Job,
    workers: int | None,
    cluster: str | None,
    adapter: str | None,
    verbose: bool,
    quiet: bool,
) -> int:
    """Blur frames of a job in several processes; returns the exit code."""
    from ...run.farm.farm import Farm, as_farm_job

    for text in () if quiet else job.remarks:
        note(as_options(text))

    def say(text: str) -> None:
        note(as_options(text))

    farm = Farm(cluster, workers, adapter, say, say if verbose else lambda text: None, check)
    job = as_farm_job(job)
    started = time.perf_counter()
    with progress(len(job.numbers), quiet) as tick, muted():
        report = farm.blur(job, tick)
    took = f"{time.perf_counter() - started:.1f} s with {job.request.blur.method}"
    return conclude(report, Path(job.request.output.output), took, quiet, verbose)


def blur_frames(
    job: Job, adapter: str | None, verbose: bool, quiet: bool, numbers: list[int] | None = None
) -> int:
    """Blur frames of a job in this process, by default all; returns the exit code."""
    for text in () if quiet else job.remarks:
        note(as_options(text))
    run = job.run(adapter, numbers)
    if verbose:
        note(f"adapter: {run.blur.device.adapter.summary}")
        note(f"settings: {run.output.settings}")
    started = time.perf_counter()
    with progress(len(run.numbers), quiet) as tick:
        report = run(tick)
    if len(run.clip.numbers) < len(job.numbers):
        report.unseen += report.absent  # other frames may have them
        report.lacking = []
    took = f"{time.perf_counter() - started:.1f} s with {run.blur.method.name}"
    return conclude(report, run.output.pattern, took, quiet, verbose)
