"""Motion vectors as programs write them -> to_prev, to_next in pixels, y down.

Foreign conventions end here. A convention is what the numbers mean; detect.py finds out whether
they do.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError, check_choice
from .names import (
    MissingLayerError,
    component,
    layers,
    one_channel,
    pick,
    stem,
)


@dataclass(frozen=True)
class Convention:
    """A program's convention. `signs` turn its vectors into displacements [px], y down."""

    about: str
    stems: tuple[str, ...]  # last part of the layer's name, lower case
    prev: tuple[int, int] | None  # which components lead to the previous frame
    next: tuple[int, int] | None
    prev_sign: tuple[int, int] = (1, 1)
    next_sign: tuple[int, int] = (1, 1)
    components: tuple[str, ...] = ()  # the layer must have these, if any are named
    offset: float = 0.0  # what stands for no motion


CONVENTIONS: dict[str, Convention] = {
    "blender": Convention(
        "Vector pass: pixels, y up; XY = P(n-1) - P(n), ZW = P(n) - P(n+1)",
        ("vector",),
        (0, 1),
        (2, 3),
        (1, -1),
        (-1, 1),
        ("x", "y", "z", "w"),
    ),
    "nuke": Convention(
        "forward.u/v to the next, backward.u/v to the previous frame: pixels, y up",
        ("forward", "backward"),
        (0, 1),
        (0, 1),
        (1, -1),
        (1, -1),
    ),
    "arnold": Convention(
        "motionvector: pixels to the next frame, y up; scale by 2 if rendered for half a frame",
        ("motionvector", "motion_vector"),
        None,
        (0, 1),
        (1, -1),
        (1, -1),
    ),
    "vray": Convention(
        "velocity: pixels to the next frame, y up, 0.5 added; scale by 2 x max velocity if clamped",
        ("velocity", "vrayvelocity"),
        None,
        (0, 1),
        (1, -1),
        (1, -1),
        ("r", "g"),
        0.5,
    ),
    "rsmb": Convention(
        "0..1, 0.5 is no motion, y up, to the next frame; scale by 2 x MaxDisplace",
        ("rsmb", "mv2dtoxik", "mv2d", "lm_2dmv"),
        None,
        (0, 1),
        (1, -1),
        (1, -1),
        (),
        0.5,
    ),
    "plain": Convention(
        "to_prev.x/y, to_next.x/y or velocity.x/y (to the next frame): pixels, y down",
        ("to_prev", "to_next", "velocity", "motion", "motionvectors"),
        (0, 1),
        (0, 1),
    ),
}
STEMS = frozenset(stem for convention in CONVENTIONS.values() for stem in convention.stems)
_BACKWARD = ("backward", "to_prev")
_VALID = ("mv_alpha", "mvalpha")  # layers or channels, after RE:Vision Effects' MV_Alpha
_FULL = 0.999  # of the mask: vectors are valid
_AROUND = ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))


@dataclass(frozen=True)
class Vectors:
    """Vectors to read, and their convention.

    `convention`: "auto", "none" or a name in CONVENTIONS. `layer`: name of a layer that cannot be
    found automatically. `offset`, the value that encodes zero motion, is subtracted first, then
    `scale` multiplies; `flip` reverses "x", "y" or "xy". `mask`: layer that is 1 where the vectors
    are valid, or "none"; by default one called MV_Alpha, or the alpha of rsmb's vectors.
    """

    convention: str = "auto"
    layer: str | None = None
    scale: float = 1.0
    offset: float | None = None
    flip: str = ""
    mask: str | None = None

    def __post_init__(self) -> None:
        check_choice("vectors", self.convention, ("auto", *CONVENTIONS, "none"))
        if self.flip not in ("", "x", "y", "xy"):
            raise InputError(f"vector flip must be x, y or xy, got {self.flip!r}")
        if not np.isfinite(self.scale) or not np.isfinite(self.offset or 0.0):
            raise InputError("vector scale and offset must be finite")

    def __str__(self) -> str:
        more = [f"scale {self.scale:g}"] if self.scale != 1 else []
        more += [f"offset {self.offset:g}"] if self.offset is not None else []
        more += [f"flip {self.flip}"] if self.flip else []
        more += [f"mask {self.mask}"] if self.mask else []
        return " ".join((self.convention, *more))


