"""Try whether wgmb holds: memory, damaged and hostile files, kills, disks, devices, names.

    python tools/soak.py                     everything, for hours; prints a table row by row
    python tools/soak.py --quick             what CI has time for
    python tools/soak.py --rows leaks,kills  some rows; --list says which there are
    python tools/soak.py --scale 0.1         a tenth of everything
    python tools/soak.py -o table.md         and into a file, whole or not there

The exit code is 1 if something is not right. Linux only: it reads /proc and limits processes.
Inputs that did what none may do are kept in tests/crashers, for tests/run/test_soak.py.
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from pathlib import Path

from soaking import (
    CRASHERS,
    damage,
    devices,
    disks,
    footage,
    hostile,
    memory,
    names,
    numbers,
    resuming,
    stated,
    stopping,
    strangers,
    videos,
    viewing,
)
from soaking.processes import wgmb
from soaking.table import HEAD, ROWS, Row, run_rows, write_whole
from wgmb import interpreter

MODULES = (
    memory, viewing, stopping, damage, hostile, resuming, numbers, devices, disks, names, videos,
    footage, strangers, stated,
)  # fmt: skip
LISTED = [
    row for module in MODULES for row in ROWS.values() if row.run.__module__ == module.__name__
]
"""All rows, in the table's order."""


def main(arguments: list[str] | None = None) -> int:
    """Run the rows that are asked for; 0 if all is right, 1 if not, 2 for usage."""
    given = _parser().parse_args(arguments)
    if given.list:
        for row in LISTED:
            sys.stdout.write(f"{row.name:16} {row.full:7,} {row.quick or '':>4}  {row.about}\n")
        return 0
    interpreter.name_runtime_folder()  # for the processes that are forked from this one
    rows = _chosen(given)
    head = f"{_about(given)}\n\n{HEAD}"
    print(head, flush=True)
    lines = []
    for line in run_rows(rows, _tell, quick=given.quick, scale=given.scale, seed=given.seed,
                         crashers=given.crashers):  # fmt: skip
        lines.append(line)
        print(line, flush=True)
        if given.verbose:
            _tell("\n".join(f"    {wrong}" for wrong in line.wrong))
    if given.output:
        write_whole(given.output, "\n".join([head, *map(str, lines)]) + "\n")
    return int(not all(line.ok for line in lines))


def _parser() -> argparse.ArgumentParser:
    text, _, more = (__doc__ or "").partition("\n\n")
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=text, epilog=more, formatter_class=raw)
    parser.add_argument("--quick", action="store_true", help="the rows and counts for CI")
    parser.add_argument("--rows", metavar="NAME,...", help="these alone")
    parser.add_argument("--list", action="store_true", help="say which rows there are")
    parser.add_argument("--scale", type=_positive, default=1.0, help="multiplies every count")
    parser.add_argument("--seed", type=int, default=int(time.strftime("%Y%m%d")),
                        help="of everything random; today's date if not given")  # fmt: skip
    parser.add_argument("--crashers", type=Path, default=CRASHERS, help="where inputs are kept")
    parser.add_argument("--verbose", "-v", action="store_true", help="every case that was wrong")
    parser.add_argument("--output", "-o", type=Path, help="Markdown file for the table")
    return parser


def _positive(text: str) -> float:
    if not 0 < float(text) < float("inf"):
        raise argparse.ArgumentTypeError(f"must be over 0, got {text}")
    return float(text)


def _chosen(given: argparse.Namespace) -> list[Row]:
    if given.rows is None:
        return [row for row in LISTED if row.quick or not given.quick]
    wanted = given.rows.split(",")
    if unknown := [name for name in wanted if name not in ROWS]:
        _parser().error(f"no row {unknown[0]!r}; there are {', '.join(ROWS)}")
    return [ROWS[name] for name in wanted]


def _about(given: argparse.Namespace) -> str:
    """The tests and the machine."""
    version = wgmb("--version").out.strip()
    adapters = wgmb("devices").out.splitlines()
    adapter = next((a.partition(": ")[2] for a in adapters if a.startswith("*")), "no adapter")
    how = "quick" if given.quick else "full"
    return (
        f"wgmb {version}, Python {platform.python_version()}, {platform.system()}, {adapter}; "
        f"{how}, scale {given.scale:g}, seed {given.seed}"
    )


def _tell(text: str) -> None:
    if text:
        print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
