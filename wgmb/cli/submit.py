"""A job as other programs take it that give work to machines: OpenJD (Deadline Cloud), SLURM.

Each of them runs the same command, `wgmb blur` with the job file and some frames.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ..sequence.findings import Range, ranges

MARK = "# Written by wgmb job"
_MOST_IN_PARAMETER = 1024  # characters of an OpenJD parameter's value
MOST_TASKS = 1000
"""Tasks of one SLURM array, unless its administrator allows more (MaxArraySize)."""


def openjd(template: Path, job_file: Path, numbers: Sequence[int], chunk: int) -> str:
    """An OpenJD template whose tasks are parts of the job, about `chunk` frames each.

    `template`: where it will lie; a path that is a default must lead down from there.
    """
    try:
        path = job_file.resolve().relative_to(template.parent.resolve())
    except ValueError:
        raise InputError(
            f"{template} must lie in the folder of {job_file}, or above it, because "
            "OpenJD looks for files from there"
        ) from None
    spans = ranges(sorted(numbers))
    frames = openjd_ranges(spans)
    if len(frames) > _MOST_IN_PARAMETER:
        raise InputError(
            f"frames {frames[:60]}... take {len(frames)} characters, an OpenJD template takes "
            f"{_MOST_IN_PARAMETER}; write jobs of fewer `frames` each"
        )
    gapless = len(spans) == 1 and abs(spans[0][2]) == 1
    kind = "CONTIGUOUS" if gapless else "NONCONTIGUOUS"
    name = "".join(c if c.isprintable() and c not in "{}" else "_" for c in job_file.stem)
    return f"""{MARK}. Names of files are in the job file.
specificationVersion: jobtemplate-2023-09
extensions: [TASK_CHUNKING]
name: {_scalar(f"wgmb blur {name}"[:128])}
description: Motion blur of a frame sequence with wgmb.
parameterDefinitions:
  - name: JobFile
    type: PATH
    objectType: FILE
    dataFlow: IN
    description: The job file of wgmb job.
    default: {_scalar(path.as_posix())}
  - name: Frames
    type: STRING
    description: Frames of the job, such as 1-100 or 1-99:2.
    default: {_scalar(frames)}
  - name: FramesPerTask
    type: INT
    minValue: 1
    default: {chunk}
  - name: Wgmb
    type: STRING
    description: The program wgmb on the machines.
    default: wgmb
steps:
  - name: Blur
    parameterSpace:
      taskParameterDefinitions:
        - name: Frame
          type: CHUNK[INT]
          range: "{{{{Param.Frames}}}}"
          chunks:
            defaultTaskCount: "{{{{Param.FramesPerTask}}}}"
            rangeConstraint: {kind}
    hostRequirements:
      amounts:
        - name: amount.worker.gpu
          min: 1
    script:
      actions:
        onRun:
          command: "{{{{Param.Wgmb}}}}"
          args:
            - blur
            - --job
            - "{{{{Param.JobFile}}}}"
            - "--frames={{{{Task.Param.Frame}}}}"
"""


def openjd_ranges(ranges: Sequence[Range]) -> str:
    """Ranges as OpenJD has them: 1-100, 1-99:2, or a number."""
    return ",".join(
        f"{first}" if first == last else f"{first}-{last}" + (f":{step}" if step != 1 else "")
        for first, last, step in ranges
    )


def slurm(script: Path, job_file: Path, numbers: Sequence[int], chunk: int) -> str:
    """A script for `sbatch`: an array of tasks, each of which does a part of the job.

    InputError for a name with a line break or another control character, which a script reads.
    Of very many frames the parts are larger than `chunk`, so that there are at most MOST_TASKS.
    """
    if not script.name.isprintable():
        raise InputError(f"SLURM script {script.name!r}: its name has control characters")
    chunk = max(chunk, -(-len(numbers) // MOST_TASKS))
    parts = [numbers[i : i + chunk] for i in range(0, len(numbers), chunk)]
    texts = [",".join(map(_of_wgmb, ranges(part))) for part in parts]
    lines = "\n".join(f"    {text}" for text in texts)
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in job_file.stem)
    return f"""#!/bin/bash
{MARK}. Start it with: sbatch {shlex.quote(script.name)}
#SBATCH --job-name=wgmb_{name}
#SBATCH --array=0-{len(parts) - 1}
#SBATCH --ntasks=1
#SBATCH --gpus-per-task=1
parts=(
{lines}
)
part=${{parts[${{SLURM_ARRAY_TASK_ID:?}}]}}
exec wgmb blur --job {shlex.quote(str(job_file.resolve()))} "--frames=$part"
"""


def is_ours(path: Path) -> bool:
    """Return True if a file was written as one of these."""
    with open(path, "rb") as file:
        return MARK.encode() in file.read(64)


def _of_wgmb(numbers: Range) -> str:
    first, last, step = numbers
    if first == last:
        return f"{first}"
    return f"{first}-{last}" + (f"x{abs(step)}" if abs(step) != 1 else "")


def _scalar(text: str) -> str:
    """A text as YAML and JSON have it in double quotes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    shown = "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in escaped)
    return f'"{shown}"'
