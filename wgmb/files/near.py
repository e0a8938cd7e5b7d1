"""Files whose names are near one that is not there."""

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path
from typing import NamedTuple

_MOST = 10_000  # names of a folder that are compared
_NUMBER = re.compile(r"\d+$")
_SLIP = 0.75  # of difflib's ratio, from which words are taken for a slip,
_SUFFIX_SLIP = 0.5  # and suffixes, which are short


class _Parts(NamedTuple):
    words: str
    number: str
    suffix: str


def near(path: Path) -> str:
    """The name of the file beside `path` that is probably meant; "" if none is near.

    Names have words, a number and a suffix. A file with the same words and the same number is meant
    whatever its suffix is; otherwise the suffix and the words may only differ by a slip.
    """
    wanted = _parts(path.name)
    try:
        with os.scandir(path.parent) as entries:
            files = [e for e in itertools.islice(entries, _MOST) if e.is_file()]
            ranks = {e.name: _rank(wanted, _parts(e.name), e.stat().st_size) for e in files}
    except OSError:
        return ""
    by_rank = {name: rank for name, rank in ranks.items() if rank is not None}
    return max(sorted(by_rank), key=by_rank.__getitem__, default="")


def _parts(name: str) -> _Parts:
    stem, suffix = os.path.splitext(name.lower())
    number = _NUMBER.search(stem)
    words = stem[: number.start()] if number else stem
    return _Parts(words.rstrip("._-"), number[0] if number else "", suffix)


def _rank(wanted: _Parts, other: _Parts, size: int) -> tuple[float, ...] | None:
    """The rank of a name, the nearest highest; None if it is not near.

    The larger of two files that are as near is rather the picture than a note on it.
    """
    words, suffix = _alike(wanted.words, other.words), _alike(wanted.suffix, other.suffix)
    is_same = words == 1 and wanted.number == other.number
    if not is_same and (words < _SLIP or suffix < _SUFFIX_SLIP):
        return None
    apart = abs(int(wanted.number or 0) - int(other.number or 0))
    return words, -apart, suffix, size


def _alike(one: str, other: str) -> float:
    from difflib import SequenceMatcher  # only when something is wrong

    return SequenceMatcher(None, one, other).ratio()
