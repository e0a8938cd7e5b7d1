"""Deep pixels, each with any number of samples, to flat ones: the nearest over those behind it.

Colour is premultiplied and laid over (Porter and Duff 1984) in the order of Z; every other
channel, depth and vectors too, has the value of the nearest sample. A volume (ZBack) counts as
a point at its front. OpenEXR, "Interpreting OpenEXR Deep Pixels".
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import InputError
from . import exr_headers, limits

_COLORS = ("r", "g", "b", "a", "y", "red", "green", "blue", "alpha")
_NOT_COLORS = {"n", "normal", "normals", "p", "position", "id"}
_MOST_HALF = float(np.finfo(np.float16).max)
_OBJECT = 256  # bytes that the library takes for a pixel's samples of a channel, beside them
_MOST = 1 << 40  # bytes of a chunk: more is damage
_MOST_CHUNKS = 1 << 18  # of a part: 8192 x 8192 pixels in tiles of 16


@np.errstate(all="ignore")  # samples may be anything
def flatten(
    channels: Mapping[str, np.ndarray], data_layers: Collection[str] = ()
) -> dict[str, np.ndarray]:
    """(height, width) planes from (height, width) arrays of samples, None where there are none.

    Where a pixel is empty its depth is infinite, and all else 0. InputError where the channels
    of a pixel have different numbers of samples. `data_layers`: names of layers, their last parts
    in lower case, that hold no colours either, such as vectors.
    """
    first, shape = next(iter(channels)), next(iter(channels.values())).shape
    filled = [
        i for i, samples in enumerate(channels[first].ravel().tolist()) if samples is not None
    ]
    counts = np.zeros(shape[0] * shape[1], np.int64)
    values: dict[str, np.ndarray] = {}
    for name, pixels in channels.items():
        there = [samples for samples in pixels.ravel().tolist() if samples is not None]
        lengths = np.fromiter(map(len, there), np.int64, len(there))
        if name == first:
            counts[filled] = lengths
        elif not np.array_equal(lengths, counts[filled]):
            raise InputError(f"channels {first} and {name} do not have the same samples")
        values[name] = np.concatenate(there) if there else np.empty(0, np.float32)
    starts = np.cumsum(counts) - counts
    orders: dict[str | None, np.ndarray] = {}
    planes: dict[str, np.ndarray] = {}
    seen: dict[tuple[str | None, str | None], np.ndarray] = {}
    for name, samples in values.items():
        depth, alpha = companion(name, "Z", channels), companion(name, "A", channels)
        if depth not in orders:
            orders[depth] = _order(values[depth] if depth else None, counts)
        ordered = samples[orders[depth]]
        if _is_color(name, data_layers):
            key = depth, alpha
            if key not in seen:
                clear = values[alpha][orders[depth]] if alpha else np.ones(len(ordered))
                seen[key] = _transmittance(clear, starts, counts)
            flat = _summed(ordered, seen[key], counts)
            if samples.dtype == np.float16:
                flat = np.clip(flat, -_MOST_HALF, _MOST_HALF)
        else:
            is_far = name == depth and samples.dtype.kind == "f"
            flat = np.full(len(counts), np.inf if is_far else 0, samples.dtype)
            flat[counts > 0] = ordered[starts[counts > 0]]
        planes[name] = flat.astype(samples.dtype).reshape(shape)
    return planes


def _is_color(name: str, data_layers: Collection[str]) -> bool:
    """Return True for a channel that is laid over, not one of vectors, normals or ids."""
    layer, _, component = name.rpartition(".")
    own = layer.rpartition(".")[2].lower()
    if (
        component.lower() not in _COLORS
        or own in _NOT_COLORS
        or re.sub(r"[\W_]", "", own) in data_layers
        or own[-2:].isdigit()
    ):
        return False
    return component != "y" and (component != "Y" or not layer)


def companion(name: str, wanted: str, names: Mapping[str, object]) -> str | None:
    """The channel `wanted` (Z or A) that goes with a channel: of its layer, its view, or at all."""
    *layer, _ = name.split(".")
    leads = [".".join(layer), *layer, ""]
    places = [f"{lead}.{wanted}" if lead else wanted for lead in leads]
    return next((place for place in places if place in names), None)


def has_volumes(channels: Mapping[str, np.ndarray]) -> bool:
    """Return True if a sample reaches from Z to another ZBack."""
    for name, pixels in channels.items():
        front = channels.get(name.removesuffix("Back"))
        if name.endswith("ZBack") and front is not None:
            pairs = zip(front.flat, pixels.flat, strict=True)
            if any(a is not None and (a != b).any() for a, b in pairs):
                return True
    return False


def _order(depth: np.ndarray | None, counts: np.ndarray) -> np.ndarray:
    """Indices that put the samples of every pixel in order, the nearest first."""
    of = np.repeat(np.arange(len(counts)), counts)
    if depth is None:
        return np.arange(len(of))
    return np.lexsort((depth, of))


def _transmittance(alpha: np.ndarray, starts: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Transmittance of the samples in front of each sample, 0 to 1."""
    clear = np.clip(1 - alpha.astype(np.float64), 0, None)
    seen = np.ones(len(alpha))
    pixels, rank = np.flatnonzero(counts > 1), 1
    while len(pixels):
        at = starts[pixels] + rank
        seen[at] = seen[at - 1] * clear[at - 1]
        rank += 1
        pixels = pixels[counts[pixels] > rank]
    return seen


