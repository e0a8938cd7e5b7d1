"""EXR files whose stated numbers are too large, for `stated`: flat, tiled, deep and in parts."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

import make_frames as make
from raw_exr import write_levels, write_sampled
from wgmb.io import exr as wgmb_exr

from . import StatedKind, copies, too_large

_MANY_PARTS = 0x1000
Place = tuple[str, int, str]  # name, offset, form


def exr(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Every number of the headers, of the tables of offsets and of some chunks' headers."""
    (version,) = struct.unpack_from("<I", data, 4)
    many, at = bool(version & _MANY_PARTS), 8
    places: list[Place] = [("version", 4, "<I")]
    chunks = 0
    while data[at]:
        values, at = _header(data, at)
        places += values
        chunks += 1
        if not many:
            break
    at += many
    first = struct.unpack_from("<Q", data, at)[0]
    count = (first - at) // 8
    places += [(f"offset {i}", at + 8 * i, "<Q") for i in {0, count // 2, count - 1}]
    for index in {0, count - 1}:
        (chunk,) = struct.unpack_from("<Q", data, at + 8 * index)
        places += [(f"chunk {index} at {4 * i}", chunk + 4 * i, "<I") for i in range(5 + many)]
        places += [(f"chunk {index}, 64 bits at {4 * i}", chunk + 4 * i, "<Q") for i in (1, 3, 5)]
    for name, place, form in places:
        for value, changed in too_large(data, place, form, less=(0,)):
            yield f"{name} {value}", changed


def _header(data: bytes, at: int) -> tuple[list[Place], int]:
    """Places of the numbers of a header, and the offset behind it."""
    places: list[Place] = []
    while data[at]:
        kind = data.index(b"\0", at) + 1
        size = data.index(b"\0", kind) + 1
        name, value = data[at : kind - 1].decode(), data[kind : size - 1].decode()
        (length,) = struct.unpack_from("<i", data, size)
        at = size + 4
        places.append((f"size of {name}", size, "<I"))
        if value in ("box2i", "int", "rational", "preview", "timecode", "stringvector"):
            places += [(f"{name} at {i}", at + i, "<i") for i in range(0, min(length, 16), 4)]
        elif value == "tiledesc":
            places += [(f"{name} x", at, "<I"), (f"{name} y", at + 4, "<I")]
            places.append((f"{name} mode", at + 8, "<B"))
        elif value == "compression":
            places.append((name, at, "<B"))
        elif value == "idmanifest":
            places.append((name, at, "<I"))
        elif value == "chlist":
            first = data.index(b"\0", at) + 1
            places += [(f"channel at {i}", first + i, "<i") for i in (0, 8, 12)]
        at += length
    return places, at + 1


def _commands(path: Path, output: Path) -> list[list[Any]]:
    return [["info", path], ["blur", path, "-o", output, "--method", "tap", "--overwrite", "-q"]]


def _pixels(path: Path) -> str:
    planes = wgmb_exr.read(path).channels()
    hashed = hashlib.sha256()
    for name in sorted(planes):
        hashed.update(np.ascontiguousarray(planes[name]).tobytes())
    return hashed.hexdigest()


def _flat(path: Path, **header: Any) -> None:
    make.write_exr(path, make.frame(2), {"multiView": ["left"], "note": "x" * 40}, **header)


def _tiled(mode: object) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        tiles = OpenEXR.TileDescription()
        tiles.xSize = tiles.ySize = 16
        tiles.mode = mode
        header = {"type": OpenEXR.tiledimage, "tiles": tiles}
        planes = {k: np.ascontiguousarray(v) for k, v in make.frame(2).items()}
        OpenEXR.File(header, planes).write(str(path))

    return write


def _levels(path: Path) -> None:
    planes = {k: np.ascontiguousarray(v[:32, :32]) for k, v in make.frame(2).items()}
    write_levels(path, planes)


def _sampled(path: Path) -> None:
    rows = make.frame(2)
    planes = {c: (rows[f"ViewLayer.Vector.{c}"], 1, 1) for c in "XYZW"}
    planes = {f"ViewLayer.Vector.{c}": each for c, each in planes.items()}
    picture = make.picture(2).astype(np.float16)
    planes["Y"] = np.ascontiguousarray(picture[..., 1]), 1, 1
    for i, name in ((0, "RY"), (2, "BY")):
        planes[name] = np.ascontiguousarray(picture[::2, ::2, i] * np.float16(0)), 2, 2
    write_sampled(path, planes, (make.WIDTH, make.HEIGHT))


def _deep(kind: object) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        header: dict[str, Any] = {"type": kind, "compression": OpenEXR.ZIPS_COMPRESSION}
        if kind == OpenEXR.deeptile:
            header["tiles"] = OpenEXR.TileDescription()
            header["tiles"].xSize = header["tiles"].ySize = 16
        planes = {}
        for name, plane in make.frame(2).items():
            planes[name] = np.empty(plane.shape, object)
            for place in np.ndindex(*plane.shape):
                planes[name][place] = np.repeat(plane[place], 2)
        OpenEXR.File(header, planes).write(str(path))

    return write


def _parts(path: Path) -> None:
    picture = make.colors(make.picture(2))
    motion = make.written("nuke", *make.motion(2))
    make.write_parts(path, [make.part(picture, name="rgba"), make.part(motion, name="motion")])


def _kind(write: Callable[[Path], object]) -> StatedKind:
    return StatedKind(".exr", write, exr, _commands, _pixels, copies.exr, ".exr", ".exr")


KINDS = {
    "exr": _kind(_flat),
    "exr-piz": _kind(lambda path: _flat(path, compression=OpenEXR.PIZ_COMPRESSION)),
    "exr-dwaa": _kind(lambda path: _flat(path, compression=OpenEXR.DWAA_COMPRESSION)),
    "exr-tiled": _kind(_tiled(OpenEXR.ONE_LEVEL)),
    "exr-levels": _kind(_levels),
    "exr-sampled": _kind(_sampled),
    "exr-deep": _kind(_deep(OpenEXR.deepscanline)),
    "exr-deep-tiled": _kind(_deep(OpenEXR.deeptile)),
    "exr-parts": _kind(_parts),
}
