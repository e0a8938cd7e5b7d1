"""Progress and result of a run: over frames, of one process or of many, or over a video."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from ..io.frame_numbers import frame_list
from ..sequence.clip import Clip

Progress = Callable[[int, str], None]
"""Called with a frame's number and "done", "skipped" or "failed", which is a Failure."""


class Failure(str):
    """The state "failed", as progress is called with it, and the reason."""

    reason: str

    def __new__(cls, reason: str) -> Failure:
        """A state with this reason."""
        made = super().__new__(cls, "failed")
        made.reason = reason
        return made


UNFOLLOWED = "something moves too far to be followed, or is in one picture only: it stays sharp"
"""Remark on pictures with a place whose motion was not found."""
MOST_ROWS = 20  # of a report in a notebook, of a kind


@dataclass
class BatchReport:
    """Result of a run over frames, with observations about them; plain values."""

    done: list[int] = field(default_factory=list)
    """Numbers of the frames that were written, in the order in which they were finished."""
    skipped: list[int] = field(default_factory=list)
    """Numbers of the frames that were finished before (`resume`)."""
    failed: dict[int, str] = field(default_factory=dict)
    """Reasons, by the numbers of the frames that failed."""
    stopped: str = ""
    """The reason why the run ended early, or has no video; "" otherwise."""
    bad: dict[int, dict[str, int]] = field(default_factory=dict)
    """Number of pixels that are not finite, by frame number and input (see Frame.bad)."""
    total: int = 0
    """Number of frames that were asked for; 0 where nobody knew it."""
    cuts: set[int] = field(default_factory=set)
    """Frames after a camera cut, of those that were read."""
    stray_cuts: list[int] = field(default_factory=list)
    """Given cuts at frames that do not exist."""
    on_disk: tuple[int, ...] = ()
    """Numbers of the first and the last input frame that exist; empty without input frames."""
    finding: str = ""
    """The vector convention, in words (see Clip.finding)."""
    is_finding_notable: bool = False
    """True if the vectors do not follow the convention of their names, or should be checked."""
    notes: dict[str, list[int]] = field(default_factory=dict)
    """Messages for the user, each with the finished frames to which it applies."""
    unseen: list[str] = field(default_factory=list)
    """Masks by name that are in no pixel of the frames that were read."""
    lacking: list[str] = field(default_factory=list)
    """Masks by index or id that none of the frames that were read has."""
    sizes: dict[tuple[int, int], list[int]] = field(default_factory=dict)
    """Frames that were done, by their size."""
    beyond: str = ""
    """A line on the files of a longer run at another rate, which remain; "" if there are none."""

    @property
    def absent(self) -> list[str]:
        """Masks by index or id that no frame has (see Clip.absent); empty unless all were read."""
        return self.lacking if len(self.done) == self.total else []

    @property
    def rest(self) -> int:
        """Number of the frames of which nothing is known."""
        known = len(self.done) + len(self.skipped) + len(self.failed)
        return max(0, self.total - known)

    def __repr__(self) -> str:
        counts = {"done": self.done, "already there": self.skipped, "failed": self.failed}
        told = [f"{len(numbers)} {word}" for word, numbers in counts.items() if numbers]
        why = f", stopped: {self.stopped[:200]}" if self.stopped else ""
        return f"BatchReport({', '.join(told) or 'nothing done'}{why})"

    def _repr_html_(self) -> str:
        rows = [("done", frame_list(self.done)), ("already there", frame_list(self.skipped))]
        failed = sorted(self.failed.items())
        rows += [(f"frame {number} failed", why) for number, why in failed[:MOST_ROWS]]
        if more := failed[MOST_ROWS:]:
            rows.append(("failed too", frame_list([number for number, _ in more])))
        for number, counts in sorted(self.bad.items())[:MOST_ROWS]:
            pixels = ", ".join(f"{count} of {name}" for name, count in counts.items())
            rows.append((f"frame {number}: pixels that are not finite", pixels))
        rows += [("stopped", self.stopped)] + [("in no frame", name) for name in self.absent]
        told = [(head, text) for head, text in rows if text]
        return "<table>{}</table>".format(
            "".join(
                f'<tr><th style="text-align:left">{escape(head)}</th>'
                f'<td style="text-align:left">{escape(text)}</td></tr>'
                for head, text in told or [("done", "nothing")]
            )
        )


@dataclass
class VideoReport:
    """Result of a run over a video, or over pictures that come or go through a pipe."""

    path: Path
    """The input."""
    output: str
    frames: int
    """Number of output frames."""
    seconds: float
    method: str = ""
    """The blur method, or "tap and gather"; "" if pictures were averaged, or none were made."""
    notes: list[str] = field(default_factory=list)
    """Assumptions about the input."""
    left_out: list[str] = field(default_factory=list)
    """Contents of the input that the output cannot hold."""
    cuts: list[int] = field(default_factory=list)
    """Numbers of the input's pictures that begin a shot."""
    flashes: list[int] = field(default_factory=list)
    alone: list[int] = field(default_factory=list)
    """Numbers of the pictures that were copied, as each is alone in its shot."""
    repeated: int = 0
    """Number of repeated pictures that were left out."""
    scaling: str = ""
    """Pictures of another size, if there are any."""
    loss: str = ""
    """Pictures that could not be read, or are damaged, or the missing end of a pipe's input."""
    is_new: bool = True
    """False if it had been finished before (`resume`)."""
    held_out: str = ""
    """A line about displays that stay sharp, if any were found."""
    unfollowed: list[int] = field(default_factory=list)
    """Numbers of the pictures in which a place stays sharp, as its motion was not found."""


def describe_input(report: BatchReport, clip: Clip) -> None:
    """Say of which frames a report is."""
    report.on_disk = min(clip.on_disk), max(clip.on_disk)
    report.finding, report.is_finding_notable = clip.finding, clip.is_finding_notable
    report.stray_cuts = clip.stray_cuts


def describe_frames(report: BatchReport, clip: Clip, *, is_converted: bool = False) -> None:
    """Say what was seen in the frames of a clip.

    `is_converted`: the frames that were done have numbers other than those of the clip.
    """
    done = set(report.done)
    report.cuts, report.unseen, report.lacking = set(clip.cuts), clip.masks.unseen, clip.absent
    if is_converted:
        report.notes = {text: sorted(done) for text, at in clip.notes.items() if at}
        return
    report.notes = {text: sorted(done & set(at)) for text, at in clip.notes.items()}
    for number in report.done:
        report.sizes.setdefault(clip.sizes[number], []).append(number)
