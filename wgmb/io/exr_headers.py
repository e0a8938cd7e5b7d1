"""The headers of an EXR file, attribute by attribute, without their values.

Values are passed over, so that a header of any length takes no memory. "OpenEXR File Layout".
"""

from __future__ import annotations

import io
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from . import limits

_MANY_PARTS = 0x1000
_MOST_ATTRIBUTES = 1 << 16  # of a part
_LONGEST_NAME = 255  # bytes, of an attribute or its type


class Attribute(NamedTuple):
    """An attribute of a part, and the place of its value in the file [bytes]."""

    name: str
    kind: str
    begin: int
    length: int


def read(file: BinaryIO) -> tuple[bool, list[list[Attribute]], int]:
    """True for the form with many parts, the attributes of each part, and the offset behind them.

    ValueError, IndexError or struct.error where the headers are not whole.
    """
    stored = file.seek(0, os.SEEK_END)
    file.seek(0)
    _, version = struct.unpack("<2I", file.read(8))
    many, parts = bool(version & _MANY_PARTS), []
    while (part := list(_attributes(file, stored))) or not parts:
        parts.append(part)
        if not many:
            break
        if len(parts) > limits.MOST_CHANNELS:
            raise ValueError(f"over {limits.MOST_CHANNELS} parts")
    return many, parts, file.tell()


def _attributes(file: BinaryIO, stored: int) -> Iterator[Attribute]:
    """The attributes of one header; there are none in the one behind the last part's."""
    for _ in range(_MOST_ATTRIBUTES):
        begin = file.tell()
        text = file.read(2 * _LONGEST_NAME + 6)  # name, type, size
        if not text[0]:
            file.seek(begin + 1)
            return
        kind = text.index(b"\0") + 1
        size = text.index(b"\0", kind) + 1
        (length,) = struct.unpack_from("<I", text, size)
        limits.held("bytes of an attribute", length, 1, stored - begin)
        name = text[: kind - 1].decode("utf-8", "replace")
        yield Attribute(name, text[kind : size - 1].decode("latin-1"), begin + size + 4, length)
        file.seek(begin + size + 4 + length)
    raise ValueError(f"over {_MOST_ATTRIBUTES} attributes")


def with_rationals(path: Path) -> tuple[io.BytesIO, set[str]]:
    """The file with 1 for every denominator that is 0, and the names of those attributes.

    Python has no number for them, and the library none for Python.
    """
    data, names = bytearray(path.read_bytes()), set()
    _, parts, _ = read(io.BytesIO(data))
    for attribute in (each for part in parts for each in part):
        if attribute.kind == "rational" and attribute.length == 8:
            (denominator,) = struct.unpack_from("<I", data, attribute.begin + 4)
            if not denominator:
                struct.pack_into("<I", data, attribute.begin + 4, 1)
                names.add(attribute.name)
    return io.BytesIO(data), names