def _summed(samples: np.ndarray, transmittance: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """The sum of the visible parts of every pixel's samples."""
    of = np.repeat(np.arange(len(counts)), counts)
    shares = np.zeros(len(samples))
    np.multiply(
        samples, transmittance, out=shares, where=transmittance != 0
    )  # infinite light may be hidden
    return np.bincount(of, shares, len(counts))


# ---- how large ------------------------------------------------------------------------------


def needed(path: Path, parts: Sequence[Any]) -> int:
    """Bytes that the deep parts of a file take in memory, from the headers of their chunks.

    `parts`: of OpenEXR.File, without pixels. InputError where they cannot be counted.
    """
    try:
        with open(path, "rb") as file:
            return _needed(file, parts)
    except (struct.error, IndexError, ValueError, KeyError, OSError, OverflowError) as error:
        raise InputError(
            f"{path}: its deep samples cannot be counted, it is damaged or cut off: {error}"
        ) from None


def _needed(file: BinaryIO, parts: Sequence[Any]) -> int:
    stored = os.fstat(file.fileno()).st_size
    many, _, at = exr_headers.read(file)
    total = 0
    for part in parts:
        count, channels = int(part.header["chunkCount"]), part.header["channels"]
        if count < 1:
            raise ValueError(f"states {count} chunks")
        limits.held("chunks", count, 8, stored)
        if "deep" in part.header["type"].name:
            limits.held("chunks", count, 1, _MOST_CHUNKS)
            is_tile = "tile" in part.header["type"].name
            file.seek(at)
            offsets = np.frombuffer(file.read(8 * count), "<u8").tolist()
            unpacked = sum(_unpacked(file, each, stored, many, is_tile) for each in offsets)
            (left, top), (right, bottom) = part.header["dataWindow"]
            pixels = (int(right) - int(left) + 1) * (int(bottom) - int(top) + 1)
            filled = min(pixels, unpacked // (2 * len(channels)))
            total += 3 * unpacked + len(channels) * (8 * pixels + _OBJECT * filled)
        at += 8 * count
    return total


def _unpacked(file: BinaryIO, offset: int, stored: int, many: bool, is_tile: bool) -> int:
    """Bytes of the samples of one chunk; 0 for a smaller level of a tiled part.

    ValueError where the chunk is not in the file: the library would look for it elsewhere.
    """
    length = 4 * many + (16 if is_tile else 4) + 24
    if not 8 <= offset <= stored - length:
        raise ValueError(f"a chunk is at {offset} of {stored} bytes")
    file.seek(offset + 4 * many)
    place = struct.unpack("<4i" if is_tile else "<i", file.read(16 if is_tile else 4))
    counts, packed, unpacked = struct.unpack("<3Q", file.read(24))
    limits.held("bytes of a chunk", counts + packed, 1, stored - offset - length)
    if unpacked > _MOST:
        raise ValueError("no chunk is so large")
    return 0 if is_tile and place[2:] != (0, 0) else unpacked
