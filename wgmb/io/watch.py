"""A library's reading of an index, watched from beside it: memory, time, and interruptions.

Stated numbers are compared with the file's length where its form is known here (limits.py). FFmpeg
reads a hundred forms; this bounds them all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from .. import allocator
from ..errors import InputError
from ..threads import ThreadClock, apart
from . import limits

PACE = 8 << 20
"""Bytes of a file for each of which seconds its index may take one more to read."""
_PATIENCE = 5.0  # s of the processor that an index may take, however small the file is

_Result = TypeVar("_Result")


def watched(
    path: Path | str,
    work: Callable[[], _Result],
    stored: int,
    max_mb: float = math.inf,
    pace: int = PACE,
) -> _Result:
    """The result of `work`, in which a library reads the index of a file of `stored` bytes.

    It may take an eighth of `max_mb`, and 5 s of the processor besides one for each `pace` bytes of
    the file; without a limit where `max_mb` is infinite. InputError beyond that, whatever the
    library does meanwhile: no form of file is trusted. Ctrl-C does not wait for it.
    """
    limits.check_limit(max_mb)
    before, clock = allocator.held(), ThreadClock()
    most, longest = max_mb / limits.INDEX_SHARE * 2**20, _PATIENCE + stored / pace

    def check() -> None:
        if allocator.held() - before > most:
            raise InputError(
                f"{path}: its index takes over {most / 2**20:g} MB; "
                f"`max_mb={2 * max_mb:g}` allows twice as much"
            )
        if clock.seconds() > longest and max_mb < math.inf:
            raise InputError(
                f"{path}: its index takes over {longest:.0f} s to read, too long for a file of "
                f"{stored:,} bytes"
            )

    def timed() -> _Result:
        clock.begin()
        return work()

    return apart(timed, check)
