"""Names of pipes: the standard streams, which a command line calls `-`, and named pipes."""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence

STDIN, STDOUT = "/dev/stdin", "/dev/stdout"
_OUTPUTS = "-o", "--output"


def is_pipe(name: str) -> bool:
    """Return True for the standard streams and for a named pipe."""
    try:
        return name in (STDIN, STDOUT) or stat.S_ISFIFO(os.stat(name).st_mode)
    except (OSError, ValueError):
        return False


def named(words: Sequence[str]) -> list[str]:
    """The words of a command line with the names of the streams in place of `-`."""
    found = []
    for before, word in zip(["", *words], words, strict=False):
        if word == "-":
            word = STDOUT if before in _OUTPUTS else STDIN
        found.append(f"--output={STDOUT}" if word == "--output=-" else word)
    return found
