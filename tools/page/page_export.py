"""Export to JSON what the page takes from Python: shaders with their layouts, and constants.

    python tools/page/page_export.py [SHADER ...] > exported.json

Nothing of it is written down a second time: the shaders are those of wgsl/, joined with what they
include, and the constants are those of the modules that use them.
"""

from __future__ import annotations

import argparse
import json
import re
from typing import Any

import numpy as np

from standard_words import groups_of
from wgmb import shutter
from wgmb.errors import ShaderError
from wgmb.gpu import wgsl
from wgmb.pipeline import arguments
from wgmb.scene import density, torusphere
from wgmb.scene.volumes import Backdrop, Torus

FRAGMENT = 2  # GPUShaderStage
PATTERNS = (
    "methods/volume.wgsl", "methods/tap.wgsl", "methods/tiles*.wgsl", "methods/gather/tiles/*.wgsl",
    "methods/gather/layers/*.wgsl", "methods/gather/search/*.wgsl", "gpu_frame/velocity.wgsl",
    "gpu_frame/holdout.wgsl", "scene/gbuffer.wgsl", "hosts/block_search.wgsl",
    "viewer/draw/compose.wgsl", "viewer/draw/blit.wgsl",
)  # fmt: skip
"""The shaders of the page; of these, files without an entry point come with those that have one."""


def exported(*names: str) -> dict[str, Any]:
    """`shaders` by file, those of the page or the `names` given, and `constants`; for json.dumps.

    A shader: `text` (joined), `files` ([file, its first line in the text]), `groups` (lists of
    GPUBindGroupLayoutEntry, each with its `name`), `entryPoints` (of compute), `vertex` and
    `fragment` (those of a render pipeline), `workgroup` ([x, y], null without), `structs` (those
    that buffers hold), `aliases` (the texel alias of each storage texture that has one) and
    `overrides` (the type of each).
    """
    return {
        "shaders": {name: shader(name) for name in names or page_files()},
        "constants": constants(),
    }


def page_files() -> list[str]:
    """The files of PATTERNS that have an entry point."""
    found = sorted({p for pattern in PATTERNS for p in wgsl.ROOT.glob(pattern)})
    stage = re.compile(r"^@(compute|vertex|fragment)\b", re.M)
    return [
        p.relative_to(wgsl.ROOT).as_posix()
        for p in found
        if stage.search(p.read_text(encoding="utf-8"))
    ]


def shader(name: str) -> dict[str, Any]:
    """One file of wgsl/, joined with what it includes."""
    source = wgsl.load(name)
    groups, compute = groups_of(source), source.entry_points()
    if not compute:
        for group in groups:
            for entry in group:
                entry["visibility"] = FRAGMENT
    return {
        "text": source.text,
        "files": [list(file) for file in source.files],
        "groups": groups,
        "entryPoints": compute,
        "vertex": re.findall(r"@vertex\s+fn (\w+)", source.text),
        "fragment": re.findall(r"@fragment\s+fn (\w+)", source.text),
        "workgroup": [int(source.constant(edge)) for edge in ("WG_X", "WG_Y")] if compute else None,
        "structs": _structs(source),
        "aliases": _aliases(source),
        "overrides": dict(re.findall(r"^override (\w+)\s*:\s*(\w+)", source.text, re.M)),
    }


def _structs(source: wgsl.WgslSource) -> dict[str, Any]:
    """Layouts of the structs in buffers, by name; structs within them are written out."""
    known = set(re.findall(r"^struct (\w+) \{", source.text, re.M))
    found = {}
    for binding in source.bindings():
        name = re.sub(r"^array<(\w+)(?:,\s*\w+)?>$", r"\1", binding.type)
        if binding.space and name in known:
            try:
                found[name] = _layout(source.dtype(name))
            except ShaderError:  # of unknown length, or arrays within arrays: JavaScript fills none
                continue
    return found


def _layout(dtype: np.dtype) -> dict[str, Any]:
    """`size` and `fields` of a struct; `type` and `shape` of numbers; `array` and `of` of structs.

    Everything says its `size` in bytes. The items of an array follow one another without gaps.
    """
    size = {"size": dtype.itemsize}
    if dtype.fields is not None:
        known = {n: f for n, f in dtype.fields.items() if f[0].base.fields or f[0].base.kind != "V"}
        rows = {n: {"offset": f[1]} | _layout(f[0]) for n, f in known.items()}
        return size | {"fields": rows}
    if dtype.base.fields is not None:
        return size | {"array": list(dtype.shape), "of": _layout(dtype.base)}
    words = {"f": "f32", "i": "i32", "u": "u32"}
    if dtype.base.kind not in words:
        raise ShaderError(f"no layout for {dtype}")
    return size | {"type": words[dtype.base.kind], "shape": list(dtype.shape)}


def _aliases(source: wgsl.WgslSource) -> dict[str, str]:
    """The alias that each storage texture's type is written with, by the binding's name."""
    alias = set(re.findall(r"^alias (\w+)\s*=\s*texture_storage_2d", source.text, re.M))
    written = re.findall(
        r"^@group\(\d+\) @binding\(\d+\)\s+var (\w+)\s*:\s*(\w+);", source.text, re.M
    )
    return {name: kind for name, kind in written if kind in alias}


def constants() -> dict[str, Any]:
    """The numbers that the uniforms of a frame are computed with, by the names they have here."""
    volume, occupancy = wgsl.load("methods/volume.wgsl"), wgsl.load("scene/density.wgsl")
    own = ("BEGIN", "KAPPA", "CYCLE", "HALF", "WHIRL", "ZOOM", "DISTANCE", "EXPOSURE")
    scene = torusphere.torusphere()
    return {
        **{name: getattr(torusphere, name) for name in own},
        "LOOP": scene.loop,
        "CURVE": scene.exposure[1] if scene.exposure else "box",
        "COLOR": list(Torus.color),
        "TINT": list(Backdrop.tint),
        "GROUND": Backdrop.ground,
        "LIGHT": list(Backdrop.light),
        "CURVES": list(shutter.CURVES),
        "PHASES": shutter.PHASES,
        "OVERLAPS": shutter.OVERLAPS,
        "CLOSED": list(density.CLOSED),
        "SLOWEST": density.SLOWEST,
        "MOST_TURNS": density.MOST_TURNS,
        "SHARES": occupancy.constant("SHARES"),
        "CLOSED_FROM": occupancy.constant("CLOSED_FROM"),
        "MOST_VOLUMES": volume.constant("MOST_VOLUMES"),
        "TILES_A_ROW": volume.constant("TILES_A_ROW"),
        "SAMPLES": arguments.SAMPLES,
    }


def main() -> None:
    """Write the JSON to the standard output."""
    parser = argparse.ArgumentParser(description="Export what the page needs, as JSON.")
    parser.add_argument("shader", nargs="*", help="file of wgsl/; by default those of the page")
    print(json.dumps(exported(*parser.parse_args().shader), allow_nan=False))


if __name__ == "__main__":
    main()
