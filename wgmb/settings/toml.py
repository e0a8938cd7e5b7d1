"""TOML files with settings: read whole, or an error in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import bounded
from ..io.frame_numbers import readable

_MOST_BYTES = 1 << 20


def text_of(path: Path) -> str:
    """The text of a settings file; InputError names it and says why it cannot be read."""
    if not readable(path):
        raise bounded.missing(path)
    try:
        return bounded.read(path, _MOST_BYTES, "settings").decode()
    except UnicodeDecodeError:
        raise InputError(f"{path}: settings must be UTF-8") from None


def parse(text: str) -> dict[str, Any]:
    """The tables of a settings file's text; InputError says what is wrong with it."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError("not TOML: lists or tables are nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not TOML: {error}") from None
    except ValueError:
        raise InputError("not TOML: a number has thousands of digits") from None
