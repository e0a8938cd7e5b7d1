"""The record that every result carries: settings, what was read, and a checksum of the file.

A record is JSON and stands in the file as it is: in an EXR as the attribute `wgmb`, in a PNG as a
text of that keyword, in a TIFF as its description, in a JPEG as its comment, in a video in a block
of its own, which players skip (see record_block.py). It begins with the seal, the
file's length in bytes and its CRC-32, both taken while the seal's digits are 0. A file whose seal
holds is the whole file that was written, to the last bit.
"""

from __future__ import annotations

import json
import mmap
import re
import zlib
from pathlib import Path
from typing import Any

from . import record_block

KEY = "wgmb"  # attribute or keyword of the record
_BLANK = b"0" * 12 + b"-" + b"0" * 8  # length, CRC-32
_BEGIN = b'{"seal": "'
_SEAL = re.compile(re.escape(_BEGIN) + rb"(\d{12}-[0-9a-f]{8})")
_PNG = b"\x89PNG\r\n\x1a\n"
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


def read(data: bytes | mmap.mmap) -> dict[str, Any] | None:
    """The content of the record of a file that is whole; None where there is none or it is not."""
    for found in _SEAL.finditer(data):
        if (stated := _stated(data, found.start())) is None:
            continue
        content, length = stated
        at, whole = 0, memoryview(data)
        for piece in _sealed(whole, found.start(), found.start() + length):
            if whole[at : at + len(piece)] != piece:
                break
            at += len(piece)
        else:
            return content
    return None


def content_of(text: object) -> dict[str, Any] | None:
    """The content of a record's text, whether the file is whole or not; None if it is none."""
    if not isinstance(text, str) or not is_begun(text):
        return None
    stated = _stated(text.encode("latin-1", "replace"), 0)
    return stated[0] if stated else None


def _stated(data: bytes | mmap.mmap, begin: int) -> tuple[dict[str, Any], int] | None:
    """The content of the record that begins there, and its length [bytes]; None if it is broken."""
    text = record_block.text_at(data, begin, 65536).decode("latin-1")
    try:
        content, length = json.JSONDecoder().raw_decode(text)
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
        data = mmap.mmap(file.fileno(), 0)
        digits = _sealed(memoryview(data), begin, end)[1]
        begin += len(_BEGIN)
        data[begin : begin + len(digits)] = digits


def read_file(path: Path) -> tuple[dict[str, Any] | None, bool]:
    """The content of a large file's record, None without one; and True if the file is whole.

    OSError if it cannot be read.
    """
    with open(path, "rb") as file:
        if not path.stat().st_size:
            return None, False
        data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        if (content := read(data)) is not None:
            return content, True
        for found in _SEAL.finditer(data):
            if (stated := _stated(data, found.start())) is not None:
                return stated[0], False
    return None, False


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
