"""Finding the layers of a rendered frame by the names that renderers give them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping

import numpy as np

from ...errors import InputError

Channels = Mapping[str, np.ndarray]


class MissingLayerError(InputError):
    """A layer that was asked for by its name is not in a file."""


_COMPONENTS = (
    {"x": 0, "y": 1, "z": 2, "w": 3},
    {"r": 0, "g": 1, "b": 2, "a": 3},
    {"u": 0, "v": 1},
    {"red": 0, "green": 1, "blue": 2, "alpha": 3},
)
_COLOR = ("combined", "rgba", "rgb", "beauty", "color", "colour", "image", "final", "noisy image")
_TITLES = frozenset("".join(name.split()) for name in _COLOR)
TRIPLES = {"normal": ("normal", "normals", "n")}
"""Layers of three channels, as stems of their names, by the input of a Frame that they are."""
_DEPTH = ("depth", "z", "zdepth", "vrayzdepth", "worlddepth")
_OF_SPACE = frozenset(
    ("n", "normal", "normals", "p", "pos", "position", "positions", "pref", "world", "tangent",
     "light", "point", "reflection", "refraction")
)  # fmt: skip
_WORD = re.compile(
    r"2[dD](?![a-z])|[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+"
)  # mv2DToonz: mv, 2, D, Toonz
_VERSION = re.compile(
    r"[0-9]+|2d|v|raw|pass|aov|filtered|unfiltered|texture|buffer"
)  # words that say nothing of what a layer holds


def layers(names: Iterable[str], near: str | None = None) -> dict[str, list[str]]:
    """Channel names by layer, in the order x y z w, r g b a, or u v; the rest by name.

    Layers beside the channel `near` (of the same view layer, say) come first.
    """
    found: dict[str, list[str]] = {}
    for name in names:
        found.setdefault(name.rpartition(".")[0], []).append(name)
    beside = (near or "").rpartition(".")[0].rpartition(".")[0]
    first = sorted(found, key=lambda layer: (layer.rpartition(".")[0] != beside, layer))
    return {layer: sorted(found[layer], key=_order) for layer in first}


def _order(channel: str) -> tuple[int, str]:
    last = component(channel)
    return next((c[last] for c in _COMPONENTS if last in c), 9), channel


def component(channel: str) -> str:
    """The last part of a channel's name, in lower case: "ViewLayer.Depth.Z" -> "z"."""
    return channel.rpartition(".")[2].lower()


def is_component(channel: str) -> bool:
    """Return True for R, x, u, ... or Y, which say nothing of their layer, unlike Z."""
    own = component(channel)
    return channel not in ("Z", "z") and any(own in kinds for kinds in _COMPONENTS)


def stem(layer: str) -> str:
    """The last part of a layer's name, in lower case: "ViewLayer.Depth" -> "depth"."""
    return layer.rpartition(".")[2].lower()


def ending(layer: str, stems: Collection[str]) -> str | None:
    """The one of `stems` (lower case, letters and digits) that a layer's name is, or ends in.

    Words may be joined or apart, and others may come before them: `Motion Vector`, `motion_vector`
    and `shot010_beauty_MotionVector_v2` are all `motionvector`.
    """
    words = words_of(layer)
    while len(words) > 1 and "".join(words) not in stems and _VERSION.fullmatch(words[-1]):
        words.pop()
    ends = ("".join(words[i:]) for i in range(len(words)))
    return next((end for end in ends if end in stems), None)


def words_of(layer: str) -> list[str]:
    """The words of the last part of a layer's name, in lower case."""
    return [word.lower() for word in _WORD.findall(layer.rpartition(".")[2])]


def is_of_space(layer: str, end: str = "") -> bool:
    """Return True if a name speaks of places or directions in space before its `end`: `P_Z`."""
    words = words_of(layer)
    while end and words:
        last = words.pop()
        end = end.removesuffix(last)
    return bool(_OF_SPACE & set(words))


def is_whole(layer: str, end: str) -> bool:
    """Return True if `end`, of `ending`, is all of a layer's name."""
    return "".join(words_of(layer)) == end


def find_color(names: Iterable[str], wanted: str | None = None) -> list[str]:
    """The channels of the picture: 3, or 4 with alpha.

    Where there are no R, G and B, a grey picture, three times Y; then one with R, G or B alone,
    and "" for the others.
    """
    names = list(names)
    for channels_of in (rgb, _grey, _some_of_rgb):
        by_layer = {k: channels_of(v) for k, v in layers(names).items()}
        by_layer = {k: v for k, v in by_layer.items() if v}
        if channels_of is not rgb and wanted is None:  # others may mean anything
            by_layer = {k: v for k, v in by_layer.items() if k == "" or stem(k) in _COLOR}
        if by_layer:
            break
    if wanted is not None:
        chosen = pick(by_layer, wanted, "colour layer")
    elif "" in by_layer:
        chosen = ""
    else:
        named = [k for word in _COLOR for k in by_layer if stem(k) == word]
        if not named and len(by_layer) != 1:
            raise InputError(
                "cannot tell which layer is the colour; `color` chooses one: "
                f"{', '.join(by_layer) or '(no RGB layer)'}"
            )
        chosen = named[0] if named else next(iter(by_layer))
    return by_layer[chosen]


