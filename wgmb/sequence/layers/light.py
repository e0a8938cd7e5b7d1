"""Passes of light by the names that renderers give them: the light on surfaces, and their colour.

Blender writes light before it is multiplied by the surface's colour, Arnold after it, V-Ray both
("raw" is before it). Blender 5.0 spells its names out.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from . import names as layers

_DARK = 0.02  # colours below it are divided as if they were this bright
_BEAUTY = ("combined", "rgba", "rgb", "beauty", "color", "colour", "image", "final", "noisyimage")


@dataclass(frozen=True)
class _Family:
    """Names of one renderer's layers, in lower case without spaces and underscores."""

    light: str  # the field of Frame; with "_color" instead of "_light", that of the colour
    direct: tuple[str, ...]
    indirect: tuple[str, ...]
    color: tuple[str, ...]
    is_multiplied: bool = False  # the light, by the colour


_VRAY_DIFFUSE = ("vraydiffusefilter", "diffusefilter", "diffuse")
_VRAY_REFLECTION = ("vrayreflectionfilter", "reflectionfilter")
_FAMILIES = (
    _Family("diffuse_light", ("diffdir",), ("diffind",), ("diffcol",)),
    _Family(
        "diffuse_light",
        ("vrayrawlighting", "rawlighting", "rawlight"),
        ("vrayrawglobalillumination", "rawglobalillumination", "rawgi"),
        _VRAY_DIFFUSE,
    ),
    _Family("diffuse_light", ("diffusedirect",), ("diffuseindirect",), ("diffusealbedo",), True),
    _Family("diffuse_light", ("diffusedirect",), ("diffuseindirect",), ("diffusecolor",)),
    _Family(
        "diffuse_light",
        ("vraylighting", "lighting"),
        ("vrayglobalillumination", "globalillumination", "gi"),
        _VRAY_DIFFUSE,
        True,
    ),
    _Family("glossy_light", ("glossdir",), ("glossind",), ("glosscol",)),
    _Family("glossy_light", ("glossydirect",), ("glossyindirect",), ("glossycolor",)),
    _Family("glossy_light", ("vrayrawreflection", "rawreflection"), (), _VRAY_REFLECTION),
    _Family("glossy_light", ("speculardirect",), ("specularindirect",), ("specularalbedo",), True),
    _Family(
        "glossy_light",
        ("vrayreflection", "reflection", "reflect"),
        ("vrayspecular", "specular"),
        _VRAY_REFLECTION,
        True,
    ),
)
_UNUSED = (
    "transdir",
    "transind",
    "volumedir",
    "volumeind",
    "volumedirect",
    "volumeindirect",
    "transmissiondirect",
    "transmissionindirect",
    "vrayrefraction",
    "refraction",
    "rawrefraction",
)
_PASSES = frozenset(
    name for family in _FAMILIES for name in (*family.direct, *family.indirect, *family.color)
)
_EFFECT = {"diffuse_light": "shadows", "glossy_light": "reflections"}


@dataclass(frozen=True)
class Light:
    """The layers of one kind of light: its field of Frame, and channels by three."""

    field: str
    lights: tuple[tuple[str, ...], ...]  # direct, indirect
    color: tuple[str, ...]
    is_multiplied: bool

    @property
    def text(self) -> str:
        """The layers, for messages."""
        lights = " + ".join(_layer(channels) for channels in self.lights)
        return f"{_EFFECT[self.field]}: {lights}, {_layer(self.color)}"


@dataclass(frozen=True)
class LightPasses:
    """The passes found: kinds of light, and a line about passes that cannot be used."""

    lights: tuple[Light, ...] = ()
    lacking: str | None = None
    unused: tuple[str, ...] = ()
    """Layers of light that is not followed: through glass, and of volumes."""

    @property
    def text(self) -> str:
        """One line."""
        found = "; ".join(light.text for light in self.lights) or "none"
        more = [self.lacking] if self.lacking else []
        if self.unused:
            more.append(f"not followed: {', '.join(self.unused)}")
        return "; ".join((found, *more))


