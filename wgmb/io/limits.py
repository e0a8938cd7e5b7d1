"""Limit on the decoded size of an image file: a small file can declare gigabytes."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..frame import MOST_SIDE

MOST_PIXELS_A_SIDE = MOST_SIDE
MOST_CHANNELS = 4096  # of a file
MAX_MB = 4096
"""Megabytes that a file may unpack to unless another limit is given."""
_TIMES = 500  # as much as the file holds: then it is all but empty, or was made to do harm
_SHARE = 4  # and may take this part of the limit


def unpacked(size: tuple[int, int], channels: int) -> int:
    """Bytes of so many channels of `size` pixels as float32, which is what they become here."""
    return 4 * size[0] * size[1] * channels


def check(path: Path, name: str, promised: int, stored: int, max_mb: float) -> None:
    """Raise InputError where `promised` bytes are more than a file of `stored` bytes may ask for.

    `name`: how large the picture is, for the message. A file that unpacks to over 500 times its
    size may take a quarter of `max_mb`: a black frame does so, and so does a bomb. InputError for a
    limit that is none.
    """
    if not max_mb > 0:
        raise InputError(f"`max_mb` must be above 0 megabytes, got {max_mb:g}")
    thin = promised > _TIMES * stored
    most = max_mb / _SHARE if thin else max_mb
    if promised <= most * 2**20:
        return
    needed = -(-promised * (_SHARE if thin else 1) // 2**20)
    because = f" (over {_TIMES} times its own size)" if thin else ""
    raise InputError(
        f"{path}: image of {name} would decode to {-(-promised // 2**20)} MB{because}, "
        f"the limit is {most:g} MB; `max_mb={needed}` allows it"
    )
