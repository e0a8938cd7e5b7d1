"""Facts that FFmpeg reads from no Matroska file."""

from __future__ import annotations

from pathlib import Path

_EBML, _CHAPTERS = b"\x1a\x45\xdf\xa3", b"\x10\x43\xa7\x70"
_ORDERED = b"\x45\xdd\x81\x01"  # EditionFlagOrdered, of 1 byte: 1
_LOOKED_AT = 1 << 20  # bytes at the beginning, where programs put chapters


def has_ordered_chapters(path: Path) -> bool:
    """Return True if chapters say in which order the parts of a file are played (RFC 9559).

    OSError if the file cannot be read.
    """
    with open(path, "rb") as file:
        data = file.read(_LOOKED_AT)
    at = data.find(_CHAPTERS)
    if not data.startswith(_EBML) or at < 0:
        return False
    content = data[at + len(_CHAPTERS) :]
    return _ORDERED in content[: _size(content) + 8]


def _size(data: bytes) -> int:
    """The size that an element states, whose length is in its leading bits; 0 if it has none."""
    length = 9 - data[0].bit_length() if data and data[0] else 0
    return int.from_bytes(data[:length]) & ((1 << 7 * length) - 1) if length else 0