def find(names: Iterable[str], picture: str | None) -> LightPasses:
    """The passes of light of the picture whose first channel is `picture`.

    They are of the same view layer as the picture, or of none, as in a file of their own; a
    picture that is one layer of light by itself has none.
    """
    if picture is None:
        return LightPasses()
    layer = picture.rpartition(".")[0]
    view_layer = layer.rpartition(".")[0]
    is_beauty = layer == "" or _plain(layers.stem(layer)) in _BEAUTY
    there: dict[str, tuple[str, ...]] = {}
    ends: dict[str, tuple[str, ...]] = {}
    for name, members in layers.layers(names, near=picture).items():
        rgb = layers.rgb(members)
        if rgb and name.rpartition(".")[0] in (view_layer, ""):
            there.setdefault(_plain(layers.stem(name)), tuple(rgb[:3]))
            if end := layers.ending(name, _PASSES):
                ends.setdefault(end, tuple(rgb[:3]))
    there = ends | there
    by_field: dict[str, Light] = {}
    lacking: dict[str, str] = {}
    for family in _FAMILIES:
        direct, indirect, color = (
            next((there[name] for name in wanted if name in there), None)
            for wanted in (family.direct, family.indirect, family.color)
        )
        if direct is None or family.light in by_field:
            continue
        if color is None:
            lacking.setdefault(
                family.light,
                f"{_layer(direct)} without the surface's colour ({_written(family.color)}): "
                f"{_EFFECT[family.light]} are not followed",
            )
            continue
        lights = tuple(one for one in (direct, indirect) if one is not None)
        by_field[family.light] = Light(family.light, lights, color, family.is_multiplied)
    if (by_field or lacking) and not is_beauty:
        return LightPasses(
            (), f"the layer {layer} is not the whole picture: its passes of light are left alone"
        )
    missing = "; ".join(text for kind, text in lacking.items() if kind not in by_field)
    unused = tuple(_layer(there[name]) for name in _UNUSED if name in there)
    return LightPasses(tuple(by_field.values()), missing or None, unused)


def is_pass(layer: str) -> bool:
    """Return True for the name of a pass of light, or of the colour of surfaces."""
    return layers.ending(layer, _PASSES) is not None


def read(channels: Mapping[str, np.ndarray], passes: LightPasses) -> dict[str, np.ndarray]:
    """Fields of Frame, (height, width, 3) float32; none that are black everywhere."""
    fields: dict[str, np.ndarray] = {}
    for light in passes.lights:
        color = _stacked(channels, light.color)
        total = sum(_stacked(channels, names) for names in light.lights)
        if not color.any() or not np.any(total):
            continue
        if light.is_multiplied:
            total = total / np.maximum(color, _DARK)
        fields[light.field] = np.asarray(total, np.float32)
        fields[light.field.replace("_light", "_color")] = color
    return fields


def _stacked(channels: Mapping[str, np.ndarray], names: Iterable[str]) -> np.ndarray:
    return np.stack([channels[name] for name in names], 2, dtype=np.float32, casting="unsafe")


def _plain(name: str) -> str:
    return re.sub(r"[ _-]", "", name.lower())


def _layer(channels: tuple[str, ...]) -> str:
    """The layer of channels, without its view layer."""
    return channels[0].rpartition(".")[0].rpartition(".")[2] or channels[0]


_SPELLED = {
    "diffcol": "DiffCol",
    "glosscol": "GlossCol",
    "diffusealbedo": "diffuse_albedo",
    "specularalbedo": "specular_albedo",
    "diffusecolor": "Diffuse Color",
    "glossycolor": "Glossy Color",
    "vraydiffusefilter": "VRayDiffuseFilter",
    "vrayreflectionfilter": "VRayReflectionFilter",
}


def _written(color: tuple[str, ...]) -> str:
    return _SPELLED[color[0]]
