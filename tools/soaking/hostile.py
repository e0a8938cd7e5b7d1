"""Files made to do harm: absurd headers, and few bytes that promise many."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from make_frames import attribute_bytes
from wgmb import InputError
from wgmb.io import exr as wgmb_exr

from .processes import Ended, apart, limits, wgmb
from .table import Line, Tally, Trial, row

_HALF, _FLOAT = 1, 2
_NONE, _ZIP = 0, 3
_MEMORY = 4096  # MiB of address space that a command gets
_PEAK, _SECONDS = 1024, 30  # MiB, s: more is a fault
Channels = list[tuple[bytes, int]]
RGB: Channels = [(b"B", _HALF), (b"G", _HALF), (b"R", _HALF)]


def exr(
    channels: Channels = RGB,
    window: tuple[int, int, int, int] = (0, 0, 7, 3),
    *,
    compression: int = _NONE,
    sampling: tuple[int, int] = (1, 1),
    more: bytes = b"",
    version: int = 2,
    without: str = "",
    chunks: list[tuple[int, bytes]] | None = None,
    offsets: list[int] | None = None,
) -> bytes:
    """An EXR file as it is on disk, of scan lines; nothing is checked.

    `more`: further attributes. `without`: a required one to leave out. `chunks`: first row
    and data of each; `offsets` instead of where they are.
    """
    listed = b"".join(
        name + b"\0" + struct.pack("<iiii", kind, 0, *sampling) for name, kind in channels
    )
    box, one = struct.pack("<iiii", *window), struct.pack("<f", 1)
    attributes = {
        "channels": ("chlist", listed + b"\0"),
        "compression": ("compression", bytes([compression])),
        "dataWindow": ("box2i", box),
        "displayWindow": ("box2i", box),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", one),
        "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": ("float", one),
    }
    attributes.pop(without, None)
    head = struct.pack("<ii", 20000630, version)
    head += b"".join(attribute_bytes(n, *rest) for n, rest in attributes.items()) + more + b"\0"
    if chunks is None:
        width, rows = window[2] - window[0] + 1, range(window[1], window[3] + 1)
        chunks = [(y, bytes(sum(2 if k == _HALF else 4 for _, k in channels) * width))
                  for y in rows]  # fmt: skip
    at, table, body = len(head) + 8 * len(chunks), [], b""
    for y, data in chunks:
        table.append(at + len(body))
        body += struct.pack("<ii", y, len(data)) + data
    return head + np.array(offsets or table, "<u8").tobytes() + body


def _text(name: bytes, value: bytes) -> bytes:
    return name + b"\0string\0" + struct.pack("<i", len(value)) + value


def _texts(count: int) -> bytes:
    return b"".join(_text(b"a%05d" % i, b"x") for i in range(count))


def _wide(count: int) -> Channels:
    return [(f"c{i:05d}.R".encode(), _HALF) for i in range(count)]


_ROW: list[tuple[int, bytes]] = [(0, bytes(48))]
HEADERS = {
    "a window of 2^31": lambda: exr(window=(0, 0, 2**31 - 1, 0), chunks=_ROW),
    "a window of 2^31 rows": lambda: exr(window=(0, 0, 0, 2**31 - 1), chunks=_ROW),
    "a window from -2^31 on": lambda: exr(window=(-(2**31), -(2**31), 7, 7), chunks=_ROW),
    "a window inside out": lambda: exr(window=(7, 3, 0, 0), chunks=_ROW),
    "a window at the end": lambda: exr(window=(2**31 - 8, 0, 2**31 - 1, 3), chunks=_ROW),
    "a window at -3": lambda: exr(window=(-3, -2, 4, 1)),
    "10,000 channels": lambda: exr(_wide(10_000), (0, 0, 1, 1)),
    "20,000 attributes": lambda: exr(more=_texts(20_000)),
    "an attribute of 64 MiB": lambda: exr(more=_text(b"large", bytes(64 << 20))),
    "an attribute beyond the file": lambda: exr(more=b"a\0string\0\xff\xff\xff\x7f"),
    "an attribute of -1 bytes": lambda: exr(more=b"a\0string\0\xff\xff\xff\xff"),
    "an attribute that is not UTF-8": lambda: exr(more=_text(b"owner", b"\xff\xfe\x80")),
    "a type that is not UTF-8": lambda: exr(more=b"owner\0str\xffng\0\1\0\0\0x"),
    "a type that is unknown": lambda: exr(more=b"owner\0thing\0\1\0\0\0x"),
    "an escape sequence in a name": lambda: exr([*RGB, (b"a\x1b[31mRED\x1b]0;title\x07.R", _HALF)]),
    "an escape sequence in an attribute": lambda: exr(more=_text(b"owner", b"\x1b]0;title\x07")),
    "letters that turn the line round": lambda: exr([*RGB, ("a\u202egnp.R".encode(), _HALF)]),
    "a name that is not UTF-8": lambda: exr([*RGB, (b"\xff\xfe.R", _HALF)]),
    "a name of 255 letters": lambda: exr([*RGB, (b"x" * 255, _HALF)], version=2 | 0x400),
    "a name of 10,000 letters": lambda: exr([*RGB, (b"x" * 10_000, _HALF)], version=2 | 0x400),
    "a name twice": lambda: exr([*RGB, (b"R", _FLOAT)]),
    "no channels": lambda: exr([]),
    "no compression said": lambda: exr(without="compression"),
    "no window said": lambda: exr(without="dataWindow"),
    "sampling 0": lambda: exr(sampling=(0, 0)),
    "sampling 2": lambda: exr(sampling=(2, 2)),
    "sampling -1": lambda: exr(sampling=(-1, -1)),
    "a kind of pixel that is none": lambda: exr([(b"R", 99), (b"G", 99), (b"B", 99)]),
    "a compression that is none": lambda: exr(compression=255),
    "a version to come": lambda: exr(version=250),
    "many parts, none there": lambda: exr(version=2 | 0x1000),
    "offsets of 0": lambda: exr(offsets=[0, 0, 0, 0]),
    "offsets beyond the file": lambda: exr(offsets=[1 << 60] * 4),
    "rows outside the window": lambda: exr(chunks=[(y + 1000, bytes(48)) for y in range(4)]),
    "a chunk that is too long": lambda: exr(chunks=[(y, bytes(480)) for y in range(4)]),
    "ZIP that is none": lambda: exr(compression=_ZIP, chunks=[(0, b"\xff" * 60)]),
}  # fmt: skip


def _told(ended: Ended, path: Path) -> str:
    """The fault in a command's reaction to a hostile file."""
    if wrong := ended.wrong(0, 2, name=str(path)):
        return wrong
    if ended.peak > _PEAK:
        return f"{ended.peak:.0f} MiB"
    return f"{ended.seconds:.0f} s" if ended.seconds > _SECONDS else ""


