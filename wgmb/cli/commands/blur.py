"""`wgmb blur`: rendered frames and videos."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from ...errors import InputError
from ...extras import needed_by
from ...io.pipes import is_pipe
from ...run.job import settle
from ...run.request import BlurRequest
from ...sequence.frame_file import is_video
from ...settings.color import ColorSettings
from ...settings.groups import SettingsGroups
from .. import run_log
from ..console import Console
from ..help import INPUT, RUN, VIDEO
from ..names import frames_at, holds_videos, is_batch, is_folder, is_frames_output
from ..options import (
    Adapter,
    Colors,
    Confidence,
    ConfigFile,
    FrameBlurOptions,
    FrameBlurs,
    InputOptions,
    Inputs,
    LogJson,
    OutputOptions,
    Outputs,
    Quiet,
    ShutterOptions,
    Shutters,
    Verbose,
    VideoOptions,
    Videos,
)
from .blur_frames import Crew, blur_frames, blur_job, blur_on_farm

NOT_WITH_JOB = (
    "--job holds all settings, and frames that are done are kept; only --frames, --workers, "
    "--cluster, --adapter, --log-json, --verbose and --quiet can be combined with it"
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
    log_json: LogJson = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> int:
    """Blur rendered frames or videos.

    Example: wgmb blur 'shot.####.exr' -o 'blurred.####.exr' --shutter 180 --frames 1-100

    Example: wgmb blur in.mp4 -o out.mp4 --shutter 180 --fps 60

    Example: wgmb blur renders/ -o blurred/ --program vray

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
        Frames: shot.####.exr, shot.%04d.exr, one file, or a folder, in which picture, vectors and
        depth are found by their names. Or videos: files, folders, or patterns
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
    run_log.begin(log_json, "blur", output.output if output else "")
    groups = SettingsGroups(blur=blur, shutter=shutter, input=input, color=color, video=video)
    call = BlurCall(
        patterns,
        output,
        groups,
        Console(quiet, verbose),
        adapter,
        job,
        crew=_crew(workers, cluster),
        fps_in=fps_in,
        color_in=color_in,
        trial=trial,
        confidence=confidence,
        config=config,
    )
    road = next(road for road in ROADS if road.is_meant(call))
    for option, why in road.refuses.items():
        if option in call.options_used:
            raise InputError(why)
    return road.take(call)


def _crew(workers: int | Literal["auto"] | None, cluster: str | None) -> Crew | None:
    """The processes that share the frames; None for this one alone."""
    if workers is None and cluster is None:
        return None
    if workers is not None and cluster is not None:
        raise InputError("choose either --workers, on this machine, or --cluster")
    count = None if workers == "auto" else workers
    if count is not None and not 1 <= count <= 256:
        raise InputError(f"--workers must be 1 to 256 or auto, got {count}")
    return Crew(count, cluster)


@dataclass(frozen=True)
class BlurCall:
    """`wgmb blur` as it was called; the last six are options that only some roads take."""

    patterns: tuple[str, ...]
    output: OutputOptions | None
    groups: SettingsGroups
    console: Console
    adapter: str | None
    job: Path | None
    crew: Crew | None
    fps_in: str | None
    color_in: str | None
    trial: int | None
    confidence: bool
    config: Path | None

    @property
    def options_used(self) -> set[str]:
        """Names of the options in use that a road may refuse."""
        is_used = {
            "pattern": bool(self.patterns),
            "--output": self.output is not None,
            "--workers": self.crew is not None and self.crew.cluster is None,
            "--cluster": self.crew is not None and self.crew.cluster is not None,
            "--fps-in": bool(self.fps_in),
            "--color-in": bool(self.color_in),
            "--try": self.trial is not None,
            "--confidence": self.confidence,
            "--config": self.config is not None,
        }
        return {name for name, used in is_used.items() if used}

    @property
    def files(self) -> tuple[str, OutputOptions]:
        """The first input and the output; InputError where one is missing."""
        if not self.patterns:
            raise InputError("no input: name frames such as 'shot.####.exr', or a video")
        if self.output is None:
            such = "out.mp4" if is_video(self.patterns[0]) else "'blurred.####.exr'"
            raise InputError(f"--output is missing, such as -o {such}")
        return self.patterns[0], self.output


def _is_folder_of_frames(call: BlurCall) -> bool:
    pattern, output = call.files
    if len(call.patterns) > 1 or not Path(pattern).is_dir():
        return False
    return is_frames_output(output.output) or not holds_videos(pattern)


