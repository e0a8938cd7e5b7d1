"""A row tries one thing and yields lines: what, how much was tried, how often it was right.

Rows never assert: what they find is written down, and whether it is as it should be.
"""

from __future__ import annotations

import os
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HEAD = "| what | tried | right | worst case |\n|---|---|---|---|"
_LONGEST = 260  # characters of a cell


@dataclass(frozen=True)
class Line:
    """One line of the table."""

    what: str
    tried: str
    right: str
    worst: str
    ok: bool
    wrong: tuple[str, ...] = ()
    """Every case that was not right; `worst` has the first ones."""

    def __str__(self) -> str:
        bold = "" if self.ok else "**"
        return f"| {bold}{self.what}{bold} | {self.tried} | {bold}{self.right}{bold} | " + (
            f"{_cell(self.worst)} |"
        )


def _cell(text: str) -> str:
    """For a cell: one line, nothing that a terminal or Markdown would obey."""
    plain = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))
    return (plain if len(plain) <= _LONGEST else plain[:_LONGEST] + " ...").replace("|", "\\|")


@dataclass
class Tally:
    """Cases of one kind, and what was wrong with those that were not right."""

    what: str
    unit: str
    tried: int = 0
    wrong: list[str] = field(default_factory=list)

    def note(self, case: object, wrong: str | None = None) -> None:
        """Count a case; `wrong` says what was, nothing or "" that all was right."""
        self.tried += 1
        if wrong:
            self.wrong.append(f"{case}: {wrong}")

    def line(self, worst: str = "") -> Line:
        """The line: what is wrong comes first, `worst` after it."""
        right = self.tried - len(self.wrong)
        some = self.wrong[:3] + ([f"{len(self.wrong) - 3} more"] if len(self.wrong) > 3 else [])
        return Line(
            self.what,
            f"{self.tried:,} {self.unit}",
            "yes" if right == self.tried else f"{right:,} of {self.tried:,}",
            "; ".join([*some, *([worst] if worst else [])]) or "-",
            right == self.tried > 0,
            tuple(self.wrong),
        )


@dataclass(frozen=True)
class Trial:
    """Arguments of a row: the number of tries, the first seed, and a folder."""

    count: int
    seed: int
    folder: Path  # its own, empty
    crashers: Path  # inputs that did what none may do are kept here

    def some(self, cases: Iterable[Any]) -> list[Any]:
        """At most `count` of the cases, evenly spaced."""
        every = list(cases)
        count = min(self.count, len(every))
        return [every[i * len(every) // count] for i in range(count)]


Run = Callable[[Trial], Iterator[Line]]


@dataclass(frozen=True)
class Row:
    """A row by its name; `quick` and `full` are how many it tries, 0 leaves it out."""

    name: str
    quick: int
    full: int
    run: Run

    @property
    def about(self) -> str:
        """Its test, in one line."""
        return (self.run.__doc__ or "").splitlines()[0]


ROWS: dict[str, Row] = {}


def row(*, quick: int = 0, full: int) -> Callable[[Run], Run]:
    """Register a function as a row, under its own name."""

    def register(run: Run) -> Run:
        name = run.__name__.replace("_", "-")
        ROWS[name] = Row(name, quick, full, run)
        return run

    return register


def run_rows(
    rows: Sequence[Row],
    tell: Callable[[str], None],
    *,
    quick: bool = False,
    scale: float = 1.0,
    seed: int = 0,
    crashers: Path,
) -> Iterator[Line]:
    """Run the rows one after the other; a fault of a row itself is a line, too.

    `tell` is called with how long each one took.
    """
    for row in rows:
        count = (row.quick if quick else row.full) or row.full
        started = time.perf_counter()
        with tempfile.TemporaryDirectory(prefix="soak-") as folder:
            trial = Trial(max(1, round(count * scale)), seed, Path(folder), crashers)
            try:
                yield from row.run(trial)
            except Exception as error:
                tell(traceback.format_exc())
                yield Line(row.name, "-", "not tried", f"{type(error).__name__}: {error}", False)
        tell(f"{row.name}: {time.perf_counter() - started:.1f} s")


def write_whole(path: Path, text: str) -> None:
    """Put `text` at `path`, all of it or nothing."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