def rewritten(path: str) -> str:
    """In a process of its own: what is wrong with reading a file and writing it again."""
    try:
        wgmb_exr.encode(wgmb_exr.read(path))
    except InputError as error:
        return "" if path in str(error) else f"does not name it: {error}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


@row(full=len(HEADERS))
def headers(trial: Trial) -> Iterator[Line]:
    """EXR files with absurd headers: shown or refused, within bounds, no control characters."""
    tally, slowest, largest = Tally("adversarial EXR", "files"), (0.0, ""), (0.0, "")
    again = Tally("the same, read and written again", "files")
    for number, name in enumerate(trial.some(HEADERS)):
        path = trial.folder / f"{number}.exr"
        path.write_bytes(HEADERS[name]())
        ended = wgmb("info", path, prepare=limits(memory=_MEMORY))
        slowest = max(slowest, (ended.seconds, name))
        largest = max(largest, (ended.peak, name))
        tally.note(name, _told(ended, path))
        ended = apart(rewritten, str(path), prepare=limits(memory=_MEMORY))
        again.note(name, ended.wrong(0) or ended.value)
        path.unlink()
    yield tally.line(
        f"slowest {slowest[0]:.1f} s ({slowest[1]}), largest {largest[0]:.0f} MiB ({largest[1]})"
    )
    yield again.line()