def named(names: Iterable[str], wanted: Vectors, near: str | None = None) -> Vectors | None:
    """`wanted` with "auto" replaced by the convention the layers' names speak for.

    Layers beside the channel `near` come first. None: "none", or no name speaks for any.
    """
    if wanted.convention == "none":
        return None
    if wanted.convention != "auto":
        return wanted
    by_layer = layers(names, near)
    if wanted.layer is not None:
        only = pick(by_layer, wanted.layer, "vector layer")
        by_layer = {only: by_layer[only]}
    for name, convention in CONVENTIONS.items():
        if _find(by_layer, convention):
            return replace(wanted, convention=name)
    return replace(wanted, convention="plain") if wanted.layer is not None else None


def _find(by_layer: Mapping[str, list[str]], convention: Convention) -> dict[str, list[str]]:
    """The layers of a convention, by stem."""
    found: dict[str, list[str]] = {}
    for layer, members in by_layer.items():
        fits = len(members) >= 2
        if convention.components:
            fits = [component(m) for m in members][: len(convention.components)] == list(
                convention.components
            )
        if stem(layer) in convention.stems and fits:
            found.setdefault(stem(layer), members)
    return found


def channels_of(
    names: Iterable[str], vectors: Vectors, near: str | None = None
) -> dict[str, tuple[str, str]]:
    """The x and y channels for "prev" and "next"; one of them may not be there."""
    convention = CONVENTIONS[vectors.convention]
    by_layer = layers(names, near)
    if vectors.layer is not None:
        members = by_layer[pick(by_layer, vectors.layer, "vector layer")]
        sides = [("next", convention.next)]
        if convention.prev and convention.prev != convention.next:
            sides.append(("prev", convention.prev))
        found = [(side, members, where) for side, where in sides if where]
    else:
        found = []
        for name, members in _find(by_layer, convention).items():
            if convention.prev and convention.prev != convention.next:
                found += [("prev", members, convention.prev), ("next", members, convention.next)]
            elif name in _BACKWARD:
                found.append(("prev", members, convention.prev))
            else:
                found.append(("next", members, convention.next))
    if not found:
        raise MissingLayerError(
            f"no {vectors.convention} vectors ({' or '.join(convention.stems)}); "
            f"available: {', '.join(map(repr, by_layer))}"
        )
    result: dict[str, tuple[str, str]] = {}
    for side, members, (x, y) in found:
        if max(x, y) >= len(members):
            raise InputError(f"vector layer needs {max(x, y) + 1} components, has {len(members)}")
        result.setdefault(side, (members[x], members[y]))
    return result


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
    offset = convention.offset if vectors.offset is None else vectors.offset
    flip = np.array([-1 if axis in vectors.flip else 1 for axis in "xy"], np.float32)
    signs = {"prev": convention.prev_sign, "next": convention.next_sign}

    first = channels[next(iter(sides.values()))[0]]
    motion = np.moveaxis(np.empty((4, *first.shape), np.float32), 0, 2)
    for side, (begin, other) in (("prev", (0, 2)), ("next", (2, 0))):
        if side not in sides:
            continue
        factor = np.float32(vectors.scale) * flip * np.array(signs[side], np.float32)
        for axis, name in enumerate(sides[side]):
            plane = motion[..., begin + axis]
            np.subtract(channels[name], np.float32(offset), out=plane)
            plane *= factor[axis]
        if len(sides) == 1:
            np.negative(motion[..., begin : begin + 2], out=motion[..., other : other + 2])
    if mask := mask_of(channels, vectors, near):
        _mask_out(motion, channels[mask], vectors.mask is not None)
    return motion


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
    sides = channels_of(names, vectors, near)
    beside = by_layer[next(iter(sides.values()))[0].rpartition(".")[0]]
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
