"""Progress and result of a run over frames, of one process or of many."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

from ..io.frame_numbers import frame_list
from ..sequence.clip import Clip

Progress = Callable[[int, str], None]
"""Called with a frame's number and "done", "skipped" or "failed"."""

MOST_ROWS = 20  # of a report in a notebook, of a kind


@dataclass
class BatchReport:
    """Result of a run."""

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
    absent: list[str] = field(default_factory=list)
    """Masks by index or id that no frame has (see Clip.absent); empty unless all were read."""

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
            what = ", ".join(f"{count} of {name}" for name, count in counts.items())
            rows.append((f"frame {number}: pixels that are not finite", what))
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
class Outcome:
    """A report, and what was seen in the frames on the way; plain values."""

    total: int
    """Frames that were asked for."""
    on_disk: tuple[int, int]
    """The first and the last frame that there is."""
    finding: str
    is_finding_notable: bool
    stray_cuts: list[int]
    report: BatchReport = field(default_factory=BatchReport)
    cuts: set[int] = field(default_factory=set)
    notes: dict[str, list[int]] = field(default_factory=dict)
    """Messages for the user, each with the finished frames to which it applies."""
    unseen: list[str] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)
    """Masks that none of the frames read so far has; see Clip.absent."""
    sizes: dict[tuple[int, int], list[int]] = field(default_factory=dict)
    """Frames that were done, by their size."""

    @classmethod
    def begun(cls, clip: Clip) -> Outcome:
        """Before anything is done."""
        return cls(
            len(clip.numbers),
            (min(clip.on_disk), max(clip.on_disk)),
            clip.finding,
            clip.is_finding_notable,
            clip.stray_cuts,
        )

    @classmethod
    def of(cls, clip: Clip, report: BatchReport, converted: Sequence[int] | None = None) -> Outcome:
        """After a run of one process; `converted`: the frames asked for, if the rate is another."""
        made, done = cls.begun(clip), set(report.done)
        made.report, made.cuts = report, set(clip.cuts)
        made.notes = {text: sorted(done & set(at)) for text, at in clip.notes.items()}
        made.unseen, made.absent = clip.unseen, clip.absent
        if converted is not None:  # frames of the clip have other numbers
            made.total = len(converted)
            made.notes = {text: sorted(done) for text, at in clip.notes.items() if at}
            return made
        for number in report.done:
            made.sizes.setdefault(clip.sizes[number], []).append(number)
        return made

    def share(self, numbers: Iterable[int]) -> None:
        """Refer to these objects where a frame has such a number.

        An outcome from another process has numbers of its own, four times as large as a reference.
        """
        known = {number: number for number in numbers}
        report = self.report
        for mine in (report.done, report.skipped, *self.notes.values(), *self.sizes.values()):
            mine[:] = [known.get(number, number) for number in mine]

    def add(self, other: Outcome) -> None:
        """Take in what became of other frames of the same sequence."""
        mine, its = self.report, other.report
        if its.done:  # whoever has read no frame has seen no mask
            is_first = not mine.done
            self.unseen = _both(self.unseen, other.unseen, is_first)
            self.absent = _both(self.absent, other.absent, is_first)
        mine.done += its.done
        mine.skipped += its.skipped
        mine.failed |= its.failed
        mine.bad |= its.bad
        self.cuts |= other.cuts
        for text, numbers in other.notes.items():
            self.notes.setdefault(text, []).extend(numbers)
        for size, numbers in other.sizes.items():
            self.sizes.setdefault(size, []).extend(numbers)

    def be_a_part(self) -> None:
        """Count masks that these frames lack as unseen, as other frames may have them."""
        self.unseen += self.report.absent
        self.report.absent = []

    def end(self) -> None:
        """Nothing more will be added: say what no frame has, if all were read."""
        for numbers in (self.report.done, self.report.skipped, *self.notes.values()):
            numbers.sort()
        self.report.absent = self.absent if len(self.report.done) == self.total else []

    @property
    def rest(self) -> int:
        """The number of frames of which nothing is known."""
        report = self.report
        return self.total - len(report.done) - len(report.skipped) - len(report.failed)


def _both(mine: Sequence[str], its: Sequence[str], is_first: bool) -> list[str]:
    return list(its) if is_first else [one for one in mine if one in its]
