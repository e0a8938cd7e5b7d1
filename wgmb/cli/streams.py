"""The standard streams, which a command line calls `-`."""

from __future__ import annotations

from collections.abc import Sequence

from ..io.pipes import STDIN, STDOUT

_OUTPUTS = "-o", "--output", "--log-json"


def named(words: Sequence[str]) -> list[str]:
    """The words of a command line with the names of the streams in place of `-`."""
    found = []
    for before, word in zip(["", *words], words, strict=False):
        if word == "-":
            word = STDOUT if before in _OUTPUTS else STDIN
        option, _, value = word.partition("=")
        found.append(f"{option}={STDOUT}" if option in _OUTPUTS and value == "-" else word)
    return found
