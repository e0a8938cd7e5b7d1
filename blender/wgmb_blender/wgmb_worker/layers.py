"""Blurred layers as one multilayer EXR, which Blender cannot write from a script."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from wgmb.io import atomic, exr

from .recipe import COMPOSITE, Picture

_LOSSLESS = "zip"
_DATA = ("Depth", "Vector", "Normal", "Position", "UV", "Mist")
_IDS = ("Index", "Crypto")  # also Object Index, as 5.0 has it


def write_layers(
    file: str,
    composite: str | None,
    path: str,
    left_out: Collection[tuple[str, str]],
    is_half: bool,
    codec: str,
) -> None:
    """Write a blurred file, with its composite if there is one, as Blender would to `path`.

    `left_out`: layer and name of each pass that is not asked for; `is_half`: colours in 16 bits;
    `codec`: a compression, in Blender's words.
    """
    whole = exr.read(Path(file))
    parts = [
        replace(part, channels=kept)
        for part in whole.parts
        if (kept := _kept(part.channels, left_out, is_half))
    ]
    if composite is not None:
        parts = _with(parts, exr.read(Path(composite)).parts[0].channels, is_half)
    codec = codec.lower()
    codec = codec if codec in exr.COMPRESSIONS else _LOSSLESS
    if codec in ("pxr24", "b44", "b44a", "dwaa", "dwab") and _has_ids(parts):
        codec = _LOSSLESS  # a lossy one would change the ids
    atomic.write_file(Path(path), exr.encode(exr.Exr(Path(path), parts), codec))


def _with(parts: list[Any], composite: dict[str, Any], is_half: bool) -> list[Any]:
    """The parts and the composite: a part of its own where each layer has one (5.0)."""
    made = exr.to_half if is_half else (lambda plane: plane)
    name = f"{COMPOSITE}.Combined"
    added = {f"{name}.{c}": made(plane) for c, plane in composite.items()}
    first, *others = parts
    if others:
        return [replace(first, name=name, channels=added), *parts]
    return [replace(first, channels={**added, **first.channels})]


def _kept(
    channels: dict[str, Any], left_out: Collection[tuple[str, str]], is_half: bool
) -> dict[str, Any]:
    """The channels of passes that are asked for, colours in half floats where that is too."""
    kept = {}
    for name, plane in channels.items():
        layer, _, rest = name.partition(".")
        what = rest.rpartition(".")[0]
        if any(layer == of and what.rstrip("0123456789") == one for of, one in left_out):
            continue
        is_data = what.startswith(_DATA) or any(word in what for word in _IDS)
        is_color = not is_data and name[-2:] in (
            ".R",
            ".G",
            ".B",
            ".A",
        )
        kept[name] = exr.to_half(plane) if is_half and is_color else plane
    return kept


def _has_ids(parts: Sequence[Any]) -> bool:
    return any("Crypto" in name for part in parts for name in part.channels)


def both_halves(file: str, sharp: str, layer: str, picture: Picture, path: str) -> None:
    """Write a sharp frame and its blurred one, side by side, as a numpy file of float32.

    (height, width, 4) linear light, the first row on top.
    """
    channels = exr.read(Path(sharp)).channels()
    before = np.dstack([channels[f"{layer}.Combined.{c}"] for c in "RGBA"])
    channels = exr.read(Path(file)).channels()
    stem = "" if "R" in channels else f"{layer}.Combined."
    after = np.dstack([channels[stem + c] for c in "RGBA" if stem + c in channels])
    four = np.ones((*after.shape[:2], 4), np.float32)
    four[..., : after.shape[2]] = after
    np.save(path, np.hstack([picture.laid(before), four]).astype(np.float32))
