"""`wgmb blur` of a video: into a video, or into frames."""

from __future__ import annotations

import json
import time
from collections.abc import Callable

from ...errors import counted
from ...run.trial.trial import Trial
from ...run.video import VideoPlan, VideoRequest, VideoRun
from ...settings import OutputSettings
from ..conclusion import cuts_told, repeats_told
from ..estimate import Estimate
from ..exit_codes import DONE, SOME_FAILED
from ..spelling import as_options
from ..terminal import note, progress


def blur_video(
    path: str,
    output: OutputSettings,
    request: VideoRequest,
    adapter: str | None,
    quiet: bool,
    verbose: bool,
    trial: int | None = None,
) -> int:
    """Blur a video, or try its settings at some places; returns the exit code."""
    run = request.open(adapter)
    plan = run.plan(path, output)
    tell_how(run, quiet, verbose)
    for text in () if quiet else plan.notes:
        note(as_options(f"{path}: {text}"))
    if trial is not None:
        return _try_out(run, plan, trial, quiet)
    with progress(len(plan.wanted), quiet) as tell:
        report = run(plan, tell if quiet else estimated(tell, len(plan.wanted), run))
    for text in () if quiet else report.left_out:
        note(f"{plan.name}: {text}")
    if not quiet and report.is_new:
        took = f"{report.seconds:.1f} s"
        if report.method:
            took += f" with {report.method}"
        if report.cuts:
            note(cuts_told(report.cuts, "picture"))
        if report.flashes:
            note(f"flash at picture {', '.join(map(str, report.flashes))}")
        if run.request.video.duplicates == "fill":
            note(repeats_told(report.repeated))
        if report.held_out:
            note(as_options(report.held_out))
        if report.scaling:
            note(report.scaling)
        note(f"{counted(report.frames, 'frame')} in {took} -> {report.output}")
    if report.loss:
        note(f"wgmb: {report.loss}")
        return SOME_FAILED
    return DONE


def estimated(tell: Callable[..., None], frames: int, run: VideoRun) -> Callable[..., None]:
    """A progress that also says how long a long run takes, and what is quicker."""
    words = f"{run.quicker}, and --try 5 shows some places first"
    return Estimate(tell, frames, as_options(words), note)


def _try_out(run: VideoRun, plan: VideoPlan, places: int, quiet: bool) -> int:
    """Blur some places of a video, beside the original; returns the exit code."""
    trial, begun = Trial(run, plan, places), time.perf_counter()
    with progress(trial.total, quiet) as tell:
        trial(tell)
    if not quiet:
        took = f"{time.perf_counter() - begun:.1f} s"
        note(f"the original and the result side by side in {took} -> {plan.name}")
    return DONE


def tell_how(run: VideoRun, quiet: bool, verbose: bool) -> None:
    """Say where motion comes from, and, if asked, the settings."""
    if verbose:
        note(f"adapter: {run.blur.device.adapter.summary}")
        note(f"settings: {json.dumps(run.settings, sort_keys=True)}")
    if not quiet:
        note(f"motion: {run.how}")
        if run.advice:
            note(run.advice)
