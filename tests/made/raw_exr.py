"""EXR files byte by byte, for what the OpenEXR module cannot write: subsampled channels, levels.

After "OpenEXR File Layout": magic, version, header, table of offsets, chunks; not compressed.
"""

import struct
from pathlib import Path

import numpy as np

KINDS = {"u": 0, "e": 1, "f": 2}  # pixel types by numpy's letters


def attribute(name: str, kind: str, value: bytes) -> bytes:
    return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value


def header(channels: dict, size: tuple[int, int], *more: bytes) -> bytes:
    """`channels`: name -> (array, x sampling, y sampling); `more`: attributes."""
    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", KINDS[plane.dtype.char], 0, x, y)
        for name, (plane, x, y) in sorted(channels.items())
    )
    box = struct.pack("<4i", 0, 0, size[0] - 1, size[1] - 1)
    return b"".join([
        attribute("channels", "chlist", listed + b"\0"),
        attribute("compression", "compression", b"\0"),
        attribute("dataWindow", "box2i", box),
        attribute("displayWindow", "box2i", box),
        attribute("lineOrder", "lineOrder", b"\0"),
        attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
        *more,
        b"\0",
    ])  # fmt: skip


def with_chunks(path: Path, version: int, head: bytes, chunks: list[bytes]) -> Path:
    """The whole file, with the table of offsets of its chunks."""
    begin = struct.pack("<2I", 20000630, version) + head
    at, offsets = len(begin) + 8 * len(chunks), []
    for chunk in chunks:
        offsets.append(at)
        at += len(chunk)
    table = struct.pack(f"<{len(offsets)}Q", *offsets)
    path.write_bytes(begin + table + b"".join(chunks))
    return path


def write_sampled(path: Path, channels: dict, size: tuple[int, int], *more: bytes) -> Path:
    """Scan lines of channels that are stored for every so many pixels."""
    lines = []
    for y in range(size[1]):
        row = b"".join(
            plane[y // step].tobytes()
            for _, (plane, _, step) in sorted(channels.items())
            if y % step == 0
        )
        lines.append(struct.pack("<2i", y, len(row)) + row)
    return with_chunks(path, 2, header(channels, size, *more), lines)


def write_levels(path: Path, planes: dict[str, np.ndarray]) -> Path:
    """A square picture, a power of two wide, in one tile, and its smaller levels of the value 7."""
    side = next(iter(planes.values())).shape[0]
    tiles = attribute("tiles", "tiledesc", struct.pack("<2IB", side, side, 1))
    head = header({name: (plane, 1, 1) for name, plane in planes.items()}, (side, side), tiles)
    chunks, level = [], 0
    while side >> level:
        n = side >> level
        rows = [
            (plane if level == 0 else np.full((n, n), 7, plane.dtype))[y].tobytes()
            for y in range(n)
            for _, plane in sorted(planes.items())
        ]
        data = b"".join(rows)
        chunks.append(struct.pack("<5i", 0, 0, level, level, len(data)) + data)
        level += 1
    return with_chunks(path, 2 | 0x200, head, chunks)
