"""Motion vectors as programs write them -> to_prev, to_next in pixels, y down.

Foreign conventions end here. A convention is the meaning of the numbers; vector_test.py finds out
whether they do.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError, check_choice
from ...io.data_files import Unit
from .conventions import CONVENTIONS, STEMS, Convention
from .names import (
    TRIPLES,
    MissingLayerError,
    component,
    ending,
    is_depth,
    is_of_space,
    is_whole,
    layers,
    one_channel,
    pick,
    rgb,
    stem,
)

_BACKWARD = (
    "backward",
    "toprev",
    "motionback",
    "backvector",
    "backwardvector",
    "backwardflow",
    "bwd",
)
_DOWN = ("toprev", "tonext")  # layers whose y points down, as wgmb and flow files write them
_PAIR = re.compile(r"(?:(?P<layer>.+)\.)?(?P<stem>[A-Za-z_ -]+?)[ _-]?[xyuvXYUV]")
_PAIR_BEHIND = re.compile(r"(?:(?P<layer>.+)\.)?[xyuvXYUV][ _-]?(?P<stem>[A-Z][A-Za-z_ -]+)")
_AXES = ("xyz", "XYZ", "uvw", "UVW")  # letters that tell the channels of a vector apart
_NO_VECTOR = re.compile(r"[RGBAYZrgbaz]|.*([iI]d|ID)|.*[cC]rypto.*")  # channels beside the picture
_UNIT = 0.02  # from 1: the length of a unit vector, in half floats
_STEP = 1 / 255  # of 8 bits, by which 0.5 may be off
_MOSTLY = 0.9  # of the pixels: at edges, unit vectors are mixed with others
_NEARLY = 0.9  # of the numbers
_WIDE = 0.25  # from the middle: where the median of numbers lies that are stored around it
NOWHERE = 9999.0
"""Numbers from here on, either way, stand for no vector: Blender writes 10000 where nothing was
rendered, others -9999, .flo files 1e9 where the flow is unknown."""
_NUMBERS = STEMS | {stem for stems in TRIPLES.values() for stem in stems} | {"p", "position", "uv"}
_VALID = ("mv_alpha", "mvalpha")  # layers or channels, after RE:Vision Effects' MV_Alpha
_FULL = 0.999  # of the mask: vectors are valid
_AROUND = ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))


def holds_numbers(layer: str) -> bool:
    """True if the name of a layer says that it holds vectors, directions or places, no colours."""
    return ending(layer, _NUMBERS) is not None


@dataclass(frozen=True)
class Vectors:
    """Vectors to read, and their convention.

    `convention`: "auto", "none" or a name in CONVENTIONS. `layer`: name of a layer that cannot be
    found automatically, or of two channels, that for x first: "dx,dy". `offset`, the value that
    encodes zero motion, is subtracted first, then `scale` multiplies, or one for x and one for y;
    `flip` reverses "x", "y" or "xy". `mask`: layer that is 1 where the vectors are valid, or
    "none"; by default one called MV_Alpha, or the alpha of rsmb's vectors. `turned`: those to the
    previous frame lead from it.
    """

    convention: str = "auto"
    layer: str | None = None
    scale: float | tuple[float, float] = 1.0
    offset: float | None = None
    flip: str = ""
    mask: str | None = None
    turned: bool = False

    def __post_init__(self) -> None:
        check_choice("`vectors`", self.convention, ("auto", *CONVENTIONS, "none"))
        if self.flip not in ("", "x", "y", "xy"):
            raise InputError(f"vector flip must be x, y or xy, got {self.flip!r}")
        if not np.isfinite(self.scales).all() or not np.isfinite(self.offset or 0.0):
            raise InputError("vector scale and offset must be finite")

    @property
    def scales(self) -> tuple[float, float]:
        """The factors of x and y."""
        return self.scale if isinstance(self.scale, tuple) else (self.scale, self.scale)

    def scaled(self, x: float, y: float) -> Vectors:
        """The same vectors, read so many times as long along x and y."""
        x, y = (round(own * more, 9) for own, more in zip(self.scales, (x, y), strict=True))
        return replace(self, scale=x if x == y else (x, y))

    @property
    def is_told(self) -> bool:
        """True if nothing about the numbers is to be found out: a convention with its unit.

        Numbers around 0.5 count in units of the longest motion, or of pixels; only a scale tells.
        """
        if self.convention in ("auto", "none"):
            return self.convention == "none"
        has_unit = self.middle == 0 or CONVENTIONS[self.convention].of_picture
        return has_unit or self.scale != 1

    @property
    def middle(self) -> float:
        """The number that stands for no motion."""
        return CONVENTIONS[self.convention].offset if self.offset is None else self.offset

    def __str__(self) -> str:
        x, y = self.scales
        more = [f"scale {x:g}" if x == y else f"scale {x:g},{y:g}"] if (x, y) != (1, 1) else []
        more += [f"offset {self.offset:g}"] if self.offset is not None else []
        more += [f"flip {self.flip}"] if self.flip else []
        more += ["previous turned"] if self.turned else []
        more += [f"mask {self.mask}"] if self.mask else []
        return " ".join((self.convention, *more))


def named(
    names: Iterable[str],
    wanted: Vectors,
    near: str | None = None,
    units: Mapping[str, Unit] | None = None,
) -> Vectors | None:
    """`wanted` with "auto" replaced by the convention the layers' names speak for.

    Layers beside the channel `near` come first, and before all those of which their file tells the
    unit, in `units`. None: "none", or no name speaks for any.
    """
    if wanted.convention == "none":
        return None
    if wanted.convention != "auto":
        return wanted
    by_layer = _layers(names, near, wanted.layer)
    if wanted.layer is not None:
        only = pick(by_layer, wanted.layer, "vector layer")
        by_layer = {only: by_layer[only]}
    if wanted.scale == 1 and wanted.offset is None:
        for layer, unit in (units or {}).items():
            if layer in by_layer:
                form = "rsmb" if unit.is_up else "plain"
                return replace(wanted, convention=form, layer=layer, scale=unit.px,
                               offset=None if unit.is_up else unit.still)  # fmt: skip
    for name, convention in CONVENTIONS.items():
        if _find(by_layer, convention):
            return replace(wanted, convention=name)
    return replace(wanted, convention="plain") if wanted.layer is not None else None


def direction_of(title: str) -> int | None:
    """-1 if a name says that it is motion to the previous frame, 1 for other motion, else None."""
    if ending(title, _BACKWARD):
        return -1
    return 1 if ending(title, STEMS) else None


def candidates(channels: Mapping[str, np.ndarray], near: str | None = None) -> dict[str, str]:
    """Layers that may hold vectors under a name that does not say so, and the reason, in words.

    They have two channels, or three, with numbers of motion. Those of three are not called as
    places or directions in space. An alpha that is 1 everywhere is no channel of theirs. Of a
    larger layer, and of the channels without one, parts count, by the name "x,y" of two channels.
    """
    by_layer: dict[str, str] = {}
    for layer, all_members in layers(channels, near).items():
        is_opaque = component(all_members[-1]) in ("a", "alpha") and np.all(
            channels[all_members[-1]] == 1
        )
        members = all_members[:-1] if is_opaque else all_members
        if layer and len(members) in (2, 3):
            parts = {} if len(members) == 3 and is_of_space(layer) else {layer: members}
        else:
            parts = _parts(members)
        reasons = {name: _likeness(channels, part) for name, part in parts.items()}
        by_layer |= {name: reason for name, reason in reasons.items() if reason}
    return by_layer


def _parts(members: list[str]) -> dict[str, list[str]]:
    """Channels of one layer that may be vectors, by the name "x,y" of the first two.

    Their names differ by one letter, x and y or u and v; those with z or w there, too, are not
    called as places or directions in space. Where no names differ so, they are the two or three
    channels without a layer that nothing else explains.
    """
    layer = members[0].rpartition(".")[0]
    lead = f"{layer}." if layer else ""
    own = sorted({name.removeprefix(lead) for name in members} - {"Z"})
    parts = {stem: part for name in own for stem, part in _called_as_axes(name, own)}
    components = [n for n in own if not (_NO_VECTOR.fullmatch(n) or is_depth(n))]
    if not parts and not layer and len(components) in (2, 3):
        parts = {"": components}
    kept = [part for stem, part in parts.items() if len(part) == 2 or not is_of_space(stem)]
    return {f"{lead}{part[0]},{lead}{part[1]}": [lead + name for name in part] for part in kept}


def _called_as_axes(name: str, names: list[str]) -> list[tuple[str, list[str]]]:
    """Of `names` those that are `name` but for an axis, and what they have in common before it and
    behind it; nothing if `name` is not the first of at least two.
    """
    found = []
    for at, letter in enumerate(name):
        begin, end = name[:at], name[at + 1 :]
        axes = next((axes for axes in _AXES if axes[0] == letter), "")
        part = [begin + axis + end for axis in axes]
        if axes and part[1] in names:
            found.append((f"{begin} {end}", [n for n in part if n in names]))
    return found


def _likeness(channels: Mapping[str, np.ndarray], members: list[str]) -> str:
    """The reason to take channels for vectors, in words; "" if there is none.

    Unit vectors are directions. Numbers over 1 count in two channels that are called as axes, and
    not as places or directions in space.
    """
    planes = np.stack([channels[name][::3, ::3] for name in members]).astype(np.float32)
    are_axes = len(members) == 2 and _called_as_axes(members[0], members)
    are_axes = are_axes and not any(map(is_of_space, members[0].split(".")))
    with np.errstate(all="ignore"):
        if (planes < 0).any():
            reason = "has negative numbers"
        elif are_axes and (planes > 1).any():
            reason = "has numbers over 1"
        else:
            reason, planes = "is 0.5 in most places", _around_half(planes)
        lengths = np.sqrt((planes**2).sum(axis=0))
        is_unit = np.abs(lengths[lengths > 0] - 1) < _UNIT
    return reason if is_unit.size and is_unit.mean() < _MOSTLY else ""


def _around_half(planes: np.ndarray) -> np.ndarray:
    """Two numbers from 0 to 1 as -1 to 1, if most of them say that nothing moves; else 0.

    A third one that is mostly 1 tells directions: a surface that looks at the camera.
    """
    flat = planes[:2]
    is_still = np.abs(flat - 0.5) < _STEP
    is_stored_so = (planes >= 0).all() and (planes <= 1).all() and is_still.mean() > 0.5
    is_direction = len(planes) == 3 and np.median(planes[2]) > 1 - _STEP
    is_motion = is_stored_so and not is_still.all() and not is_direction
    return 2 * flat - 1 if is_motion else np.zeros_like(flat)


def named_as_flow(planes: Mapping[str, np.ndarray], title: str) -> dict[str, np.ndarray]:
    """Channels of a flow file of this title, u and v [px], y down, by names that say so."""
    words = ending(title, ("backward", "bwd", "back", "prev", "toprev", *_BACKWARD))
    layer = "to_prev" if words else "to_next"
    return {f"{title}.{layer}.{name}" if title else name: p for name, p in planes.items()}


def _layers(names: Iterable[str], near: str | None, wanted: str | None) -> dict[str, list[str]]:
    """Channels by layer; also of layers whose names stand beside X and Y, as in `BackVectorX`.

    Two channels that are `wanted`, with a comma between them, are a layer of that name.
    """
    names = list(names)
    by_layer, pairs = layers(names, near), dict[str, list[str]]()
    for name in sorted(names):
        for form in (_PAIR, _PAIR_BEHIND):
            if (m := form.fullmatch(name)) and ending(m["stem"], STEMS):
                pairs.setdefault(".".join(filter(None, (m["layer"], m["stem"]))), []).append(name)
                break
    by_layer |= {k: members for k, members in pairs.items() if len(members) == 2}
    two = (wanted or "").split(",")
    return by_layer | ({wanted: two} if wanted and len(two) == 2 and set(two) <= set(names) else {})


def _find(by_layer: Mapping[str, list[str]], convention: Convention) -> dict[str, list[str]]:
    """The layers of a convention, by stem; those that are called so alone come first."""
    found: dict[str, list[str]] = {}
    fitting: list[tuple[str, str]] = []
    for layer, members in by_layer.items():
        own = ending(layer, convention.stems)
        wanted = list(convention.components)
        has = [component(m) for m in members][: len(wanted)]
        if own and len(members) >= 2 and has == wanted and not is_of_space(layer, own):
            fitting.append((layer, own))
    for layer, own in sorted(fitting, key=lambda one: not is_whole(*one)):
        found.setdefault(own, by_layer[layer])
    return found


def in_pixels(vectors: Vectors, whole: tuple[int, int]) -> Vectors:
    """`vectors`, of which fractions of the picture get its width and height as their scale."""
    return vectors.scaled(*whole) if CONVENTIONS[vectors.convention].of_picture else vectors


def readings(
    channels: Mapping[str, np.ndarray],
    vectors: Vectors,
    whole: tuple[int, int],
    near: str | None = None,
) -> list[Vectors]:
    """`vectors`, as `named` found them, as their numbers may be read, the likeliest first.

    Numbers from 0 to 1 may have 0.5 for no motion, whatever their layer is called; those of a layer
    that should have it, but lie around 0, have 0. Fractions of a picture, of the size `whole`,
    become pixels. A Vector pass of Blender in a file of its own has its numbers in R, G, B and A.
    """
    vectors = in_pixels(vectors, whole)
    if vectors.offset is not None or vectors.convention == "blender":
        return [vectors]
    sides = channels_of(channels, vectors, near)
    if blenders := _as_blenders(channels, vectors, sides, near):
        return [blenders, vectors]
    planes = np.stack(
        [channels[name][::3, ::3].ravel() for pair in sides.values() for name in pair]
    )
    planes = planes[:, np.isfinite(planes).all(axis=0) & planes.any(axis=0)].astype(np.float32)
    if not planes.size:
        return [vectors]
    if vectors.middle:
        plain = replace(vectors, offset=0.0)
        return [plain, vectors] if _are_around(planes, 0) else [vectors, plain]
    low, high = np.quantile(planes, (1 - _NEARLY, _NEARLY))  # what is too fast may lie beyond
    if low < 0 or high > 1:
        return [vectors]
    if list(sides) == ["next"]:
        layer = _layer_of(channels, vectors, sides["next"], near)
        coded = replace(vectors, convention="rsmb", layer=layer)
    else:
        coded = replace(vectors, offset=0.5)
    return [coded, vectors] if _are_around(planes, 0.5) else [vectors, coded]


def _as_blenders(
    channels: Mapping[str, np.ndarray],
    vectors: Vectors,
    sides: Mapping[str, tuple[str, str]],
    near: str | None,
) -> Vectors | None:
    """`vectors` as a Vector pass in R, G, B and A, if they are called so and B and A are motion."""
    if vectors.convention != "plain" or list(sides) != ["next"]:
        return None
    layer = _layer_of(channels, vectors, sides["next"], near)
    members = _layers(channels, near, vectors.layer)[layer]
    is_called_so = ending(layer, CONVENTIONS["blender"].stems) is not None
    if not is_called_so or [component(name) for name in members] != ["r", "g", "b", "a"]:
        return None
    planes = np.stack([channels[name][::3, ::3] for name in members[2:]])
    with np.errstate(invalid="ignore"):
        is_motion = ((planes < 0) | ((planes > 1) & (planes < NOWHERE))).any()
    return replace(vectors, convention="blender", layer=layer) if is_motion else None


def _are_around(planes: np.ndarray, middle: float) -> bool:
    """Return True if the medians of all planes are near `middle`, and numbers lie around it."""
    apart = planes - np.float32(middle)
    is_near = np.abs(np.median(apart, axis=1)) < _WIDE
    return bool(is_near.all()) and bool(apart.min() <= 0 <= apart.max())


def _layer_of(
    names: Iterable[str], vectors: Vectors, pair: tuple[str, str], near: str | None
) -> str:
    """The layer, of those that have both channels, that has the fewest others."""
    by_layer = _layers(names, near, vectors.layer)
    fitting = [k for k, members in by_layer.items() if set(pair) <= set(members)]
    return min(fitting, key=lambda k: len(by_layer[k]))


def channels_of(
    names: Iterable[str], vectors: Vectors, near: str | None = None
) -> dict[str, tuple[str, str]]:
    """The x and y channels for "prev" and "next"; one of them may not be there."""
    convention = CONVENTIONS[vectors.convention]
    by_layer = _layers(names, near, vectors.layer)
    if vectors.layer is not None:
        members = by_layer[pick(by_layer, vectors.layer, "vector layer")]
        sides = [("next", convention.next)]
        if convention.prev and convention.prev != convention.next:
            sides.append(("prev", convention.prev))
        parts = [(side, members, where) for side, where in sides if where]
    else:
        parts = []
        there = _find(by_layer, convention)
        if not there and not any(_find(by_layer, c) for c in CONVENTIONS.values() if c.components):
            there = _find(by_layer, CONVENTIONS["plain"])  # names of no program's own
        for name, members in there.items():
            if convention.prev and convention.prev != convention.next:
                parts += [("prev", members, convention.prev), ("next", members, convention.next)]
            elif name in _BACKWARD:
                parts.append(("prev", members, convention.prev))
            else:
                parts.append(("next", members, convention.next))
    if not parts:
        raise MissingLayerError(
            f"no {vectors.convention} vectors ({' or '.join(convention.stems[:6])}); "
            f"available: {', '.join(map(repr, by_layer))}"
        )
    result: dict[str, tuple[str, str]] = {}
    for side, members, (x, y) in parts:
        if max(x, y) >= len(members):
            raise InputError(f"vector layer needs {max(x, y) + 1} components, has {len(members)}")
        result.setdefault(side, (members[x], members[y]))
    return result


def is_direction_named(names: Iterable[str], vectors: Vectors, near: str | None = None) -> bool:
    """True if a program uses the names of the layers, so that they say which way y points."""
    if vectors.convention != "plain":
        return True
    sides = channels_of(names, vectors, near)
    return all(ending(_layer_of(names, vectors, pair, near), _DOWN) for pair in sides.values())


def read(
    channels: Mapping[str, np.ndarray], vectors: Vectors, near: str | None = None
) -> np.ndarray:
    """(height, width, 4) float32: to_prev and to_next [px] of a frame's channels, plane by plane.

    Where one side is not there it is the other's opposite: a straight path. Where the vectors'
    mask is not 1 they are not valid, and the motion is 0; where it is between 0 and 1, at the
    edge of something, it is that of a valid pixel beside it, if there is one.
    """
    convention = CONVENTIONS[vectors.convention]
    sides = channels_of(channels, vectors, near)
    flip = np.array([-1 if axis in vectors.flip else 1 for axis in "xy"], np.float32)
    signs = {"prev": convention.prev_sign, "next": convention.next_sign}
    mask = mask_of(channels, vectors, near)

    first = channels[next(iter(sides.values()))[0]]
    motion = np.moveaxis(np.empty((4, *first.shape), np.float32), 0, 2)
    for side, (begin, other) in (("prev", (0, 2)), ("next", (2, 0))):
        if side not in sides:
            continue
        factor = np.array(vectors.scales, np.float32) * flip * np.array(signs[side], np.float32)
        factor *= -1 if vectors.turned and side == "prev" else 1
        nowhere = _nowhere(channels, sides[side], vectors.middle == 0.5 and not mask)
        for axis, name in enumerate(sides[side]):
            plane = motion[..., begin + axis]
            np.subtract(channels[name], np.float32(vectors.middle), out=plane)
            plane *= factor[axis]
            if nowhere is not None:
                plane[nowhere] = 0
        if len(sides) == 1:
            np.negative(motion[..., begin : begin + 2], out=motion[..., other : other + 2])
    if mask:
        _mask_out(motion, channels[mask], vectors.mask is not None)
    return motion


def _nowhere(
    channels: Mapping[str, np.ndarray], names: Iterable[str], is_black: bool
) -> np.ndarray | None:
    """Pixels whose numbers stand for no vector; None if that is nowhere. NaN is left to Frame.bad.

    `is_black`: so do two zeros, which an image has where nothing was drawn.
    """
    planes = [channels[name] for name in names]
    if is_black:
        return ~np.any(planes, axis=0)
    with np.errstate(invalid="ignore"):
        if all(max(p.max(initial=0), -p.min(initial=0)) < NOWHERE for p in planes):
            return None
        return np.any([(np.abs(p) >= NOWHERE) & np.isfinite(p) for p in planes], axis=0)


def mask_of(names: Iterable[str], vectors: Vectors, near: str | None = None) -> str | None:
    """The channel that is 1 where the vectors are valid, if there is one."""
    if vectors.mask == "none":
        return None
    by_layer = layers(names, near)
    if vectors.mask is not None:
        return one_channel(by_layer, vectors.mask, "vector mask layer")
    for layer, members in by_layer.items():
        if stem(layer) in _VALID:
            return members[0]
        for member in members:
            if component(member) in _VALID:
                return member
    if vectors.convention != "rsmb":
        return None
    pair = next(iter(channels_of(names, vectors, near).values()))
    beside = by_layer[pair[0].rpartition(".")[0]]
    if rgb(beside) and not set(pair) <= set(rgb(beside)):  # the alpha of a picture beside them
        return None
    return next((m for m in beside if component(m) in ("a", "alpha")), None)


def _mask_out(motion: np.ndarray, mask: np.ndarray, is_asked_for: bool) -> None:
    """Set the motion to 0 where the mask is not full.

    A mask that nobody asked for, and that is full nowhere, was not filled, and says nothing.
    """
    known = mask >= _FULL
    if known.all() or not (is_asked_for or known.any()):
        return
    height, width = mask.shape
    motion[~known] = 0
    y, x = np.nonzero(~known & (mask > 0))
    for down, right in _AROUND:
        near = np.clip(y + down, 0, height - 1), np.clip(x + right, 0, width - 1)
        has = known[near]
        motion[y[has], x[has]] = motion[near[0][has], near[1][has]]
        y, x = y[~has], x[~has]
