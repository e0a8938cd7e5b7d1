"""Options by name as the words of a command line."""

from __future__ import annotations

import shlex

from ...settings.color import option_name
from .groups import DEFAULTS

_REPEATED = ("set", "also", "holdout", "scale")


def words_of(options: dict[str, object]) -> list[str]:
    """The words for options that differ from their defaults."""
    words: list[str] = []
    for name, value in options.items():
        default = DEFAULTS[name]
        plain = list(value) if isinstance(value, (list, tuple)) else value
        if plain == (list(default) if isinstance(default, tuple) else default):
            continue
        flag = option_name(name)
        if name in _REPEATED:
            for item in value:  # pyright: ignore[reportGeneralTypeIssues]
                words += _words(flag, str(item))
        elif value is True:
            words += [flag]
        elif isinstance(plain, list):
            words += [flag, *(f"{x:g}" for x in plain)]
        else:
            words += _words(flag, f"{value:g}" if isinstance(value, float) else str(value))
    return words


def no_option(name: str) -> str:
    """A file's name as a command line takes it, although it may begin with -."""
    return f"./{name}" if name.startswith("-") else name


def _words(flag: str, text: str) -> list[str]:
    return [f"{flag}={text}"] if text.startswith("-") else [flag, text]


def for_shell(words: list[str]) -> str:
    """The words after `wgmb` as a line for a shell."""
    return shlex.join(["wgmb", *words])
