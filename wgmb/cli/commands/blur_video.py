"""`wgmb blur` of a video: into a video, or into frames."""

from __future__ import annotations

import json

from ...errors import counted
from ...run.video import VideoRequest, VideoRun
from ...settings import OutputSettings
from ..conclusion import cuts_told
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
) -> int:
    """Blur a video; returns the exit code."""
    run = request.open(adapter)
    plan = run.plan(path, output)
    tell_how(run, quiet, verbose)
    for text in () if quiet else plan.notes:
        note(as_options(f"{path}: {text}"))
    with progress(len(plan.wanted), quiet) as tell:
        report = run(plan, tell)
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
        if report.repeated:
            note(f"{report.repeated} repeated pictures left out")
        if report.held_out:
            note(as_options(report.held_out))
        if report.scaling:
            note(report.scaling)
        note(f"{counted(report.frames, 'frame')} in {took} -> {report.output}")
    if report.loss:
        note(f"wgmb: {report.loss}")
        return SOME_FAILED
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
