"""What `wgmb compare` and `wgmb bench` share: a page, and what is said meanwhile."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from ..errors import InputError
from ..lab.cases import Tell
from . import terminal
from .terminal import note


def whole_numbers(name: str, text: str) -> list[int]:
    """`4,8,16` -> numbers."""
    try:
        return [int(n) for n in text.split(",")]
    except ValueError:
        raise InputError(f"{name} must be like 4,8,16, got {text!r}") from None


def pages_of(output: Path) -> list[Path]:
    """The page and what is written beside it; that it can be, before the work."""
    if output.suffix != ".html":
        raise InputError(f"output must be a page such as report.html, got {output}")
    if not output.parent.is_dir():
        raise InputError(f"there is no folder {output.parent}")
    return [output.with_suffix(suffix) for suffix in (".html", ".json", ".csv")]


def teller(quiet: bool) -> Tell:
    """What says on stderr how far the work is, and hears Ctrl-C."""

    def tell(text: str) -> None:
        terminal.check()
        if not quiet:
            note(text)

    return tell


def command_line() -> str:
    """What was typed, for the page."""
    return shlex.join(["wgmb", *sys.argv[1:]])
