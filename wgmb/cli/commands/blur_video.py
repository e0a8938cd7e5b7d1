"""`wgmb blur` of videos: one or several, into videos or into frames.

One video has several lines of messages, and its error ends the command. Of several, which share a
progress bar, each has a line at its end, and one before it if something is lost or assumed; one
that fails is reported.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import GpuMemoryError, InputError, counted
from ...io import stills
from ...io.frame_numbers import is_pattern
from ...run.report import Progress, VideoReport
from ...run.trial.trial import Trial
from ...run.video import VideoPlan, VideoRequest, VideoRun
from ...settings import OutputSettings
from ...settings.video import VideoSettings
from ...video.holdouts import files_of
from ...video.write.encoders import SUFFIXES, chosen
from .. import run_log
from ..console import Console, alone_told, pictures_told, repeats_told, unfollowed_told
from ..exit_codes import DONE, SOME_FAILED
from ..names import is_batch, outputs_of, videos_of
from ..terminal import Tick, share_of

FIRST = 3  # frames from which the rest is estimated
LONG = 600.0  # seconds above which it is told


def spelled(seconds: float) -> str:
    """80 -> 1 min, 7500 -> 2 h 5 min."""
    hours, minutes = divmod(max(1, round(seconds / 60)), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


class Estimate:
    """A `progress` that passes on to `tell`, and says once if the frames left take long.

    Two frames are no measure: the first one, which also started all, and the slowest one after it,
    which may have compiled a shader. `total`: number of frames; `quicker`: settings that take less
    time; `say`: takes the line.
    """

    def __init__(
        self,
        tell: Callable[..., None],
        total: int,
        quicker: str,
        say: Callable[[str], None],
        clock: Callable[[], float] = time.perf_counter,
    ):
        self._tell, self._total, self._quicker = tell, total, quicker
        self._say, self._clock = say, clock
        self._count, self._done, self._last = 0, 0, 0.0
        self._took, self._slowest = 0.0, 0.0  # seconds of the frames after the first
        self._is_said = False

    def __call__(self, number: int, status: str) -> None:
        """One frame more; `status`: done, skipped or failed."""
        self._tell(number, status)
        self._count += 1
        if status != "done" or self._is_said:
            return
        self._done += 1
        now = self._clock()
        if self._done > 1:
            self._took += now - self._last
            self._slowest = max(self._slowest, now - self._last)
        self._last = now
        if self._done < FIRST:
            return
        # Later frames may take longer: those in which something is fast.
        each = (self._took - self._slowest) / (self._done - 2)
        left = self._total - self._count
        if left * each > LONG:
            self._is_said = True
            self._say(f"about {spelled(left * each)} for {left} more frames; {self._quicker}")


_FAILURES = InputError, GpuMemoryError, OSError, MemoryError
"""Errors of one video, after which others may be done."""


def blur_videos(
    patterns: Sequence[str],
    output: OutputSettings,
    request: VideoRequest,
    console: Console,
    adapter: str | None = None,
    trial: int | None = None,
) -> int:
    """Blur one video or several, or try the settings at some places of one; the exit code."""
    if not is_batch(patterns, output.output):
        run = request.open(adapter)
        plan = run.plan(patterns[0], output)
        tell_how(run, console)
        console.say(*(f"{patterns[0]}: {text}" for text in plan.notes))
        made_of = *patterns, *files_of(request.blur.holdout)
        run_log.start(patterns, output.output, run.settings, len(plan.wanted), made_of)
        if trial is not None:
            return _try_out(run, plan, trial, console)
        return _blur_alone(run, plan, console)
    if trial is not None:
        raise InputError("--try is for one video, and its output is a file")
    paths = videos_of(patterns)
    outputs = [replace(output, output=name) for name in outputs_of(paths, output.output)]
    for one in outputs:
        _check_output(one, request.video)
    run = request.open(adapter)
    tell_how(run, console)
    made_of = *paths, *files_of(request.blur.holdout)
    run_log.start(paths, output.output, run.settings, None, made_of)
    return _blur_each(run, paths, outputs, console)


def tell_how(run: VideoRun, console: Console) -> None:
    """Say where motion comes from, and, if asked, the settings."""
    console.detail(f"adapter: {run.blur.device.adapter.summary}")
    console.detail(f"settings: {json.dumps(run.settings, sort_keys=True)}")
    console.say(f"motion: {run.how}", run.advice)


# ---- one video -------------------------------------------------------------------------------


def _blur_alone(run: VideoRun, plan: VideoPlan, console: Console) -> int:
    """Blur a video, with lines about its peculiarities; the exit code."""
    losses = plan.losses
    console.say(*(f"{plan.name}: {text}" for text in losses))
    with console.progress(len(plan.wanted)) as tick:
        told = _estimated(tick, len(plan.wanted), run, console)
        report = run(plan, run_log.logged_video(told, plan.name))
    _log_end(report)
    console.say(*(f"{plan.name}: {text}" for text in report.left_out if text not in losses))
    if report.is_new:
        console.say(*pictures_told(report, run.request.video.duplicates == "fill"))
        took = f"{report.seconds:.1f} s" + (f" with {report.method}" if report.method else "")
        console.say(f"{counted(report.frames, 'frame')} in {took} -> {report.output}")
    if report.loss:
        console.complain(report.loss)
        return SOME_FAILED
    return DONE


def _estimated(tick: Tick, frames: int, run: VideoRun, console: Console) -> Progress:
    """A progress with the estimated duration of a long run, and quicker settings."""
    words = f"{run.quicker}, and --try 5 shows some places first"
    return Estimate(tick, frames, words, console.say)


def _try_out(run: VideoRun, plan: VideoPlan, places: int, console: Console) -> int:
    """Blur some places of a video, beside the original; the exit code."""
    trial, begun = Trial(run, plan, places), time.perf_counter()
    with console.progress(trial.total) as tick:
        trial(tick)
    took = f"{time.perf_counter() - begun:.1f} s"
    console.say(f"the original and the result side by side in {took} -> {plan.name}")
    return DONE


# ---- several videos --------------------------------------------------------------------------


def _blur_each(
    run: VideoRun, paths: Sequence[Path], outputs: Sequence[OutputSettings], console: Console
) -> int:
    """Blur videos one after the other; the exit code."""
    plans: list[VideoPlan | str] = []
    for path, output in zip(paths, outputs, strict=True):
        try:
            plans.append(run.plan(path, output))
        except _FAILURES as error:
            plans.append(_reason(error, path))
    names = [output.output for output in outputs]
    total = sum(len(plan.wanted) for plan in plans if isinstance(plan, VideoPlan))
    failed = 0
    with console.progress(total) as tick:
        for path, name, plan in zip(paths, names, plans, strict=True):
            if isinstance(plan, str):
                run_log.video(path, name, "failed", 0, plan)
                console.complain(plan)
                failed += 1
            else:
                failed += not _one_of_many(run, plan, tick, console)
    console.say(f"{len(plans) - failed} of {counted(len(plans), 'video')} done")
    return SOME_FAILED if failed else DONE


def _one_of_many(run: VideoRun, plan: VideoPlan, tick: Tick, console: Console) -> bool:
    """Blur a video and say so in a line; returns whether all of it is done.

    Its losses and the assumptions about it are a line before the first picture.
    """
    path = plan.reader.path
    known = [*plan.notes, *plan.losses]
    if known:
        console.say(f"{path}: {'; '.join(known)}")
    try:
        with share_of(tick, len(plan.wanted), f"{path.name}, frame") as tick_share:
            report = run(plan, run_log.logged_video(tick_share, plan.name))
    except _FAILURES as error:
        why = _reason(error, path)
        run_log.video(path, plan.name, "failed", 0, why)
        console.complain(why)
        return False
    _log_end(report)
    took = f"{counted(report.frames, 'frame')} in {report.seconds:.1f} s"
    words = [took if report.is_new else "", *report.left_out, *_remarks(report, run)]
    words = [text for text in words if text not in known]
    console.say(f"{path}: {'; '.join(filter(None, words))} -> {report.output}")
    if report.loss:
        console.complain(report.loss)
        return False
    return True


def _log_end(report: VideoReport) -> None:
    """Log a video that exists, with its losses."""
    status = "done" if report.is_new else "skipped"
    run_log.video(
        report.path, report.output, status, report.seconds, report.loss, report.unfollowed
    )


def _remarks(report: VideoReport, run: VideoRun) -> list[str]:
    """Lines on the peculiarities of a video; some are empty."""
    fills = report.is_new and run.request.video.duplicates == "fill"
    repeats, alone = repeats_told(report.repeated) if fills else "", alone_told(report.alone)
    return [alone, unfollowed_told(report.unfollowed), repeats, report.held_out, report.scaling]


def _reason(error: BaseException, path: Path) -> str:
    """The error in one line that names the video."""
    text = getattr(error, "strerror", None) or str(error) or "not enough memory"
    return text if str(path) in text else f"{path}: {text}"


def _check_output(output: OutputSettings, video: VideoSettings) -> None:
    """InputError for a video that cannot be written, or is there and is not to be replaced."""
    path = Path(output.output)
    suffix = path.suffix.lower()
    if suffix in (".exr", *stills.SUFFIXES) and is_pattern(path):
        return  # how many frames there are depends on the video
    if suffix not in SUFFIXES:
        raise InputError(
            f"output {path}: must be a video {' '.join(SUFFIXES)}, a frame pattern, or a folder, "
            "whose name ends in /"
        )
    chosen(path, video.codec, video.quality, video.encoder)
    if os.path.exists(os.path.realpath(path)) and not (output.overwrite or output.resume):
        raise InputError(f"{path} exists; --overwrite replaces it, --resume keeps finished videos")
