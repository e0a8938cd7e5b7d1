"""The record that every result carries: settings, what was read, and a checksum of the file.

A record is JSON and stands in the file as it is: in an EXR as the attribute `wgmb`, in a PNG as a
text of that keyword, in a TIFF as its description, in a JPEG as its comment. It begins with the
seal, the file's length in bytes and its CRC-32, both taken while the seal's digits are 0. A
file whose seal holds is the whole file that was written, to the last bit.
"""

from __future__ import annotations

import json
import re
import zlib

KEY = "wgmb"  # attribute or keyword of the record
_BLANK = b"0" * 12 + b"-" + b"0" * 8  # length, CRC-32
_BEGIN = b'{"seal": "'
_SEAL = re.compile(re.escape(_BEGIN) + rb"(\d{12}-[0-9a-f]{8})")
_PNG = b"\x89PNG\r\n\x1a\n"
_AFTER_KEYWORD = len(b"tEXt" + KEY.encode() + b"\0")


def blank(content: dict) -> str:
    """The record's text, to be put into a file that is then sealed."""
    return json.dumps({"seal": _BLANK.decode(), **dict(sorted(content.items()))})


def seal(data: bytes, text: str) -> bytes:
    """The file with the digits of the seal set; `text` is the record that it was made with."""
    record = text.encode()
    at = data.find(record)
    if at < 0:
        raise ValueError("the record is not in the file")
    return _sealed(data, at, at + len(record))


def read(data: bytes) -> dict | None:
    """The content of the record of a file that is whole; None where there is none or it is not."""
    for found in _SEAL.finditer(data):
        text = data[found.start() : found.start() + 65536].decode("latin-1")
        try:
            content, length = json.JSONDecoder().raw_decode(text)
        except (ValueError, RecursionError):
            continue
        if _sealed(data, found.start(), found.start() + length) == data:
            del content["seal"]
            return content
    return None


def is_ours(data: bytes) -> bool:
    """Whether a file, damaged or not, has the beginning of a record, or nothing at all in it."""
    return _SEAL.search(data) is not None or not data.strip(b"\0")


def _sealed(data: bytes, begin: int, end: int) -> bytes:
    digits = begin + len(_BEGIN)
    sealed = bytearray(data)
    for value in (_BLANK, None):
        if value is None:
            value = f"{len(sealed):012d}-{zlib.crc32(sealed):08x}".encode()
        sealed[digits : digits + len(_BLANK)] = value
        if data.startswith(_PNG):  # the text is a chunk, which has a CRC of its own
            chunk = sealed[begin - _AFTER_KEYWORD : end]
            sealed[end : end + 4] = zlib.crc32(chunk).to_bytes(4, "big")
    return bytes(sealed)