# ---- few bytes that promise many ------------------------------------------------------------


def _zeros_exr(width: int, height: int, channels: Channels) -> bytes:
    """An EXR of zeros, ZIP compressed: 16 rows, over and over."""
    count = width * 16 * sum(2 if kind == _HALF else 4 for _, kind in channels)
    data = zlib.compress(b"\0" + b"\x80" * (count - 1), 9)  # after the predictor
    rows = [(y, data) for y in range(0, height - 15, 16)]
    return exr(channels, (0, 0, width - 1, 16 * len(rows) - 1), compression=_ZIP, chunks=rows)


def _zeros_png(side: int) -> bytes:
    deflate = zlib.compressobj(9)
    rows = [deflate.compress(bytes(1 + 3 * side)) for _ in range(side)]

    def chunk(kind: bytes, body: bytes) -> bytes:
        crc = zlib.crc32(kind + body)
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", crc)

    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    packed = b"".join(rows) + deflate.flush()
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
    )


def _zeros_tiff(side: int, rows: int = 100) -> bytes:
    """RGB strips of zeros, one after the other."""
    strip, count = zlib.compress(bytes(3 * side * rows), 9), side // rows
    at, entries = 8 + 2 + 10 * 12 + 4, b""
    places = np.arange(count) * len(strip) + at + 8 * count + 6
    for tag, kind, number, value in (
        (256, 4, 1, side), (257, 4, 1, rows * count), (258, 3, 3, at + 8 * count),
        (259, 3, 1, 8), (262, 3, 1, 2), (273, 4, count, at), (277, 3, 1, 3), (278, 4, 1, rows),
        (279, 4, count, at + 4 * count), (284, 3, 1, 1),
    ):  # fmt: skip
        entries += struct.pack("<HHII", tag, kind, number, value)
    table = places.astype("<u4").tobytes() + np.full(count, len(strip), "<u4").tobytes()
    head = b"II*\0" + struct.pack("<IH", 8, 10) + entries + bytes(4)
    return head + table + struct.pack("<HHH", 8, 8, 8) + strip * count


_RGBA_FLOAT: Channels = [(c, _FLOAT) for c in (b"A", b"B", b"G", b"R")]
BOMBS = {
    "16384 x 16384.exr": lambda: _zeros_exr(16384, 16384, RGB),
    "32767 x 32752.exr": lambda: _zeros_exr(32767, 32767, _RGBA_FLOAT),
    "16384 x 16384.png": lambda: _zeros_png(16384),
    "16000 x 16000.tif": lambda: _zeros_tiff(16000),
}


@row(full=len(BOMBS))
def bombs(trial: Trial) -> Iterator[Line]:
    """Small files of enormous pictures, with little memory: refused with a word that is true."""
    tally, slowest, largest = Tally("zip bombs", "files"), 0.0, 0.0
    sizes = []
    for name in trial.some(BOMBS):
        path = trial.folder / name
        path.write_bytes(BOMBS[name]())
        sizes.append(f"{name}: {path.stat().st_size / 1e6:.1f} MB")
        ended = wgmb("info", path, prepare=limits(memory=_MEMORY), seconds=300)
        slowest, largest = max(slowest, ended.seconds), max(largest, ended.peak)
        false = "said to be damaged" if "damaged" in ended.err else ""
        tally.note(name, ended.wrong(0, 2, name=str(path)) or false or _told(ended, path))
        path.unlink()
    yield tally.line(f"{slowest:.1f} s, {largest:.0f} MiB; {', '.join(sizes)}")
