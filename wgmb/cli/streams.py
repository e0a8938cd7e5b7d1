"""The standard streams, which a command line calls `-`."""

from __future__ import annotations

from collections.abc import Sequence

from ..io.pipes import STDIN, STDOUT

_OUTPUTS = "-o", "--output"


def named(words: Sequence[str]) -> list[str]:
    """The words of a command line with the names of the streams in place of `-`."""
    found = []
    for before, word in zip(["", *words], words, strict=False):
        if word == "-":
            word = STDOUT if before in _OUTPUTS else STDIN
        found.append(f"--output={STDOUT}" if word == "--output=-" else word)
    return found
