"""The messages of a command about its run: progress, warnings, and the summary at its end."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from ..errors import counted
from ..io.frame_numbers import frame_list, numbered
from ..run.report import UNFOLLOWED, BatchReport, VideoReport
from ..sequence.frame_builder import ALONE
from ..sequence.frame_file import odd_sizes
from . import terminal
from .exit_codes import DONE, SOME_FAILED
from .spelling import as_options
from .terminal import Tick, complain, note


@dataclass(frozen=True)
class Console:
    """Messages of a command, on standard error; its results go to standard output.

    `quiet`: errors and losses only. `verbose`: details too. In every message, arguments of the
    library are spelled as options.
    """

    quiet: bool = False
    verbose: bool = False

    def say(self, *texts: str | None) -> None:
        """Print messages unless quiet; an empty one is left out."""
        for text in () if self.quiet else filter(None, texts):
            note(as_options(text))

    def say_running(self, text: str) -> None:
        """Print a message during long work; an interruption that was dropped is raised."""
        terminal.check()
        self.say(text)

    def detail(self, text: str) -> None:
        """Print a message if details are asked for, even if quiet."""
        if self.verbose:
            note(as_options(text))

    def complain(self, text: str) -> None:
        """Print an error or a loss, even if quiet."""
        complain(text)

    def progress(self, frames: int, doing: str = "blurring") -> AbstractContextManager[Tick]:
        """A function to call after every frame; on a terminal it drives a progress bar."""
        return terminal.progress(frames, self.quiet, doing)

    def conclude(self, report: BatchReport, target: Path, took: str) -> int:
        """Print a summary of the run over frames into `target`; return the exit code."""
        for number, why in sorted(report.failed.items()):
            complain(f"frame {number} failed: {why}")
        if report.stopped:
            unwritten = counted(report.rest, "other frame")
            complain(f"stopped: {report.stopped}; {unwritten} not written")
        for mask in report.absent:
            complain(f"{mask} is in no frame, so it changed nothing")
        for number, bad in sorted(report.bad.items()):
            pixels = ", ".join(f"{n} in {name}" for name, n in bad.items())
            self.say(f"frame {number}: ignored pixels that are not finite: {pixels}")
        if self.verbose or report.is_finding_notable:
            self.say(f"vectors: {report.finding}")
        self._tell_frames(report)
        if report.beyond:
            self.say(f"{target}: {report.beyond}")
        self.say(done_line(report, took, target))
        if report.failed:
            complain(f"{len(report.failed)} of {counted(report.total, 'frame')} failed")
        return SOME_FAILED if report.failed or report.stopped or report.absent else DONE

    def _tell_frames(self, report: BatchReport) -> None:
        """Say what was seen in the frames."""
        for text, told in report.notes.items():
            if told:
                some = "" if len(told) == len(report.done) else f"{numbered(told)}: "
                self.say(f"{some}{text}")
        for mask in report.unseen:
            self.say(f"{mask} is in no pixel of these frames, so it changed nothing")
        if stray := report.stray_cuts:
            there = "{} to {}".format(*report.on_disk)
            self.say(f"no shot begins at the cuts {frame_list(stray)}: the frames are {there}")
        if report.cuts:
            self.say(cuts_told(report.cuts, "frame"))
        self.say(odd_sizes({n: size for size, at in report.sizes.items() for n in at}) or "")


def done_line(report: BatchReport, took: str, target: Path) -> str:
    """The line about frames that were done: how many, how long it took, and where they are."""
    done = f"{counted(len(report.done), 'frame')} in {took} -> {target}"
    return done + (f", {len(report.skipped)} already done" if report.skipped else "")


def cuts_told(cuts: Iterable[int], noun: str) -> str:
    """The line about camera cuts: before frame 4, before pictures 4,9."""
    numbers = sorted(cuts)
    return f"camera {'cut' if len(numbers) == 1 else 'cuts'} before {numbered(numbers, noun)}"


def pictures_told(report: VideoReport, fills: bool) -> list[str]:
    """Lines on peculiarities of a video, some empty; `fills`: repeated pictures are left out."""
    flashes = ", ".join(map(str, report.flashes))
    return [
        cuts_told(report.cuts, "picture") if report.cuts else "",
        f"flash at picture {flashes}" if flashes else "",
        alone_told(report.alone),
        unfollowed_told(report.unfollowed),
        repeats_told(report.repeated) if fills else "",
        report.held_out,
        report.scaling,
    ]


def alone_told(numbers: Sequence[int]) -> str:
    """The line about pictures that are copied as nothing is beside them; "" where none is."""
    return f"{numbered(sorted(numbers), 'picture')}: {ALONE}" if numbers else ""


def unfollowed_told(numbers: Sequence[int]) -> str:
    """The line about pictures in which motion was not found; "" where there are none."""
    if not numbers:
        return ""
    at = numbered(sorted(numbers), "picture")
    return f"{at}: {UNFOLLOWED}; a recording with more frames per second would help"


def repeats_told(count: int) -> str:
    """The line about repeated pictures, of a run that leaves them out."""
    return (
        f"{counted(count, 'repeated picture')} left out" if count else "no repeated picture found"
    )
