"""`wgmb vectors`: the motion of rendered frames in the form of another program."""

from __future__ import annotations

import json
import time
from typing import Annotated

from cyclopts import Parameter

from ...errors import InputError, counted
from ...io.data_files import FLO
from ...output.vectors import FORMS
from ...run.vectors import VectorsRequest
from .. import run_log
from ..console import Console
from ..names import frames_at
from ..options import Adapter, InputOptions, Inputs, LogJson, Quiet, Verbose


def vectors(
    pattern: str,
    /,
    input: Inputs = InputOptions(),
    *,
    output: Annotated[str, Parameter(alias="-o")],
    form: Annotated[
        str | None,
        Parameter(
            name="--as",
            help=f"Form of the vectors: {', '.join(FORMS)}; default: flo for .flo files.",
        ),
    ] = None,
    max_displace: float | None = None,
    overwrite: bool = False,
    resume: bool = False,
    adapter: Adapter = None,
    log_json: LogJson = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> int:
    """Write the motion of frames in the form of another program.

    Example: wgmb vectors 'shot.####.exr' -o 'mv.####.exr' --as rsmb

    Parameters
    ----------
    pattern
        Frames with vectors in any convention, or with depth and a --camera.
    output
        Pattern or file: .exr (32-bit floats); rsmb also .png or .tif of 16 bits; .flo.
    max_displace
        rsmb: motion in pixels that 0 and 1 encode; default: 2048.
    overwrite
        Replace existing files.
    resume
        Keep finished frames; write frames with changed settings or inputs again.
    adapter
        GPU to use: a number or part of a name from `wgmb devices`.
    verbose
        Print the vectors' convention and the settings in use.
    quiet
        Print errors only.
    """
    run_log.begin(log_json, "vectors", output)
    if form is None:
        if not output.lower().endswith(FLO):
            raise InputError(f"`form` is missing; the vectors can be {', '.join(FORMS)}")
        form = "flo"
    source = frames_at(pattern, input, output)
    request = VectorsRequest(
        pattern=source.pattern,
        output=output,
        form=form,
        input=source.input,
        max_displace=max_displace,
        overwrite=overwrite,
        resume=resume,
    )
    run = request.open(adapter)
    clip, files = run.clip, run.output
    console = Console(quiet, verbose)
    console.say(source.text, input.remark)
    console.detail(f"settings: {files.settings}")
    started = time.perf_counter()
    made_of, settings = clip.dependencies.every(), json.loads(files.settings)
    run_log.start([pattern], files.pattern, settings, len(clip.numbers), made_of)
    with console.progress(len(clip.numbers), "writing vectors") as tick:
        report = run(run_log.logged(tick, files.pattern))
    for number, count in sorted(files.clipped.items()):
        console.say(f"frame {number}: clipped {counted(count, 'pixel')} beyond --max-displace")
    if len(clip.chosen) > 1 and not files.takes_views:
        view = clip.chosen[0]
        console.say(
            f"only view {view} was written; %V in the output's name makes a file for each view"
        )
    return console.conclude(report, files.pattern, f"{time.perf_counter() - started:.1f} s")
