"""Progress and result of a run over frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape

from ..io.frame_numbers import frame_list

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
