"""A job done by many processes, on this machine or others, through dask.distributed."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..extras import needed_by
from ..io import leftovers
from ..run.job import Job
from ..run.job_file import stored, time_there
from ..run.report import BatchReport, Progress
from .driver import Driver
from .local import closing, local_client
from .workers import SMALLEST, WorkerPool, hardware_adapters

_CONNECT = 10  # seconds to reach a scheduler


@dataclass
class Farm(WorkerPool):
    """Workers that blur jobs together; InputError where dask.distributed is missing."""

    def __post_init__(self) -> None:
        with needed_by("`workers` and `cluster`"):
            import cryptography  # noqa: F401
            import distributed  # noqa: F401

    def blur(self, job: Job, progress: Progress | None = None) -> BatchReport:
        """Blur all frames of a job; its output has been looked at.

        DeviceError if no worker has a GPU, InputError if none can do the job. Interrupted, every
        worker ends the frame that it is at, and the interruption goes on.
        """
        text = stored(job, SMALLEST, frames=job.numbers[:1]).text()
        with leftovers.removed_by(job.sweep), self._client() as client:
            return Driver(self, client, job, text, progress or (lambda n, state: None)).run()

    @contextlib.contextmanager
    def _client(self) -> Iterator[Any]:
        if self.cluster is None:
            with local_client(self.workers or max(1, len(hardware_adapters()))) as client:
                yield client
            return
        from distributed import Client

        try:
            client = Client(self.cluster, set_as_default=False, timeout=_CONNECT)
        except (OSError, ValueError) as error:
            raise InputError(f"no scheduler at {self.cluster}: {error}") from None
        with closing(client):
            yield client


def as_farm_job(job: Job) -> Job:
    """The job of a new run, whose outputs that exist are looked at, and refused if need be."""
    if job.is_part_of_run:
        return job
    job.make_output()
    output = job.request.output
    if output.overwrite and not output.resume and job.since is None:
        return replace(job, since=time_there(Path(output.output).parent))
    return job
