"""Messages about rendered frames at the end of a run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..errors import counted
from ..io.frame_numbers import frame_list, numbered
from ..run.report import BatchReport
from ..sequence.frame_file import odd_sizes
from .exit_codes import DONE, SOME_FAILED
from .spelling import as_options
from .terminal import complain, note


def cuts_told(cuts: Iterable[int], noun: str) -> str:
    """The line about camera cuts: before frame 4, before pictures 4,9."""
    numbers = sorted(cuts)
    return f"camera {'cut' if len(numbers) == 1 else 'cuts'} before {numbered(numbers, noun)}"


def repeats_told(count: int) -> str:
    """The line about repeated pictures, of a run that leaves them out."""
    return (
        f"{counted(count, 'repeated picture')} left out" if count else "no repeated picture found"
    )


def conclude(report: BatchReport, target: Path, took: str, quiet: bool, verbose: bool) -> int:
    """Print a summary of the run into `target`; return the exit code."""
    for number, why in sorted(report.failed.items()):
        complain(f"frame {number} failed: {why}")
    if report.stopped:
        complain(f"stopped: {report.stopped}; {counted(report.rest, 'other frame')} not written")
    for mask in report.absent:
        complain(f"{mask} is in no frame, so it changed nothing")
    if not quiet:
        for number, bad in sorted(report.bad.items()):
            what = ", ".join(f"{n} in {name}" for name, n in bad.items())
            note(f"frame {number}: ignored pixels that are not finite: {what}")
        if verbose or report.is_finding_notable:
            note(f"vectors: {as_options(report.finding)}")
        for text, told in report.notes.items():
            if told:
                text = as_options(text)
                some = "" if len(told) == len(report.done) else f"{numbered(told)}: "
                note(f"{some}{text}")
        for mask in report.unseen:
            note(f"{mask} is in no pixel of these frames, so it changed nothing")
        if stray := report.stray_cuts:
            there = "{} to {}".format(*report.on_disk)
            note(f"no shot begins at the cuts {frame_list(stray)}: the frames are {there}")
        if report.cuts:
            note(cuts_told(report.cuts, "frame"))
        if odd := odd_sizes({n: size for size, at in report.sizes.items() for n in at}):
            note(odd)
        if report.beyond:
            note(f"{target}: {report.beyond}")
        done = f"{counted(len(report.done), 'frame')} in {took} -> {target}"
        note(done + (f", {len(report.skipped)} already done" if report.skipped else ""))
    if report.failed:
        complain(f"{len(report.failed)} of {counted(report.total, 'frame')} failed")
    return SOME_FAILED if report.failed or report.stopped or report.absent else DONE
