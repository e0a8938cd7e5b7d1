"""Videos whose stated numbers are too large, for `stated`.

Of MP4, MOV, Matroska, AVI and the others whose structure is walked here, every number in a header
or a table; of other kinds, each of the first bytes as a number of 2, 4 and 8 bytes.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av

import make_clips as clips

from . import Mutations, StatedKind, copies

_MANY = 30_000_000, 80_000_000  # entries: 2 GB and more of an index in memory
_LARGE = {
    1: (0x7F, 0xFF),
    2: (0x7FFF, 0xFFFF),
    4: (*_MANY, 2**31 - 1, 2**32 - 1),
    8: (_MANY[1], 2**63 - 1, 2**64 - 1),
}
_SIZE = 64, 48
_ROUNDED = 0.0021  # s, by which times of Matroska files may differ
_HEAD = 512  # bytes of a kind whose structure is not walked here


def _changed(data: bytes, at: int, size: int, order: str) -> Iterator[tuple[str, bytes]]:
    """The number of `size` bytes at `at` made too large."""
    for value in _LARGE[size]:
        changed = data[:at] + value.to_bytes(size, order) + data[at + size :]  # type: ignore[arg-type]
        if changed != data:
            yield f"{value}", changed


def everywhere(order: str, end: int = _HEAD) -> Mutations:
    """Every 2 and 4 bytes of a beginning as a number."""

    def mutations(data: bytes) -> Iterator[tuple[str, bytes]]:
        for at in range(min(end, len(data) - 8)):
            for size in (2, 4):
                if not at % 2:
                    for value, changed in _changed(data, at, size, order):
                        yield f"{size} bytes at {at}: {value}", changed

    return mutations


# ---- MP4 and MOV ------------------------------------------------------------------------------

_HOLDS = {  # boxes that hold boxes, and the bytes before these
    b"moov": 0, b"trak": 0, b"mdia": 0, b"minf": 0, b"dinf": 0, b"stbl": 0, b"edts": 0, b"udta": 0,
    b"moof": 0, b"traf": 0, b"mvex": 0, b"mfra": 0, b"ilst": 0, b"meta": 4, b"dref": 8, b"stsd": 8,
    b"avc1": 78, b"mp4a": 28, b"av01": 78, b"iprp": 0, b"ipco": 0, b"iref": 4, b"tref": 0,
}  # fmt: skip
_WORDS = 40  # bytes of a box that are numbers, at most


def boxes(
    data: bytes, begin: int = 0, end: int | None = None, path: str = ""
) -> Iterator[tuple[str, int, int, int]]:
    """Path, begin, begin of the contents and end of every box."""
    end = len(data) if end is None else end
    while begin + 8 <= end:
        size, kind = struct.unpack_from(">I4s", data, begin)
        head = 8
        if size == 1:
            size, head = struct.unpack_from(">Q", data, begin + 8)[0], 16
        if not head <= size <= end - begin:
            return
        name = f"{path}/{kind.decode('latin-1')}"
        yield name, begin, begin + head, begin + size
        if kind in _HOLDS:
            yield from boxes(data, begin + head + _HOLDS[kind], begin + size, name)
        begin += size


def mp4(data: bytes) -> Iterator[tuple[str, bytes]]:
    """The size of every box, each number of its first bytes, and tables that agree on a count."""
    yield from _agreeing(data)
    for name, begin, inside, end in boxes(data):
        for value, changed in _changed(data, begin, 4, "big"):
            yield f"size of {name} {value}", changed
        if name == "/mdat" or name.rpartition("/")[2].encode("latin-1") in _HOLDS:
            continue
        for at in range(inside, min(end, inside + _WORDS) - 3, 4):
            for value, changed in _changed(data, at, 4, "big"):
                yield f"{name} + {at - inside}: {value}", changed


def _agreeing(data: bytes) -> Iterator[tuple[str, bytes]]:
    """All samples of one size, and as many of them in every table."""
    for track in sorted({name.rpartition("/")[0] for name, *_ in boxes(data) if "/stsz" in name}):
        for count in (*_MANY, 2**31 - 1):
            for size in (0, 1):
                yield f"{track}: {count} samples of {size}", with_tables(data, count, size)


def with_tables(data: bytes, count: int, size: int) -> bytes:
    """An MP4 whose tracks state `count` samples of `size` bytes in all their tables."""
    bodies = {
        b"stsz": struct.pack(">III", 0, size, count),
        b"stsc": struct.pack(">IIIII", 0, 1, 1, count, 1),
        b"stts": struct.pack(">IIII", 0, 1, count, 1),
        b"ctts": struct.pack(">IIII", 0, 1, count, 1),
    }
    changed = bytearray(data)
    for name, begin, inside, end in boxes(data):
        body = bodies.get(kind := name.rpartition("/")[2].encode("latin-1"))
        if body is not None and len(body) <= end - inside:
            changed[inside : inside + len(body)] = body
        elif body is not None and kind != b"stsz":
            changed[begin + 4 : begin + 8] = b"free"
    return bytes(changed)


# ---- Matroska ---------------------------------------------------------------------------------

_MASTERS = {
    0x18538067, 0x114D9B74, 0x4DBB, 0x1549A966, 0x1654AE6B, 0xAE, 0xE0, 0xE1, 0x1C53BB6B, 0xBB,
    0xB7, 0x1F43B675, 0xA0, 0x1254C367, 0x7373, 0x63C0, 0x67C8, 0x1941A469, 0x61A7, 0x1A45DFA3,
    0x1043A770, 0x45B9, 0xB6, 0x6D80, 0x6240, 0x5034, 0x55B0,
}  # fmt: skip


def _number(data: bytes, at: int, keep: bool) -> tuple[int, int]:
    """An EBML number at `at` and its length; `keep` its marker, as of an id."""
    length = 9 - data[at].bit_length() if data[at] else 9
    value = int.from_bytes(data[at : at + length], "big")
    return (value if keep else value & ((1 << 7 * length) - 1)), length


def elements(
    data: bytes, begin: int = 0, end: int | None = None
) -> Iterator[tuple[int, int, int, int]]:
    """Id, begin of the size, begin of the contents and end of every element."""
    end = len(data) if end is None else end
    while begin + 2 <= end:
        name, many = _number(data, begin, True)
        size, length = _number(data, begin + many, False)
        inside = begin + many + length
        if size == (1 << 7 * length) - 1:
            size = end - inside
        if many > 4 or length > 8 or inside + size > end:
            return
        yield name, begin + many, inside, inside + size
        if name in _MASTERS:
            yield from elements(data, inside, inside + size)
        begin = inside + size


def matroska(data: bytes) -> Iterator[tuple[str, bytes]]:
    """The size of every element, each number, and the head of each block."""
    for name, sized, inside, end in elements(data):
        length = inside - sized
        for value in (2 ** (7 * length) - 2, 2 ** (7 * length - 1) - 1):
            size = (value | 1 << 7 * length).to_bytes(length, "big")
            yield f"size of {name:X} {value}", data[:sized] + size + data[inside:]
        if name in _MASTERS or (end - inside > 64 and name not in (0xA3, 0xA1)):
            continue
        if (size := end - inside) in _LARGE:
            for value, changed in _changed(data, inside, size, "big"):
                yield f"{name:X} {value}", changed
        if name in (0xA3, 0xA1) and size > 16:  # a block: lacing, and how many frames
            for lacing in (0x82, 0x84, 0x86):
                block = data[: inside + 3] + bytes((lacing, 255)) + b"\xff" * 4
                yield f"lacing {lacing:X} at {inside}", block + data[inside + 9 :]


# ---- AVI --------------------------------------------------------------------------------------


def chunks(
    data: bytes, begin: int = 0, end: int | None = None
) -> Iterator[tuple[str, int, int, int]]:
    """Name, begin, begin of the contents and end of every chunk of a RIFF file."""
    end = len(data) if end is None else end
    while begin + 8 <= end:
        kind, size = struct.unpack_from("<4sI", data, begin)
        if size > end - begin - 8:
            return
        yield kind.decode("latin-1"), begin, begin + 8, begin + 8 + size
        if kind in (b"RIFF", b"LIST"):
            yield from chunks(data, begin + 12, begin + 8 + size)
        begin += 8 + size + size % 2


def riff(data: bytes) -> Iterator[tuple[str, bytes]]:
    """The size of every chunk, and each number of its first bytes."""
    for name, begin, inside, end in chunks(data):
        for value, changed in _changed(data, begin + 4, 4, "little"):
            yield f"size of {name} {value}", changed
        for at in range(inside, min(end, inside + 64) - 3, 4):
            for value, changed in _changed(data, at, 4, "little"):
                yield f"{name} + {at - inside}: {value}", changed


# ---- kinds ------------------------------------------------------------------------------------


def _commands(path: Path, output: Path) -> list[list[Any]]:
    plain = "--flow", "none", "--overwrite", "--codec", "ffv1", "-q"
    return [["info", path], ["blur", path, "-o", output, *plain]]


def _pictures(path: Path) -> str:
    """Times and hashes of all pictures of an output, as text."""
    with av.open(str(path)) as file:
        frames = list(file.decode(video=0))
    pixels = [one.to_ndarray(format="rgb48le").tobytes() for one in frames]
    return json.dumps([
        [one.time - frames[0].time for one in frames],
        [hashlib.sha256(each).hexdigest() for each in pixels],
    ])  # fmt: skip


def _same(first: str, second: str) -> bool:
    """Return True for the same pictures at the same times, which Matroska rounds."""
    if not first or not second:
        return first == second
    (times, pictures), (others, their) = json.loads(first), json.loads(second)
    return (
        pictures == their
        and len(times) == len(others)
        and all(abs(a - b) <= _ROUNDED for a, b in zip(times, others, strict=True))
    )


def _video(codec: str, pixels: str = "yuv420p", **more: Any) -> Callable[[Path], object]:
    def write(path: Path) -> object:
        made = [clips.frame(clips.planes(n, _SIZE), "yuv420p") for n in range(6)]
        made = [one.reformat(format=pixels) for one in made]
        return clips.write(path, made, codec=codec, pixels=pixels, **more)

    return write


_FRAGMENTS = {"movflags": "frag_keyframe+empty_moov+default_base_moof", "write_tmcd": "0"}


def _kind(
    suffix: str, write: Callable[[Path], object], mutations: Mutations, copied: str = ".mkv"
) -> StatedKind:
    return StatedKind(
        suffix, write, mutations, _commands, _pictures, copies.video, copied, ".mkv", _same
    )


KINDS = {
    "mp4": _kind(".mp4", _video("libx264", tone=0.25), mp4),
    "mov": _kind(".mov", _video("mjpeg", "yuvj420p", tone=0.25), mp4),
    "fragments": _kind(".mp4", _video("libx264", tone=0.25, muxing=_FRAGMENTS), mp4),
    "avif": _kind(".avif", _video("libsvtav1", options={"preset": "12"}), mp4),
    "matroska": _kind(".mkv", _video("ffv1", tone=0.25), matroska),
    "webm": _kind(".webm", _video("libvpx-vp9", options={"cpu-used": "8"}), matroska),
    "avi": _kind(".avi", _video("mpeg4", tick=Fraction(1, 24)), riff),
    "ts": _kind(".ts", _video("mpeg2video", tick=Fraction(1, 24)), everywhere("big", 188 * 4)),
    "gif": _kind(
        ".gif",
        _video("gif", "rgb8", tick=Fraction(1, 100), rate=Fraction(25)),
        everywhere("little"),
        ".nut",
    ),
    "apng": _kind(".apng", _video("apng", "rgb24", tick=Fraction(1, 24)), everywhere("big")),
    "flv": _kind(".flv", _video("flv", tick=Fraction(1, 24)), everywhere("big")),
    "nut": _kind(".nut", _video("mpeg4", tick=Fraction(1, 24)), everywhere("big")),
    "mxf": _kind(".mxf", _video("mpeg2video", tick=Fraction(1, 24)), everywhere("big", 1024)),
    "asf": _kind(".asf", _video("wmv2", tick=Fraction(1, 1000)), everywhere("little", 1024)),
    "ivf": _kind(
        ".ivf",
        _video("libvpx", options={"cpu-used": "8"}, tick=Fraction(1, 24)),
        everywhere("little", 64),
        ".nut",
    ),
    "y4m": _kind(
        ".y4m",
        _video("wrapped_avframe", kind="yuv4mpegpipe", tick=Fraction(1, 24)),
        everywhere("big", 128),
    ),
}