def pictures(names: Iterable[str]) -> list[str]:
    """The layers that are pictures by their names and channels."""
    return [k for k, v in layers(names).items() if rgb(v) and (k == "" or stem(k) in _COLOR)]


def layer_of(channels: Iterable[str]) -> str:
    """The layer that channels are in: "V.Combined.R" -> "V.Combined"."""
    return next(name for name in channels if name).rpartition(".")[0]


def view_layer(layer: str) -> str:
    """The view layer that a layer is of: "V.Combined" -> "V"."""
    return layer.rpartition(".")[0]


def rgb(members: list[str]) -> list[str]:
    """The channels of red, green, blue and alpha of a layer's; none if it is not coloured."""
    by_component = {component(m): m for m in members}
    for r, g, b, a in (("r", "g", "b", "a"), ("red", "green", "blue", "alpha")):
        if {r, g, b} <= by_component.keys():
            return [by_component[c] for c in (r, g, b, a) if c in by_component]
    return []


def _grey(members: list[str]) -> list[str]:
    own = {m.rpartition(".")[2]: m for m in members}
    if "Y" not in own or "X" in own:  # a vector
        return []
    return 3 * [own["Y"]] + [own[c] for c in "A" if c in own]


def _some_of_rgb(members: list[str]) -> list[str]:
    own = {m.rpartition(".")[2]: m for m in members}
    if not own.keys() & set("RGB"):
        return []
    return [own.get(c, "") for c in "RGB"] + [own[c] for c in "A" if c in own]


def is_color(title: str) -> bool:
    """True if a name says that it is the picture."""
    return ending(title, _TITLES) is not None


def is_depth(title: str) -> bool:
    """True if a name says that it is depth."""
    end = ending(title, _DEPTH)
    return end is not None and not is_of_space(title, end)


def find_depth(
    names: Iterable[str], wanted: str | None = None, near: str | None = None
) -> str | None:
    """The channel that holds depth, beside the channel `near`; None if no name says so."""
    by_layer = layers(names, near)
    if wanted is not None:
        return one_channel(by_layer, wanted, "depth layer")
    if "Z" in by_layer.get("", ()):
        return "Z"
    picture = by_layer.get((near or "").rpartition(".")[0], [])
    if rgb(picture) and (beside := [m for m in picture if component(m) == "z"]):
        return beside[0]
    kinds = {
        k: found for k in by_layer if (found := ending(k, _DEPTH)) and not is_of_space(k, found)
    }
    ranked = sorted(kinds, key=lambda k: (not is_whole(k, kinds[k]), _DEPTH.index(kinds[k])))
    if ranked:
        return by_layer[ranked[0]][0]
    alone = (m for members in by_layer.values() for m in members if not is_component(m))
    return next((m for m in alone if is_depth(m)), None)


def find_triple(names: Iterable[str], stems: Collection[str], near: str | None = None) -> list[str]:
    """The three channels (x, y, z or r, g, b) of a layer with one of these names, in any case,
    beside the channel `near`; none if no name says so.
    """
    for layer, members in layers(names, near).items():
        if stem(layer) in stems and len(members) == 3:
            return members
    return []


def pick(by_layer: Mapping[str, list[str]], wanted: str, kind: str) -> str:
    """The layer called `wanted`: its full name, or its last part if that is unambiguous."""
    if wanted in by_layer:
        return wanted
    plain = "".join(_WORD.findall(wanted)).lower()
    for alike in (
        [k for k in by_layer if stem(k) == wanted.lower()],
        [k for k in by_layer if plain and ending(k, (plain,))],
    ):
        if len(alike) == 1:
            return alike[0]
    there = ", ".join(map(repr, by_layer))
    raise MissingLayerError(f"no {kind} {wanted!r}; available: {there}")


def one_channel(by_layer: Mapping[str, list[str]], wanted: str, kind: str) -> str:
    """The channel called `wanted`, or the first of the layer of that name."""
    everything = [name for members in by_layer.values() for name in members]
    return wanted if wanted in everything else by_layer[pick(by_layer, wanted, kind)][0]


def grey(channels: Channels) -> np.ndarray:
    """The one channel of a grey picture, or the red one of a coloured one."""
    for name in ("Y", "R"):
        if name in channels:
            return channels[name]
    return channels[next(iter(layers(channels).values()))[0]]
