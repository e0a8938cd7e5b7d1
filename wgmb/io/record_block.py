"""The record's place in a video: a block of its own near the end, which players skip.

It takes none of the texts that users have. MP4 and MOV: a box of the type `uuid` (ISO/IEC 14496-12,
11.1). Matroska and WebM: the element Void (RFC 8794, 11.3.2). GIF: an application extension
(GIF89a, 26) before the last picture, whose data stands in blocks of at most 255 bytes.
"""

from __future__ import annotations

import mmap
from pathlib import Path
from typing import BinaryIO

_GIF, _MATROSKA = b"GIF8", b"\x1aE\xdf\xa3"  # the first bytes of these files
_BEGIN = 100  # bytes; FFmpeg's Matroska begins its segment within
_SEGMENT, _VOID = b"\x18\x53\x80\x67\x01", b"\xec\x01"  # each with the first byte of its length
_BOX = bytes.fromhex("d2d9a14fe8b94543b278a1396006cf4e")  # the name of wgmb's box
_EXTENSION, _TRAILER = b"\x21\xff\x0bwgmb    rec", b"\x3b"
_COMMENT, _CONTROL = b"\x21\xfe", b"\x21\xf9"  # the latter before each picture
_LONGEST = 255  # bytes in a block of a GIF


def append(path: Path, text: str) -> tuple[int, int]:
    """Put a record into a complete video; returns where its text begins and ends [bytes].

    OSError if the file cannot be written.
    """
    data = text.encode()
    with open(path, "r+b") as file:
        begin = file.read(_BEGIN)
        if begin.startswith(_GIF):
            blocks = _blocks(data)
            at = _insert(file, _EXTENSION + blocks) + len(_EXTENSION) + 1
            return at, at + len(blocks) - 1
        if begin.startswith(_MATROSKA):
            head = _VOID + len(data).to_bytes(7)
            _grow_segment(file, begin, len(head) + len(data))
        else:
            head = (8 + len(_BOX) + len(data)).to_bytes(4) + b"uuid" + _BOX
        at = file.seek(0, 2) + len(head)
        file.write(head + data)
    return at, at + len(data)


def _grow_segment(file: BinaryIO, begin: bytes, more: int) -> None:
    """Add to the length that a Matroska file states, as FFmpeg writes it: 7 bytes after 01."""
    at = begin.index(_SEGMENT) + len(_SEGMENT)
    length = int.from_bytes(begin[at : at + 7]) + more
    file.seek(at)
    file.write(length.to_bytes(7))


def comment(path: Path, text: str) -> None:
    """Put a user's comment into a complete GIF; OSError if the file cannot be written."""
    with open(path, "r+b") as file:
        _insert(file, _COMMENT + _blocks(text.encode()))


def _insert(file: BinaryIO, extension: bytes) -> int:
    """Put an extension into a GIF before its last picture; returns where.

    Behind that picture, FFmpeg would take it for one more.
    """
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        at = _last_picture(data)
    file.seek(at)
    rest = file.read()
    file.seek(at)
    file.write(extension + rest)
    return at


def _last_picture(data: mmap.mmap) -> int:
    """Offset of the extension that stands before the last picture of a GIF."""
    at, found = 13 + _table(data[10]), 0
    while data[at : at + 1] != _TRAILER:
        if data[at : at + 2] == _CONTROL:
            found = at
        at += 2 if data[at] == _CONTROL[0] else 11 + _table(data[at + 9])
        while data[at]:
            at += 1 + data[at]
        at += 1
    return found


def _table(flags: int) -> int:
    """Bytes of the table of colours that a GIF's flags announce."""
    return 3 << (flags & 7) + 1 if flags & 128 else 0


def _blocks(data: bytes) -> bytes:
    parts = [data[n : n + _LONGEST] for n in range(0, len(data), _LONGEST)]
    return b"".join(bytes([len(part)]) + part for part in parts) + b"\0"


def text_at(file: BinaryIO, begin: int, most: int) -> bytes:
    """At most about `most` bytes of the text that begins there, as it was before `append`."""
    file.seek(0)
    if file.read(len(_GIF)) != _GIF or not begin:
        file.seek(begin)
        return file.read(most)
    file.seek(begin - 1)
    return _unblocked(file.read(most + 1))


def _unblocked(data: bytes) -> bytes:
    """The contents of the blocks with which `data` begins, up to the empty one."""
    found, at = [], 0
    while at < len(data) and data[at]:
        found.append(data[at + 1 : at + 1 + data[at]])
        at += 1 + data[at]
    return b"".join(found)
