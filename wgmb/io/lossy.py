"""Lossy compression of EXR files: pictures take it, and data layers are left as they are.

Numbers (vectors, depth, normals, ids) are stored in a part of their own without loss, beside the
picture's part. OpenEXR's technical introduction says which channels each compression
changes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import OpenEXR

if TYPE_CHECKING:
    from .exr import Part

_COLORS = frozenset({"r", "g", "b", "a", "y", "ry", "by", "red", "green", "blue", "alpha"})
_DWA = OpenEXR.DWAA_COMPRESSION, OpenEXR.DWAB_COMPRESSION
_BY_COSINES = frozenset({"R", "G", "B", "Y", "RY", "BY"})  # channels that DWA changes
_KINDS = {  # bytes of samples that the others change
    OpenEXR.PXR24_COMPRESSION: (4,),
    OpenEXR.B44_COMPRESSION: (2,),
    OpenEXR.B44A_COMPRESSION: (2,),
    OpenEXR.LJ2K_COMPRESSION: (2, 4),
}


def separated(
    part: Part,
    kind: OpenEXR.Compression,
    holds_numbers: Callable[[str], bool],
    taken: Collection[str],
) -> list[tuple[Part, OpenEXR.Compression]]:
    """A part as it is to be written in compression `kind`: data that this would change apart.

    `holds_numbers`: True of a layer that does so though its channels are called R, G and B.
    `taken`: names of parts that the file has.
    """
    ids = [
        str(value)
        for key, value in part.attributes.items()
        if key.startswith("cryptomatte/") and key.endswith("/name")
    ]
    is_ids = any(part.name.startswith(of) for of in ids)
    uncolored = {
        layer
        for layer, component in map(_split, part.channels)
        if layer and component.lower() not in _COLORS
    }
    numbers = {
        name
        for name in part.channels
        if is_ids or _split(name)[0] in uncolored or _is_data(name, holds_numbers, ids)
    }
    changed = numbers & _changed(part.channels, kind)
    layers = {layer for layer, _ in map(_split, changed) if layer or is_ids}
    data = {name for name in numbers if name in changed or _split(name)[0] in layers}
    if not data:
        return [(part, kind)]
    if len(data) == len(part.channels):
        return [(part, OpenEXR.ZIP_COMPRESSION)]
    name = part.name or "picture"
    own = {k: v for k, v in part.channels.items() if k not in data}
    apart = {k: v for k, v in part.channels.items() if k in data}
    return [
        (replace(part, name=name, channels=own), kind),
        (replace(part, name=_free(f"{name}.data", taken), channels=apart),
         OpenEXR.ZIP_COMPRESSION),
    ]  # fmt: skip


def _split(name: str) -> tuple[str, str]:
    layer, _, component = name.rpartition(".")
    return layer, component


def _changed(channels: Mapping[str, np.ndarray], kind: OpenEXR.Compression) -> set[str]:
    """The channels whose values a compression changes."""
    floats = {name: plane.itemsize for name, plane in channels.items() if plane.dtype.kind == "f"}
    if kind in _DWA:
        return {name for name in floats if _split(name)[1] in _BY_COSINES}
    return {name for name, size in floats.items() if size in _KINDS.get(kind, ())}


def _is_data(name: str, holds_numbers: Callable[[str], bool], ids: Collection[str]) -> bool:
    layer, component = _split(name)
    if component.lower() not in _COLORS or holds_numbers(layer):
        return True
    return any(layer.startswith(of) for of in ids)


def _free(name: str, taken: Collection[str]) -> str:
    """A name for a part that no other has."""
    names = (name, *(f"{name}{n}" for n in range(2, len(taken) + 3)))
    return next(one for one in names if one not in taken)
