"""`wgmb blur` of rendered frames: those of a job, in this process or in several."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from ...io.frame_numbers import frame_numbers
from ...run.job import Job
from ...run.job_file import read_job
from .. import run_log
from ..console import Console
from ..terminal import check, muted


class Crew(NamedTuple):
    """Processes that share the frames of a job."""

    workers: int | None
    """Number of those to start here, None for a suitable one."""
    cluster: str | None
    """The scheduler of others."""


def blur_job(
    path: Path,
    frames: str | None,
    console: Console,
    adapter: str | None = None,
    crew: Crew | None = None,
) -> int:
    """Blur some frames of a job file, or all; returns the exit code."""
    kept = read_job(path)
    numbers = kept.job.chosen(frame_numbers(frames) if frames else kept.job.numbers)
    kept.check(numbers, str(path))
    if crew is not None:
        return blur_on_farm(replace(kept.job, numbers=numbers), crew, console, adapter)
    return blur_frames(kept.job, console, adapter, numbers)


def blur_on_farm(job: Job, crew: Crew, console: Console, adapter: str | None = None) -> int:
    """Blur frames of a job in several processes; returns the exit code."""
    from ...farm.farm import Farm, as_farm_job

    console.say(*job.remarks)
    loud = Console()
    farm = Farm(crew.cluster, crew.workers, adapter, loud.say, console.detail, check)
    job = as_farm_job(job)
    started = time.perf_counter()
    output = job.request.output.output
    made_of = job.clip.dependencies.every()
    run_log.start([job.request.pattern], output, job.settings, len(job.numbers), made_of)
    with console.progress(len(job.numbers)) as tick, muted():
        report = farm.blur(job, run_log.logged(tick, output))
    took = f"{time.perf_counter() - started:.1f} s with {job.request.blur.method}"
    return console.conclude(report, Path(output), took)


def blur_frames(
    job: Job, console: Console, adapter: str | None = None, numbers: list[int] | None = None
) -> int:
    """Blur frames of a job in this process, by default all; returns the exit code."""
    console.say(*job.remarks)
    run = job.run(adapter, numbers)
    console.detail(f"adapter: {run.blur.device.adapter.summary}")
    console.detail(f"settings: {run.output.settings}")
    started = time.perf_counter()
    output = run.output.pattern
    made_of = run.clip.dependencies.every()
    run_log.start([job.request.pattern], output, job.settings, len(run.numbers), made_of)
    with console.progress(len(run.numbers)) as tick:
        report = run(run_log.logged(tick, output))
    if len(run.clip.numbers) < len(job.numbers):
        report.unseen += report.absent  # other frames may have them
        report.lacking = []
    took = f"{time.perf_counter() - started:.1f} s with {run.blur.method.name}"
    return console.conclude(report, output, took)
