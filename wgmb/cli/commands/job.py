"""`wgmb job`: a run that other processes, on other machines, do in parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...errors import InputError, counted
from ...io.atomic import mode_of, write_file
from ...io.frame_numbers import frame_list
from ...run.job import settle
from ...run.job_file import is_job, stored, time_there
from ...run.request import BlurRequest
from ...sequence.frame_file import is_video
from ...settings.color import ColorSettings
from .. import submit
from ..console import Console
from ..exit_codes import DONE
from ..names import frames_at
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
    VideoOptions,
    Videos,
)
from ..submit import is_ours


def job(
    pattern: str,
    output: Outputs,
    blur: FrameBlurs = FrameBlurOptions(),
    shutter: Shutters = ShutterOptions(),
    input: Inputs = InputOptions(),
    color: Colors = ColorSettings(),
    video: Videos = VideoOptions(),
    *,
    file: Annotated[Path, Parameter(name="--job", alias="-j")],
    chunk: int = 16,
    openjd: Path | None = None,
    slurm: Path | None = None,
    fps_in: Annotated[str | None, Parameter(show=False)] = None,
    confidence: Confidence = False,
    config: ConfigFile = None,
    adapter: Adapter = None,
    quiet: Quiet = False,
) -> int:
    """Write a job file, from which any machine can blur any part of a sequence.

    Example: wgmb job 'shot.####.exr' -o 'blurred.####.exr' --method gather -j shot.json

    Example: wgmb job 'shot.####.exr' -o 'blurred.####.exr' -j shot.json --openjd shot.yaml

    The machines then run: wgmb blur --job shot.json --frames 17-32

    Parameters
    ----------
    pattern
        Frames to blur, as for `wgmb blur`.
    file
        The job file to write, .json; an older job file is replaced.
    chunk
        Number of frames in a part.
    openjd
        Also write an OpenJD template, .yaml, into the folder of the job file or one above it.
    slurm
        Also write a script for sbatch, .sh.
    confidence
        Add confidence layers, confidence.* (EXR output, method gather); doubles the time.
    config
        TOML file with options in its table [blur], as saved by `wgmb view`.
    adapter
        GPU for the choice of --flow auto, if the frames hold no motion.
    quiet
        Print errors only.
    """
    if is_video(pattern):
        raise InputError(f"{pattern}: a video is read by one process; `wgmb blur` blurs it")
    if fps_in is not None:
        raise InputError(
            "job files do not support `fps_in`; use `wgmb blur` for frames of another rate"
        )
    if chunk < 1:
        raise InputError(f"--chunk must be 1 frame or more, got {chunk}")
    _check_target("--job", file, (".json",), is_job)
    _check_target("--openjd", openjd, (".yaml", ".yml"), is_ours)
    _check_target("--slurm", slurm, (".sh",), is_ours)
    source = frames_at(pattern, input, output.output)
    request = BlurRequest(
        pattern=source.pattern,
        output=output,
        blur=blur,
        shutter=shutter,
        input=source.input,
        color=color,
        video=video,
        confidence=confidence,
    )
    made = settle(request, adapter)
    if made.request.averages:
        raise InputError("job files do not support `flow` none; use `wgmb blur` for averages")
    kept = stored(made, chunk)
    texts = {file: ""}
    if openjd is not None:
        texts[openjd] = submit.openjd(openjd, file, made.numbers, chunk)
    if slurm is not None:
        texts[slurm] = submit.slurm(slurm, file, made.numbers, chunk)
    made.make_output()
    if output.overwrite and not output.resume:
        since = time_there(Path(output.output).parent)
        kept = replace(kept, job=replace(kept.job, since=since))
    texts[file] = kept.text()
    for path, text in texts.items():
        mode = mode_of(path.parent, made.clip.dependencies.every())
        write_file(path, text.encode(), mode=mode)
    console, finding = Console(quiet), made.findings.finding
    console.say(source.text, *made.remarks, f"vectors: {finding.text}" if finding.notable else "")
    frames = f"{counted(len(made.numbers), 'frame')} ({frame_list(made.numbers)})"
    console.say(f"{file}: {frames} with {made.request.blur.method}, not blurred yet")
    return DONE


def _check_target(
    option: str, path: Path | None, suffixes: tuple[str, ...], is_own: Callable[[Path], bool]
) -> None:
    """InputError unless a file that is written beside the frames may be written here."""
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        raise InputError(f"{option} {path}: the name must end in {suffixes[0]}")
    if path.exists() and not (path.is_file() and is_own(path)):
        raise InputError(f"{path} exists and was not written by wgmb job; choose another name")
