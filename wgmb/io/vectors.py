"""Motion vectors as programs write them -> to_prev, to_next in pixels, y down.

Foreign conventions end here. A convention is what the numbers mean; `detect` finds out
whether they do, by warping the neighbouring frame with them.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError, did_you_mean
from .layers import component, layers, pick, stem


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
_BACKWARD = ("backward", "to_prev")
_MOVING = 1.0  # [px] slower pixels say nothing about a convention
_BRIGHT = 1e4  # light beyond this is all the same
_PROBES = 20_000  # pixels compared
_EXPLAINS = 0.9  # what a right reading leaves at most of the unmoved difference
_CLEARLY = 0.75  # another reading must leave less than this share of the difference


@dataclass(frozen=True)
class Vectors:
    """Vectors to read, and their convention.

    `convention`: "auto", "none" or a name in CONVENTIONS. `layer`: name of a layer that cannot be
    found automatically. `offset`, the value that encodes zero motion, is subtracted first, then
    `scale` multiplies; `flip` reverses "x", "y" or "xy".
    """

    convention: str = "auto"
    layer: str | None = None
    scale: float = 1.0
    offset: float | None = None
    flip: str = ""

    def __post_init__(self) -> None:
        if self.convention not in ("auto", "none", *CONVENTIONS):
            known = ", ".join(("auto", *CONVENTIONS, "none"))
            hint = did_you_mean(self.convention, known.split(", "))
            raise InputError(f"vectors must be one of {known}, got {self.convention!r}{hint}")
        if self.flip not in ("", "x", "y", "xy"):
            raise InputError(f"vector flip must be x, y or xy, got {self.flip!r}")
        if not np.isfinite(self.scale) or not np.isfinite(self.offset or 0.0):
            raise InputError("vector scale and offset must be finite")

    def __str__(self) -> str:
        more = [f"scale {self.scale:g}"] if self.scale != 1 else []
        more += [f"offset {self.offset:g}"] if self.offset is not None else []
        more += [f"flip {self.flip}"] if self.flip else []
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
        raise InputError(
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
    """(height, width, 4) float32: to_prev and to_next [px] of a frame's channels.

    Where one side is not there it is the other's opposite: a straight path.
    """
    convention = CONVENTIONS[vectors.convention]
    sides = channels_of(channels, vectors, near)
    offset = convention.offset if vectors.offset is None else vectors.offset
    flip = np.array([-1 if axis in vectors.flip else 1 for axis in "xy"], np.float32)
    signs = {"prev": convention.prev_sign, "next": convention.next_sign}

    first = channels[next(iter(sides.values()))[0]]
    motion = np.empty((*first.shape, 4), np.float32)
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
    return motion


# ---- what the numbers really mean -----------------------------------------------------------


@dataclass(frozen=True)
class Finding:
    """Result of testing a convention by warping the neighbouring frame."""

    vectors: Vectors | None  # the reading that explains the neighbour; None: there are none
    sure: bool  # something moves, and one reading is clearly better than standing still
    text: str  # for people


_Pairs = list[tuple[np.ndarray, np.ndarray]]  # motion towards a neighbour, and its tones
_LEFT = "warping leaves {:.0%} of the difference to the neighbouring frame"
_ALTERNATIVES = tuple((flip, scale) for flip in ("", "y", "x", "xy") for scale in (1.0, 2.0, 0.5))


def detect(
    color: np.ndarray,
    motion: np.ndarray,
    prev_color: np.ndarray | None,
    next_color: np.ndarray | None,
    vectors: Vectors,
) -> Finding:
    """Test `vectors`, which were read as `motion`, against the neighbouring frames' colour.

    color: (height, width, 3 or 4); neighbours alike, or None. Every alternative (flipped,
    twice, half) warps the neighbours; the one that leaves the least difference is meant.
    """
    sides = ((motion[..., :2], prev_color), (motion[..., 2:], next_color))
    pairs = [
        (m, _tone(c[..., :3])) for m, c in sides if c is not None and c.shape[:2] == color.shape[:2]
    ]
    if not pairs:
        return Finding(vectors, False, f"{vectors}, by name (no neighbouring frame to test it on)")
    at = _moving_pixels(pairs)
    if len(at) < 16:
        return Finding(
            vectors, False, f"{vectors}, by name (nothing moves, so it cannot be tested)"
        )
    still = _difference(color, pairs, at, 0.0, "")
    if still == 0:
        text = f"{vectors}, by name (moving parts look the same in all frames: not testable)"
        return Finding(vectors, False, text)
    left = {
        (flip, scale): _difference(color, pairs, at, scale, flip) for flip, scale in _ALTERNATIVES
    }
    least = min(left.values())
    # Of readings that do as well (nothing moves along y, say) the plainest.
    best = min(
        (k for k, d in left.items() if d <= 1.02 * least),
        key=lambda k: (len(_combine(vectors.flip, k[0])), k != ("", 1.0), left[k]),
    )
    stated = left["", 1.0]
    if left[best] > _CLEARLY * stated:
        best = ("", 1.0)
    if left[best] > _EXPLAINS * still:
        text = f"{vectors}, by name; no interpretation of them predicts the neighbouring frame"
        return Finding(vectors, False, text + ": check them")
    if best == ("", 1.0):
        return Finding(vectors, True, f"{vectors}, tested: {_LEFT.format(stated / still)}")
    flip, scale = best
    meant = replace(vectors, flip=_combine(vectors.flip, flip), scale=vectors.scale * scale)
    then, now = _LEFT.format(stated / still), f"{left[best] / still:.0%}"
    return Finding(meant, True, f"{meant}, because with {vectors} {then}, with this {now}")


def _combine(a: str, b: str) -> str:
    return "".join(axis for axis in "xy" if (axis in a) != (axis in b))


def _moving_pixels(pairs: _Pairs) -> np.ndarray:
    """Up to _PROBES pixels (y, x) that move in every given direction."""
    moving = np.ones(pairs[0][0].shape[:2], bool)
    with np.errstate(all="ignore"):
        for motion, _ in pairs:
            speed = np.hypot(motion[..., 0], motion[..., 1])
            moving &= (speed > _MOVING) & np.isfinite(speed)
    at = np.argwhere(moving)
    chosen = np.random.default_rng(0).permutation(len(at))[:_PROBES]
    return at[chosen]


def _difference(color: np.ndarray, pairs: _Pairs, at: np.ndarray, scale: float, flip: str) -> float:
    """Mean difference, robust against what appears and disappears, of warped neighbours."""
    factor = np.array([-scale if axis in flip else scale for axis in "xy"])
    here = _tone(color[at[:, 0], at[:, 1], :3])
    total = 0.0
    for motion, neighbour in pairs:
        where = at[:, ::-1] + motion[at[:, 0], at[:, 1]] * factor
        there = _bilinear(neighbour, where)
        total += float(np.minimum(np.abs(there - here).sum(axis=1), 0.3).mean())
    return total / len(pairs)


def _tone(color: np.ndarray) -> np.ndarray:
    """Held to 0..1 without hard limit, so that one highlight does not decide."""
    light = np.clip(np.nan_to_num(color.astype(np.float32)), 0, _BRIGHT)
    return light / (1 + light)


def _bilinear(image: np.ndarray, where: np.ndarray) -> np.ndarray:
    height, width = image.shape[:2]
    x = np.clip(where[:, 0], 0, width - 1.001)
    y = np.clip(where[:, 1], 0, height - 1.001)
    left, top = x.astype(int), y.astype(int)
    right, below = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    u, v = (x - left)[:, None], (y - top)[:, None]
    upper = (1 - u) * image[top, left] + u * image[top, right]
    lower = (1 - u) * image[below, left] + u * image[below, right]
    return (1 - v) * upper + v * lower
