"""Report pages of `wgmb compare` and `wgmb bench`."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from ..errors import InputError


def whole_numbers(name: str, text: str) -> list[int]:
    """`4,8,16` -> numbers."""
    try:
        return [int(n) for n in text.split(",")]
    except ValueError:
        raise InputError(f"--{name} must be like 4,8,16, got {text!r}") from None


def pages_of(output: Path) -> list[Path]:
    """Return the page and the files next to it; InputError if they cannot be written."""
    if output.suffix != ".html":
        raise InputError(f"--output must be a page such as report.html, got {output}")
    if not output.parent.is_dir():
        raise InputError(f"no such folder: {output.parent}")
    return [output.with_suffix(suffix) for suffix in (".html", ".json", ".csv")]


def command_line() -> str:
    """Return the command line, for the page."""
    return shlex.join(["wgmb", *sys.argv[1:]])
