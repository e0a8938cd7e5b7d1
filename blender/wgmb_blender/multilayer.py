"""Blurred layers as one multilayer EXR, which Blender cannot write from a script."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from .blurring import COMPOSITE
from .problem import ProblemError
from .sharp import MATTE, PASSES, View

_LOSSLESS = "zip"
_DATA = ("Depth", "Vector", "Normal", "Position", "UV", "Mist")
_IDS = ("Index", "Crypto")  # also Object Index, as 5.0 has it


def save_multilayer(
    scene: bpy.types.Scene,
    files: Sequence[tuple[View, Path, Path | None]],
    paths: Sequence[Path],
) -> None:
    """Write blurred files, of each view with its composite if there is one, to the output.

    Passes that were only switched on for the blur are left out; depth and compression are those of
    the scene's output.
    """
    from wgmb.io import atomic, exr

    image = scene.render.image_settings
    if len(files) != len(paths):
        raise ProblemError(
            "Stereo frames as OpenEXR MultiLayer need Views Format: Individual in the output"
        )
    codec = image.exr_codec.lower()
    for (_, file, composite), path in zip(files, paths, strict=True):
        whole = exr.read(file)
        parts = [
            replace(part, channels=kept)
            for part in whole.parts
            if (kept := _kept(scene, part.channels, image.color_depth == "16"))
        ]
        if composite is not None:
            parts = _with(parts, exr.read(composite).parts[0].channels, image.color_depth)
        whole = exr.Exr(path, parts)
        codec = codec if codec in exr.COMPRESSIONS else _LOSSLESS
        if codec in ("pxr24", "b44", "b44a", "dwaa", "dwab") and _has_ids(parts):
            codec = _LOSSLESS  # a lossy one would change the ids
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            atomic.write_file(path, exr.encode(whole, codec))
        except OSError as error:
            raise ProblemError(f"Cannot write {path}: {(error.strerror or '').lower()}") from None


def _with(parts: list[Any], composite: dict[str, Any], depth: str) -> list[Any]:
    """The parts and the composite: a part of its own where each layer has one (5.0)."""
    from wgmb.io import exr

    made = exr.to_half if depth == "16" else (lambda plane: plane)
    name = f"{COMPOSITE}.Combined"
    added = {f"{name}.{c}": made(plane) for c, plane in composite.items()}
    first, *others = parts
    if others:
        return [replace(first, name=name, channels=added), *parts]
    return [replace(first, channels={**added, **first.channels})]


def _kept(scene: bpy.types.Scene, channels: dict[str, Any], is_half: bool) -> dict[str, Any]:
    """The channels of passes that the scene asks for, colours in half floats where it does."""
    from wgmb.io import exr

    left_out = set()
    for layer in scene.view_layers:
        for switch, name in (*PASSES.items(), MATTE):
            if not getattr(layer, switch):
                left_out.add((layer.name, name))
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
