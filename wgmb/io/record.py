"""The record that every result carries: settings, inputs, and a checksum of the file.

A record is JSON and stands in the file as it is: in an EXR as the attribute `wgmb`, in a PNG as a
text of that keyword, in a TIFF as its description, in a JPEG as its comment, in a video in a block
of its own, which players skip (see record_block.py). It begins with the seal, the
file's length in bytes and its CRC-32, both taken while the seal's digits are 0. A file whose seal
holds is the whole file that was written, to the last bit.
"""

from __future__ import annotations

import io
import itertools
import json
import os
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from . import record_block

KEY = "wgmb"  # attribute or keyword of the record
_BLANK = b"0" * 12 + b"-" + b"0" * 8  # length, CRC-32
_BEGIN = b'{"seal": "'
_SEAL = re.compile(re.escape(_BEGIN) + rb"(\d{12}-[0-9a-f]{8})")
_PNG = b"\x89PNG\r\n\x1a\n"
_LONGEST = 65536  # bytes of a record
_PIECE = 1 << 20  # bytes that are read at a time
_MOST_SEALS = 4  # that are looked at in a file: an input's record may stand before its own
_AFTER_KEYWORD = len(b"tEXt" + KEY.encode() + b"\0")


def blank(content: dict[str, Any]) -> str:
    """The record's text, to be put into a file that is then sealed."""
    return json.dumps({"seal": _BLANK.decode(), **dict(sorted(content.items()))})


def seal(data: bytes, text: str) -> list[bytes | memoryview]:
    """The file in pieces, with the digits of the seal set; `text` is the record in it."""
    record = text.encode()
    at = data.find(record)
    if at < 0:
        raise ValueError("the record is not in the file")
    return _sealed(memoryview(data), at, at + len(record))


def read(data: bytes) -> dict[str, Any] | None:
    """The content of the record of a file that is whole; None where there is none or it is not."""
    content, is_whole = _read(io.BytesIO(data))
    return content if is_whole else None


def content_of(text: object) -> dict[str, Any] | None:
    """The content of a record's text, whether the file is whole or not; None if it is none."""
    if not isinstance(text, str) or not is_begun(text):
        return None
    stated = _stated(text.encode("latin-1", "replace"))
    return stated[0] if stated else None


def _stated(text: bytes) -> tuple[dict[str, Any], int] | None:
    """The content of the record that a text begins with, and its length; None if it is broken."""
    try:
        content, length = json.JSONDecoder().raw_decode(text.decode("latin-1"))
    except (ValueError, RecursionError):
        return None
    del content["seal"]
    return content, length


def put_into(path: Path, text: str, *, is_complete: bool = True) -> None:
    """Put a record into a video, with its seal where the video `is_complete`.

    OSError if the file cannot be written.
    """
    begin, end = record_block.append(path, text)
    if not is_complete:
        return
    with open(path, "r+b") as file:
        digits = _digits(file, begin, end)
        file.seek(begin + len(_BEGIN))
        file.write(digits)


def read_file(path: Path) -> tuple[dict[str, Any] | None, bool]:
    """The content of a large file's record, None without one; and True if the file is whole.

    It is read in pieces, so that another program may cut it meanwhile. OSError if it cannot be
    read.
    """
    with open(path, "rb") as file:
        return _read(file)


def _read(file: BinaryIO) -> tuple[dict[str, Any] | None, bool]:
    """As `read_file`, of an open file.

    The first few seals are looked at, and those that state another length are not checked: a
    stranger's file may hold thousands, and each check takes the whole file.
    """
    size = file.seek(0, os.SEEK_END)
    first = None
    for begin, digits in itertools.islice(_seals(file), _MOST_SEALS):
        if (stated := _stated(record_block.text_at(file, begin, _LONGEST))) is None:
            continue
        content, length = stated
        is_checked = digits.startswith(b"%012d-" % size)
        if is_checked and digits == _digits(file, begin, begin + length):
            return content, True
        first = first or content
    return first, False


def _seals(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """The place of each seal in a file, and its digits."""
    at, kept = 0, b""
    while True:
        file.seek(at)
        if not (piece := file.read(_PIECE)):
            return
        text = kept + piece
        for found in _SEAL.finditer(text):
            yield at - len(kept) + found.start(), found[1]
        at, kept = at + len(piece), text[-(len(_BEGIN) + len(_BLANK) - 1) :]


def _digits(file: BinaryIO, begin: int, end: int) -> bytes:
    """The digits that seal an open file, whose record is from `begin` to `end`.

    Empty for a PNG whose chunk with the record has another CRC than it states.
    """
    digits, after = begin + len(_BEGIN), begin + len(_BEGIN) + len(_BLANK)
    changed = [(digits, _BLANK)]
    if _piece(file, 0, 8) == _PNG:  # the record is in a chunk, whose CRC changes with the digits
        lead = _piece(file, max(0, begin - _AFTER_KEYWORD), digits)
        tail = _piece(file, after, end)
        changed.append((end, _crc32(lead, _BLANK, tail)))
        if _piece(file, end, end + 4) != _crc32(lead, _piece(file, digits, after), tail):
            return b""
    crc, at, size = 0, 0, file.seek(0, os.SEEK_END)
    for place, instead in [*changed, (size, b"")]:
        for piece in _pieces(file, at, place):
            crc = zlib.crc32(piece, crc)
        crc = zlib.crc32(instead, crc)
        at = place + len(instead)
    return f"{size:012d}-{crc:08x}".encode()


def _pieces(file: BinaryIO, begin: int, end: int) -> Iterator[bytes]:
    file.seek(begin)
    while begin < end and (piece := file.read(min(_PIECE, end - begin))):
        yield piece
        begin += len(piece)


def _piece(file: BinaryIO, begin: int, end: int) -> bytes:
    file.seek(begin)
    return file.read(end - begin)


def _crc32(*pieces: bytes) -> bytes:
    return zlib.crc32(b"".join(pieces)).to_bytes(4)


def is_begun(text: str) -> bool:
    """Return True for a text that `blank` made."""
    return text.startswith(_BEGIN.decode())


def is_ours(data: bytes) -> bool:
    """Return True if a file, even a damaged one, begins a record, or is empty."""
    return _SEAL.search(data) is not None or not data.strip(b"\0")


def _sealed(data: memoryview, begin: int, end: int) -> list[bytes | memoryview]:
    """`data` in pieces, with the digits set of the seal of the record from `begin` to `end`."""
    digits = begin + len(_BEGIN)
    after = digits + len(_BLANK)
    checked = end + 4 if bytes(data[:8]) == _PNG else end  # a PNG's text is a chunk with a CRC

    def pieces(seal: bytes) -> list[bytes | memoryview]:
        chunk = [bytes(data[begin - _AFTER_KEYWORD : digits]), seal, bytes(data[after:end])]
        crc = zlib.crc32(b"".join(chunk)).to_bytes(4, "big")[: checked - end]
        return [data[:digits], seal, data[after:end], crc, data[checked:]]

    crc = 0
    for piece in pieces(_BLANK):
        crc = zlib.crc32(piece, crc)
    return pieces(f"{len(data):012d}-{crc:08x}".encode())
