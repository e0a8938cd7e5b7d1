"""`wgmb job`: a run that other processes, on other machines, do in parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..color_settings import ColorSettings
from ..errors import InputError
from ..io.atomic import write_file
from ..io.frame_file import is_video
from ..io.frame_numbers import frame_list
from ..job import Asked, settle
from ..job_file import is_job, stored, time_there
from ..video_settings import VideoSettings
from .exit_codes import DONE
from .options import (
    BlurOptions,
    Colors,
    Given,
    InputOptions,
    Look,
    ShutterOptions,
    Target,
    Videos,
    When,
)
from .spelling import as_options
from .terminal import note


def job(
    pattern: str,
    output: Target,
    look: Look = BlurOptions(),
    when: When = ShutterOptions(),
    given: Given = InputOptions(),
    color: Colors = ColorSettings(),
    video: Videos = VideoSettings(),
    *,
    file: Annotated[Path, Parameter(name="--job", alias="-j")],
    chunk: int = 16,
    confidence: bool = False,
    config: Path | None = None,
    adapter: str | None = None,
    quiet: Annotated[bool, Parameter(alias="-q")] = False,
) -> int:
    """Write a job file, from which any machine can blur any part of a sequence.

    Example: wgmb job 'shot.####.exr' -o 'blurred.####.exr' --method gather -j shot.json

    The machines then run: wgmb blur --job shot.json --frames 17-32

    Parameters
    ----------
    pattern
        Frames to blur, as for `wgmb blur`.
    file
        The job file to write, .json; another job is replaced.
    chunk
        Frames that one machine does at a time.
    confidence
        Add confidence layers, confidence.* (EXR output, method gather); doubles the time.
    config
        TOML file with options in its table [blur], as saved by `wgmb view`.
    adapter
        GPU by which --flow auto chooses, if the frames hold no motion.
    quiet
        Print errors only.
    """
    if is_video(pattern):
        raise InputError(f"{pattern}: a video is read by one process; `wgmb blur` blurs it")
    if chunk < 1:
        raise InputError(f"--chunk must be 1 frame or more, got {chunk}")
    _check_target(file, ".json")
    asked = Asked(
        pattern=pattern,
        output=output,
        look=look,
        when=when,
        given=given,
        color=color,
        video=video,
        confidence=confidence,
    )
    made = settle(asked, adapter)
    kept = stored(made, chunk)
    made.make_output()
    if output.overwrite and not output.resume:
        since = time_there(Path(output.output).parent)
        kept = replace(kept, job=replace(kept.job, since=since))
    write_file(file, kept.text().encode())
    for text in () if quiet else made.remarks:
        note(as_options(text))
    if not quiet:
        if made.clip.is_finding_notable:
            note(f"vectors: {made.clip.finding}")
        frames = f"{len(made.numbers)} frames {frame_list(made.numbers)}"
        note(f"{file}: {frames} with {made.asked.look.method}, not blurred yet")
    return DONE


def _check_target(path: Path, suffix: str) -> None:
    """InputError unless a job may be written here."""
    if path.suffix.lower() != suffix:
        raise InputError(f"--job {path}: the name must end in {suffix}")
    if path.exists() and not (path.is_file() and is_job(path)):
        raise InputError(f"{path} exists and is no job of wgmb; choose another name")
