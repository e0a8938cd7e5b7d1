"""Files of numbers rather than light: PNG and TIFF of vectors, depth or masks, and flow files.

Flow files are those of Middlebury and Sintel (.flo), and KITTI's PNG of 16 bits.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from . import limits, record, stills

FLO = ".flo"
_MAGIC = struct.pack("<f", 202021.25)  # a .flo begins with it
_HEADER = 12  # bytes: the magic, width, height
_KITTI_STILL, _KITTI_PX = 32768, 64  # samples: of no motion, and of a pixel


@dataclass(frozen=True)
class Unit:
    """Unit of motion vectors, as a file states it: `px` times (number - `still`) is in pixels."""

    px: float
    still: float = 0.5
    is_up: bool = True
    """The second channel grows upwards."""


@dataclass(frozen=True)
class Data:
    """Contents of a file: (height, width) float32 by channel; its own description of them."""

    planes: dict[str, np.ndarray]
    unit: Unit | None = None


def read(path: Path, *, max_mb: float = limits.MAX_MB) -> Data:
    """The numbers of a PNG, a TIFF, a JPEG or a .flo.

    Whole numbers become 0 to 1, without any curve for display; both samples in the middle become
    0.5, as programs use either for no motion. Floats stay as they are. Channels are Y, or u and v,
    or R, G, B and A; of KITTI's flow, the third one is `MV_Alpha`. InputError as for stills.read.
    """
    if path.suffix.lower() == FLO:
        return Data(dict(zip("uv", np.moveaxis(read_flo(path, max_mb=max_mb), 2, 0), strict=True)))
    samples = stills.samples(path, max_mb=max_mb)
    names = {1: "Y", 2: "uv"}.get(samples.shape[2], "RGBA"[: samples.shape[2]])
    if samples.dtype.kind == "f":
        planes = np.moveaxis(samples.astype(np.float32), 2, 0)
        return Data(dict(zip(names, planes, strict=True)))
    most = int(np.iinfo(samples.dtype).max)
    table = np.arange(most + 1, dtype=np.float32) / np.float32(most)
    if _is_kitti(samples):
        planes = {"R": table[samples[..., 0]], "G": table[samples[..., 1]]}
        planes["MV_Alpha"] = samples[..., 2].astype(np.float32)
        return Data(planes, Unit(most / _KITTI_PX, _KITTI_STILL / most, is_up=False))
    table[[most // 2, most // 2 + 1]] = 0.5
    planes = {name: table[samples[..., i]] for i, name in enumerate(names)}
    return Data(planes, unit_of(record.read_file(path)[0]))


def unit_of(content: dict[str, Any] | None) -> Unit | None:
    """The unit that the record of a file states of its vectors; None where it states none."""
    most = (content or {}).get("max_displace")
    return Unit(2.0 * most) if isinstance(most, int | float) and most > 0 else None


def _is_kitti(samples: np.ndarray) -> bool:
    """Return True for three channels of 16 bits, of which the last is 1 where the flow is valid."""
    if samples.dtype != np.uint16 or samples.shape[2] != 3:
        return False
    return int(samples[..., 2].max()) == 1


def read_flo(path: Path, *, max_mb: float = limits.MAX_MB) -> np.ndarray:
    """(height, width, 2) float32 of a .flo: displacement to the next picture [px], y down.

    InputError names the file where it is missing, no .flo, cut off, or beyond the limit.
    """
    try:
        with open(path, "rb") as file:
            head, stored = file.read(_HEADER), path.stat().st_size
            if len(head) < _HEADER or head[:4] != _MAGIC:
                raise InputError(f"{path}: not a readable .flo file: it does not begin as one")
            width, height = struct.unpack("<ii", head[4:])
            if not (
                0 < width <= limits.MOST_PIXELS_A_SIDE and 0 < height <= limits.MOST_PIXELS_A_SIDE
            ):
                raise InputError(f"{path}: flow of {width} x {height} pixels")
            needed = limits.unpacked((width, height), 2)
            if stored != _HEADER + needed:
                raise InputError(
                    f"{path}: {width} x {height} pixels need {_HEADER + needed} bytes, got {stored}"
                )
            limits.check(path, f"{width} x {height}", needed, stored, max_mb)
            return np.fromfile(file, "<f4").reshape(height, width, 2).astype(np.float32, copy=False)
    except MemoryError:
        raise InputError(f"{path}: not enough memory for its pixels") from None
    except OSError as error:
        raise InputError(f"{path}: {(error.strerror or str(error)).lower()}") from None


def encode_flo(flow: np.ndarray) -> bytes:
    """The bytes of a .flo of (height, width, 2) displacements [px], y down."""
    height, width = flow.shape[:2]
    return _MAGIC + struct.pack("<ii", width, height) + flow.astype("<f4").tobytes()
