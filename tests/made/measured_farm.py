"""Workers and jobs for farm_figures.py; workers import this module."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import make_frames as make
from wgmb.farm.plugin import BlurPlugin
from wgmb.run.job import Job, settle
from wgmb.run.report import BatchReport
from wgmb.run.request import BlurRequest
from wgmb.sequence.findings import SequenceFindings
from wgmb.settings import (
    BlurSettings,
    InputSettings,
    OutputSettings,
)


def job_of(pattern: str, out: Path, method: str = "tap") -> Job:
    """The job of `wgmb blur`."""
    asked = BlurRequest(
        pattern=pattern,
        output=OutputSettings(output=str(out / "o.####.exr")),
        blur=BlurSettings(method=method),
        input=InputSettings(vectors="blender"),
    )
    return settle(asked)


def long_job(folder: Path, count: int) -> Job:
    """A job of very many frames, of which only three are there."""
    pattern = make.write_sequence(folder, (1, 2, 3))
    short = job_of(pattern, folder / "out")
    every = list(range(1, count + 1))
    found: SequenceFindings = replace(short.settled, on_disk=tuple(every))
    return replace(short, numbers=every, findings=found, clip_opened=None)


class Timed(BlurPlugin):
    """A worker that writes down its CPU seconds after every part."""

    def prepare(self, adapter: str | None) -> None:
        """Begin to count."""
        self._cpu = time.process_time()
        super().prepare(adapter)
        self._log()

    def blur(self, chosen, tell, stop) -> BatchReport:
        """Blur, and count."""
        made = super().blur(chosen, tell, stop)
        self._log()
        return made

    def _log(self) -> None:
        with open(os.environ["WGMB_STUB_LOG"], "a") as file:
            file.write(f"{os.getpid()} {time.process_time() - self._cpu}\n")


class Waiting(BlurPlugin):
    """A worker that waits for every frame as for a GPU."""

    def prepare(self, adapter: str | None) -> None:
        """There is nothing to be opened."""
        self._seconds = float(os.environ.get("WGMB_STUB_SECONDS", "0.1"))

    def blur(self, chosen, tell, stop) -> BatchReport:
        """Wait."""
        for number in chosen:
            time.sleep(self._seconds)
            tell(number, "done")
        sizes = {(1920, 1080): list(chosen)}
        return BatchReport(done=list(chosen), total=len(chosen), sizes=sizes)


def memory_of(process: int) -> float:
    """MiB of a process in RAM."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def is_worker(process: int) -> bool:
    """Return True for a process that dask's nanny started: one that has no children of its own."""
    try:
        line = Path(f"/proc/{process}/cmdline").read_bytes()
        children = Path(f"/proc/{process}/task/{process}/children").read_text()
    except OSError:
        return False
    return (b"spawn_main" in line or b"forkserver" in line) and not children.strip()