def _take_folder(call: BlurCall) -> int:
    """Rendered frames, of which the folder alone was named."""
    pattern, output = call.files
    found = frames_at(pattern, call.groups.input, output.output)
    call.console.say(found.text)
    name = Path(found.pattern).name
    if is_folder(output.output):
        output = replace(output, output=str(Path(output.output) / name))
    groups = replace(call.groups, input=found.input)
    return _take_frames(replace(call, patterns=(found.pattern,), output=output, groups=groups))


def _is_piped(call: BlurCall) -> bool:
    pattern, output = call.files
    return is_pipe(pattern) or is_pipe(output.output)


def _is_of_videos(call: BlurCall) -> bool:
    pattern, output = call.files
    return is_batch(call.patterns, output.output) or is_video(pattern)


def _take_job(call: BlurCall) -> int:
    """A part of a job file, or all of it."""
    groups = [getattr(call.groups, one.name) for one in fields(call.groups)]
    frames = call.groups.input.frames
    plain = [replace(one, frames=None) if one is call.groups.input else one for one in groups]
    if any(group != type(group)() for group in plain) or call.job is None:
        raise InputError(NOT_WITH_JOB)
    return blur_job(call.job, frames, call.console, call.adapter, call.crew)


def _take_pipe(call: BlurCall) -> int:
    """Pictures from a pipe, or into one."""
    pattern, output = call.files
    if len(call.patterns) > 1:
        raise InputError(_ALONE)
    with needed_by("a pipe", "video"):
        from ...run.pipe import StreamHints
        from ...run.video import VideoRequest
        from .blur_pipe import blur_pipe
    call.console.say(call.groups.color.unused_by_videos())
    request = VideoRequest.of(call.groups)
    hints = StreamHints(call.fps_in, call.color_in)
    return blur_pipe(pattern, output, request, call.console, hints, call.adapter)


def _take_videos(call: BlurCall) -> int:
    """One video, or several."""
    pattern, output = call.files
    with needed_by(pattern, "video"):
        from ...run.video import VideoRequest
        from .blur_video import blur_videos
    call.console.say(call.groups.color.unused_by_videos())
    request = VideoRequest.of(call.groups)
    return blur_videos(call.patterns, output, request, call.console, call.adapter, call.trial)


def _take_frames(call: BlurCall) -> int:
    """Rendered frames, in this process or in several."""
    pattern, output = call.files
    request = BlurRequest.of(
        call.groups, pattern=pattern, output=output, confidence=call.confidence, fps_in=call.fps_in
    )
    job = settle(request, call.adapter)
    if call.crew is None:
        return blur_frames(job, call.console, call.adapter)
    if job.request.conversion:
        option = "--fps-in" if call.fps_in else "--flow none"
        raise InputError(f"{option} cannot be combined with --workers or --cluster")
    return blur_on_farm(job, call.crew, call.console, call.adapter)


_ALONE = "a pipe must be the only input, without --confidence, --try, --workers or --cluster"
_FOR_PIPES = "--color-in is for pipes; the colours of files are read from the files"
_TRIED = "--try is for videos; --frames selects some of the rendered frames"


@dataclass(frozen=True)
class Road:
    """One way from input to output: calls that mean it, options that it refuses, with the error."""

    is_meant: Callable[[BlurCall], bool]
    take: Callable[[BlurCall], int]
    refuses: Mapping[str, str]


ROADS = (
    Road(
        lambda call: call.job is not None,
        _take_job,
        dict.fromkeys(
            ("pattern", "--output", "--fps-in", "--color-in", "--try", "--confidence", "--config"),
            NOT_WITH_JOB,
        ),
    ),
    Road(
        _is_piped,
        _take_pipe,
        dict.fromkeys(("--confidence", "--try", "--workers", "--cluster"), _ALONE),
    ),
    Road(
        _is_folder_of_frames,
        _take_folder,
        {"--color-in": _FOR_PIPES, "--try": _TRIED},
    ),
    Road(
        _is_of_videos,
        _take_videos,
        {"--color-in": _FOR_PIPES}
        | {
            option: f"{option} is for rendered frames"
            for option in ("--fps-in", "--confidence", "--workers", "--cluster")
        },
    ),
    Road(lambda call: True, _take_frames, {"--color-in": _FOR_PIPES, "--try": _TRIED}),
)
"""The roads, of which the first that a call means is taken."""
