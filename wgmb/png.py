"""Pictures that a notebook shows: linear light as a PNG for sRGB displays, without a library."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .color.srgb import to_display
from .errors import InputError

WIDEST = 960  # [px]; wider pictures are shown smaller


class NotebookImage:
    """A picture that a notebook shows; `png` is the file."""

    def __init__(self, png: bytes, size: tuple[int, int]):
        self.png, self.size = png, size

    def __repr__(self) -> str:
        return f"NotebookImage({self.size[0]} x {self.size[1]})"

    def _repr_png_(self) -> bytes:
        return self.png


def show(image: NDArray[np.floating[Any]], exposure: float = 0.0) -> NotebookImage:
    """A picture for a notebook: the last value of a cell is shown.

    `image`: (height, width) or (height, width, 1, 3 or 4) float, linear, premultiplied alpha.
    `exposure` [stops] brightens it. Wider pictures are shown 960 wide at most; each of their
    pixels is the mean of a block. Values that are not finite are black, or white if infinite.
    InputError for other arrays.
    """
    light = np.asarray(image)
    if light.ndim == 2:
        light = light[..., None]
    if light.ndim != 3 or light.shape[2] not in (1, 3, 4) or 0 in light.shape:
        expected = "(height, width) or (height, width, 1, 3 or 4)"
        raise InputError(f"image must be {expected}, got {np.shape(image)}")
    if light.dtype.kind != "f":
        raise InputError(f"image must be floating point, got {light.dtype}")
    if not abs(exposure) <= 100:
        raise InputError(f"exposure must be within 100 stops, got {exposure}")
    with np.errstate(all="ignore"):
        light = _smaller(light.astype(np.float32, copy=False))
        gains = np.full(light.shape[2], 2.0**exposure, np.float32)
        gains[3:] = 1
        light = light * gains
        if light.shape[2] == 1:
            light = np.repeat(light, 3, axis=2)
        samples = to_display(light, 8)
    return NotebookImage(encode(samples), (light.shape[1], light.shape[0]))


def _smaller(light: np.ndarray) -> np.ndarray:
    """Means of square blocks, so that it is no wider than WIDEST."""
    step = -(-light.shape[1] // WIDEST)
    height, width = (max(n // step, 1) for n in light.shape[:2])
    if step == 1 or light.shape[0] < step:
        return light[:, ::step]
    blocks = light[: height * step, : width * step].reshape(height, step, width, step, -1)
    return blocks.mean(axis=(1, 3), dtype=np.float32)


def encode(samples: np.ndarray) -> bytes:
    """The PNG of (height, width, 3 or 4) samples of 8 bits, marked as sRGB."""
    height, width, channels = samples.shape
    rows = samples.reshape(height, -1)
    up = rows.copy()
    up[1:] -= rows[:-1]  # filter 2 of the PNG specification, 9.2: each row minus the one above
    marked = np.concatenate([np.full((height, 1), 2, np.uint8), up], axis=1)
    kind = {3: 2, 4: 6}[channels]
    header = struct.pack(">2I5B", width, height, 8, kind, 0, 0, 0)
    chunks = (
        (b"IHDR", header),
        (b"sRGB", b"\0"),
        (b"IDAT", zlib.compress(marked.tobytes())),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, data) for name, data in chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
