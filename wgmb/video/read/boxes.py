"""Counts that an MP4 or MOV states, compared with the file before FFmpeg makes an index of them.

Tables of samples, runs of fragments and edit lists say in a few bytes how many entries an index
has (ISO/IEC 14496-12; QuickTime file format for `cmov`). No picture or sound is read here.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from ...errors import InputError
from ...io import limits

_INDICES = b"moov", b"moof"  # that hold all that states counts
_DEEPEST = 16  # boxes in one another
_SOUND_FRAMES = 1024  # of plain sound, which become one entry of the index
_ENTRY = {b"stts": 8, b"ctts": 8, b"stsc": 12, b"stco": 4, b"co64": 8, b"stss": 4, b"stps": 4}
"""Tables that begin with a count, after version and flags, and the bytes of each entry."""
_LEAVES = frozenset((*_ENTRY, b"elst", b"hdlr", b"stsz", b"stz2", b"trun", b"stsd", b"mdat"))
_DURATION, _SIZE, _FLAGS, _OFFSET = 0x100, 0x200, 0x400, 0x800  # fields of each sample of a run
_RUN_FIELDS = _DURATION, _SIZE, _FLAGS, _OFFSET


class Box(NamedTuple):
    """A box of a file: where its contents begin and end, as far as the file goes."""

    kind: bytes
    begin: int
    end: int
    is_whole: bool


def boxes(file: BinaryIO, begin: int, end: int) -> Iterator[Box]:
    """The boxes from `begin` to `end`, up to the first bytes that are no box."""
    while begin + 8 <= end:
        file.seek(begin)
        head = file.read(16)
        if len(head) < 8:
            return
        length, kind, inside = int.from_bytes(head[:4], "big"), head[4:8], begin + 8
        if length == 1 and len(head) == 16:
            length, inside = int.from_bytes(head[8:], "big"), begin + 16
        if length == 0:
            length = end - begin
        if min(begin + length, end) < inside:
            return
        yield Box(kind, inside, min(begin + length, end), begin + length <= end)
        begin += length


def check_counts(path: Path, max_mb: float) -> None:
    """Raise InputError where the boxes of a file state more entries than it can hold.

    Other kinds of file have no boxes, and pass.
    """
    stored = path.stat().st_size
    with open(path, "rb") as file:
        try:
            _Counts(stored, max_mb).read(file, 0, stored)
        except ValueError as error:
            raise InputError(f"{path}: {error}") from None


@dataclass
class _Track:
    """Numbers that one track states."""

    samples: int = 0
    edits: int = 0
    chunks: int = 0
    runs: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    """Runs of chunks of as many samples: the first of them, from 1 on; how many samples; a kind."""
    lengths: tuple[int, int] = 0, 0
    """The number of runs of samples of one duration, and the first one's duration."""
    is_sound: bool = False

    @property
    def entries(self) -> int:
        """Entries of the index that FFmpeg makes of it, at most."""
        once = self.samples
        if self.is_sound and self.lengths == (1, 1):  # plain sound: a part of a chunk is an entry
            once = max(self._blocks(), -(-self.samples // _SOUND_FRAMES))
        return once * max(self.edits, 1)

    def _blocks(self) -> int:
        firsts, counts = self.runs[:, 0], self.runs[:, 1]
        many = np.diff(firsts, append=self.chunks + 1).clip(0, self.chunks)
        return sum((many * -(-counts // _SOUND_FRAMES)).tolist())


class _Counts:
    def __init__(self, stored: int, max_mb: float):
        self._stored, self._max_mb = stored, max_mb
        self._entries = 0
        self._track = _Track()

    def read(self, file: BinaryIO, begin: int, end: int, depth: int = 0) -> None:
        """All boxes from `begin` to `end`, and those in them."""
        for box in boxes(file, begin, end):
            if box.kind == b"trak":
                self._track = _Track()
            if self._holds(file, box, depth):
                self.read(file, box.begin, box.end, depth + 1)
            elif box.kind == b"cmov":
                inside = _inflated(file, box)
                self.read(io.BytesIO(inside), 0, len(inside), depth + 1)
            else:
                self._leaf(file, box)
            if box.kind == b"trak":
                self._add(self._track.entries)

    def _holds(self, file: BinaryIO, box: Box, depth: int) -> bool:
        """Return True for a box that holds others, as `moov` and all that is in it may.

        FFmpeg looks for an index also in boxes that are marked as free.
        """
        if box.kind in (b"free", b"hoov"):
            inner = next(boxes(file, box.begin, box.end), None)
            return inner is not None and inner.kind in (b"mvhd", b"cmov")
        known = box.kind in _LEAVES or box.kind == b"cmov"
        return depth < _DEEPEST and (box.kind in _INDICES if not depth else not known)

    def _add(self, entries: int) -> None:
        self._entries += entries
        limits.check_index(self._entries, self._stored, self._max_mb)

    def _leaf(self, file: BinaryIO, box: Box) -> None:
        file.seek(box.begin)
        length = box.end - box.begin
        head = file.read(min(length, 32))
        if len(head) < 8:
            return
        count, track = int.from_bytes(head[4:8], "big"), self._track
        if (each := _ENTRY.get(box.kind)) and box.is_whole:
            self._check(box.kind, count, each, length - 8)
        if box.kind == b"stts":
            track.lengths = count, int.from_bytes(head[12:16], "big")
        elif box.kind in (b"stco", b"co64"):
            track.chunks = max(track.chunks, count)
        elif box.kind == b"stsc":
            file.seek(box.begin + 8)
            runs = np.frombuffer(file.read(12 * min(count, (length - 8) // 12)), ">u4")
            track.runs = runs.reshape(-1, 3).astype(np.int64)
        elif box.kind == b"elst":
            track.edits = max(track.edits, min(count, length // 12))
        elif box.kind == b"hdlr" and head[8:12] in (b"soun", b"vide"):
            track.is_sound = head[8:12] == b"soun"
        elif box.kind in (b"stsz", b"stz2") and len(head) >= 12:
            self._sizes(box, head, length)
        elif box.kind == b"trun":
            self._run(head, length)

    def _check(self, kind: bytes, count: int, least: int, length: int) -> None:
        limits.held(f"entries of {kind.decode('latin-1')}", count, least, length)

    def _sizes(self, box: Box, head: bytes, length: int) -> None:
        """Sizes of samples: one for each, or one for all, which takes no bytes."""
        size, count = struct.unpack_from(">II", head, 4)
        if box.is_whole and (box.kind == b"stz2" or not size):
            bits = 32 if box.kind == b"stsz" else size & 0xFF
            self._check(box.kind, -(-count * bits // 8), 1, length - 12)
        self._track.samples = max(self._track.samples, count)

    def _run(self, head: bytes, length: int) -> None:
        """A run of samples in a fragment, each of which states none to four numbers."""
        flags, count = int.from_bytes(head[1:4], "big"), int.from_bytes(head[4:8], "big")
        each = 4 * sum(bool(flags & one) for one in _RUN_FIELDS)
        self._check(b"trun", count, each, length - 8)
        self._add(count)


def _inflated(file: BinaryIO, box: Box) -> bytes:
    """The index of an old QuickTime file, which may be compressed: `cmov` holds `cmvd`."""
    for inner in boxes(file, box.begin, box.end):
        if inner.kind == b"cmvd" and inner.end - inner.begin > 4:
            file.seek(inner.begin)
            stated = int.from_bytes(file.read(4), "big")
            packed = file.read(inner.end - inner.begin - 4)
            most = min(stated, limits.LARGEST_INDEX)
            return limits.inflated([packed], most, "its compressed index")
    return b""
