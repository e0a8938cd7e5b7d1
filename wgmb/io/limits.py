"""The law on files of strangers: none may ask for more than it can justify.

Sizes, counts and offsets that a file states are compared with its length before a library acts on
them; compressed data inflate to no more than their picture takes; and files that are read whole
are regular ones of a bounded size (`files/bounded.py`). A file that cannot be judged is refused in
one line.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from pathlib import Path

from ..errors import InputError
from ..frame import MOST_SIDE

MOST_PIXELS_A_SIDE = MOST_SIDE
MOST_CHANNELS = 4096  # of a file
MOST_TILES = 1 << 16  # of a file: a picture of 16k by 16k in tiles of 64
MAX_MB = 4096
"""Megabytes that a file may unpack to unless another limit is given."""
_TIMES = 500  # as much as the file holds: then it is all but empty, or was made to do harm
_SHARE = 4  # and may take this part of the limit
AVERAGED, MOVED, GATHERED = 25, 51, 128
"""Values of 32 bits that a run holds of a pixel of a video, whose textures may be in memory too.

Where pictures are averaged: decoded and coded ones, eight as planes, five as light, the sums;
measured with GIFs of 8 and of 20 megapixels. An encoder that looks ahead adds 3 bytes for each
picture that it holds. Where motion is searched without a GPU: if they are blurred by tap alone, and
by other methods; measured at 8 megapixels."""
INDEX_SHARE = 8
"""Part of the limit that a file's index, and the search for its form, may take."""
_INDEX_ENTRY = 64  # bytes that an entry of an index takes in memory, at most
LARGEST_INDEX = 64 << 20  # bytes that a compressed index may unpack to


def unpacked(size: tuple[int, int], channels: int) -> int:
    """Bytes of so many channels of `size` pixels as float32, their form here."""
    return 4 * size[0] * size[1] * channels


def check_held(
    path: Path, size: tuple[int, int], channels: int, stored: int, max_mb: float
) -> None:
    """Raise InputError where a run would hold more of pictures of `size` than a file justifies.

    `channels`: values of 32 bits that it holds of a pixel. Only a picture that unpacks to over 500
    times the file's `stored` bytes is judged: a quarter of `max_mb` may be held for it.
    """
    most, needed = max_mb / _SHARE * 2**20, unpacked(size, channels)
    if unpacked(size, 4) <= _TIMES * stored or needed <= most:
        return
    raise InputError(
        f"{path}: a file of {stored:,} bytes may take {max_mb / _SHARE:g} MB of memory, but to "
        f"blur its pictures of {size[0]} x {size[1]} takes {-(-needed // 2**20)} MB; "
        f"`max_mb={-(-needed * _SHARE // 2**20)}` allows it"
    )


def check(path: Path, name: str, promised: int, stored: int, max_mb: float) -> None:
    """Raise InputError where `promised` bytes are more than a file of `stored` bytes may ask for.

    `name`: how large the picture is, for the message. A file that unpacks to over 500 times its
    size may take a quarter of `max_mb`: a black frame does so, and so does a bomb. InputError for a
    limit that is none.
    """
    check_limit(max_mb)
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


def held(name: str, count: int, size: int, stored: int) -> None:
    """Raise ValueError where `count` things of at least `size` bytes exceed `stored` bytes.

    `name`: of the things, for the message.
    """
    if count * size > stored:
        raise ValueError(f"damaged: states {count} {name}, more than {stored} bytes can hold")


def inflated(pieces: Iterable[bytes | memoryview], size: int, name: str) -> bytes:
    """The bytes of a zlib stream, which must be at most `size`; ValueError if it has more.

    `name`: of the data, for the message.
    """
    stream, found, left = zlib.decompressobj(), [], size
    try:
        for piece in pieces:
            found.append(stream.decompress(piece, left + 1))
            left -= len(found[-1])
            if left < 0:
                raise ValueError(f"{name} inflates to more than {size} bytes")
    except zlib.error as error:
        raise ValueError(f"{name} is damaged: {error}") from None
    if not stream.eof:
        raise ValueError(f"{name} is cut off")
    return b"".join(found)


def check_limit(max_mb: float) -> None:
    """Raise InputError for a limit that is none."""
    if not max_mb > 0:
        raise InputError(f"`max_mb` must be above 0 megabytes, got {max_mb:g}")


def check_index(entries: int, stored: int, max_mb: float) -> None:
    """Raise ValueError where an index of so many samples is more than a file may ask for.

    Each stands for a byte of the file at least, so that a file of `stored` bytes has no more of
    them; and the index takes an eighth of `max_mb` at most.
    """
    if entries > stored:
        raise ValueError(f"states {entries:,} samples, too many for its {stored:,} bytes")
    if (promised := entries * _INDEX_ENTRY) > max_mb / INDEX_SHARE * 2**20:
        needed = -(-promised * INDEX_SHARE // 2**20)
        raise ValueError(
            f"the index of its {entries:,} samples would take {-(-promised // 2**20)} MB, "
            f"the limit is {max_mb / INDEX_SHARE:g} MB; `max_mb={needed}` allows it"
        )


def check_packets(path: Path, count: int, size: int, stored: int) -> None:
    """Raise InputError where `count` packets of `size` bytes in all cannot come from a file.

    Each stands for a byte of it at least, and all of them are 500 times as long at most, as where a
    container compresses black areas.
    """
    if count > stored or size > _TIMES * stored:
        raise InputError(
            f"{path}: gives {count:,} packets and {size:,} bytes already, "
            f"too many for a file of {stored:,} bytes"
        )


def most_pixels(stored: int, channels: int, max_mb: float) -> int:
    """Pixels of the largest picture that `check` lets through, of so many channels as float32."""
    check_limit(max_mb)
    whole = min(max_mb, max(_TIMES * stored / 2**20, max_mb / _SHARE))
    return int(whole * 2**20) // (4 * channels)
