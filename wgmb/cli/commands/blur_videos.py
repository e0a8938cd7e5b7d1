"""`wgmb blur` of several videos: one bar for all, one line for each."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import GpuMemoryError, InputError
from ...io import stills
from ...io.frame_numbers import is_pattern
from ...settings import (
    BlurSettings,
    InputSettings,
    OutputSettings,
    ShutterSettings,
)
from ...settings.video import VideoSettings
from ...video.write.encoders import SUFFIXES, chosen
from ..exit_codes import DONE, SOME_FAILED
from ..names import outputs_of, videos_of
from ..terminal import complain, note, progress
from .blur_video import (
    Plan,
    Tell,
    Wish,
    blurred,
    make_wish,
    planned,
    tell_how,
)

_FAILURES = InputError, GpuMemoryError, OSError, MemoryError
"""Errors of one video, after which others may be done."""


def blur_videos(
    patterns: Sequence[str],
    output: OutputSettings,
    look: BlurSettings,
    when: ShutterSettings,
    given: InputSettings,
    video: VideoSettings,
    adapter: str | None,
    quiet: bool,
    verbose: bool,
) -> int:
    """Blur several videos, one after the other; returns the exit code.

    A video that fails is reported, and the others are done.
    """
    paths = videos_of(patterns)
    outputs = [replace(output, output=name) for name in outputs_of(paths, output.output)]
    for one in outputs:
        _check_output(one, video)
    wish = make_wish(look, when, given, video, adapter)
    tell_how(wish, quiet, verbose)
    plans: list[Plan | str] = []
    for path, one in zip(paths, outputs, strict=True):
        try:
            plans.append(planned(path, one, wish))
        except _FAILURES as error:
            plans.append(_reason(error, path))
    total = sum(len(plan.wanted) for plan in plans if isinstance(plan, Plan))
    failed = 0
    with progress(total, quiet) as tell:
        for plan in plans:
            if isinstance(plan, str):
                complain(plan)
                failed += 1
            else:
                failed += not _one_of_many(plan, wish, tell, quiet)
    if not quiet:
        note(f"{len(plans) - failed} of {len(plans)} videos done")
    return SOME_FAILED if failed else DONE


def _one_of_many(plan: Plan, wish: Wish, tell: Tell, quiet: bool) -> bool:
    """Blur a video and say so in a line; returns whether all of it is done."""
    path, started, told = plan.footage.path, time.perf_counter(), [0]

    def tell_name(number: int, what: str) -> None:
        told[0] += 1
        tell(number, what, f"{path.name}, frame")

    try:
        run, left_out = blurred(plan, wish, tell_name)
    except _FAILURES as error:
        complain(_reason(error, path))
        return False
    finally:
        for moment in plan.wanted[told[0] :]:
            tell_name(moment.number, "skipped")
    if not quiet:
        took = f"{len(plan.wanted)} frames in {time.perf_counter() - started:.1f} s"
        words = [took if run.reel is not None else "", *left_out, *plan.notes]
        if run.reel is not None and run.reel.doubles:
            words.append(f"{len(run.reel.doubles)} repeated pictures left out")
        words.append(plan.footage.scaling())
        note(f"{path}: {'; '.join(filter(None, words))} -> {plan.name}")
    if loss := plan.footage.loss():
        complain(loss)
        return False
    return True


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
        raise InputError(f"output {path}: must be a video {' '.join(SUFFIXES)}, or a frame pattern")
    chosen(path, video.codec, video.quality, video.encoder)
    if os.path.exists(os.path.realpath(path)) and not (output.overwrite or output.resume):
        raise InputError(f"{path} exists; --overwrite replaces it, --resume keeps finished videos")
