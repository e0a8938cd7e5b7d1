"""Meaning of the numbers of motion vectors, tested by warping the neighbouring frames.

A reading of the vectors is a flip of their axes, and a scale along each. The right one puts the
colours of the neighbouring frames where those of the frame are. Up to _PROBES moving pixels are
compared, over all frames that are tested together. Of vectors that are all below a pixel, the unit
is unknown: they may be fractions of the picture, or of the longest motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .tones import bilinear, tone
from .vectors import Vectors

_PROBES = 20_000  # pixels compared at most
_ROUGHLY = 800  # pixels compared while the scale is searched for
_SCALES = np.geomspace(0.1, 10, 95)  # 5 % apart: half a pixel of a motion of 10
_FAR = np.geomspace(1 / 250, 10, 161)  # of vectors that predict nothing: they may be of a second
_NEARBY = 1.15  # of the least difference: as good while it is measured roughly
_HARDLY = 0.85  # of the stated reading's difference, roughly: more is not clearly better
_GOLDEN = (5**0.5 - 1) / 2
_STEPS = 10  # of the golden section: to 0.1 % of the scale
_NTSC = 1.001  # by which the rates of NTSC are below whole ones
_RATES = (24, 24 / _NTSC, 25, 30, 30 / _NTSC, 48, 50, 60, 60 / _NTSC, 100, 120)
"""Frames per second, of vectors in pixels per second."""
_HALVES = tuple(n / 2 for n in range(2, 21))  # frames, that vectors may be of
_PLAIN = tuple(sorted({float(n) for n in range(1, 11)} | {1 / n for n in (*_HALVES, *_RATES)}))
_POWERS = tuple(2.0**n for n in range(1, 15))  # as which the longest motion is chosen [px]
_FRACTIONS = (1.0, 0.5)  # of the picture's size: from 0 to 1, and from -1 to 1
_FLIPS = ("", "y", "x", "xy")
_MOVING = 1.0  # [px] slower pixels say nothing about a convention
_STILL = 0.05  # [px] vectors that are shorter everywhere are 0, unless they have another unit
_NOTHING = 1e-5  # vectors that are shorter everywhere are 0, whatever their unit
_TOP = 0.999  # quantile of the speeds that is the fastest of vectors of an unknown unit
_ACROSS = 2.5  # longer vectors are no fractions of the picture: from -1 to 1 it is 2 wide
_SLOW = 0.05  # of it: slower pixels say nothing
_FEWEST = 16  # moving pixels that say anything
_MOST = 0.3  # difference of tones beyond which a pixel has merely changed
_EXPLAINS = 0.9  # what a right reading leaves at most of the unmoved difference
_CLEARLY = 0.75  # another reading must leave less than this share of the difference
_ALIKE = 1.02  # of the least difference: as good
_MATTERS = 0.05  # of the unmoved difference: what another reading must at least explain more
_BLOCK = 4  # [px] side of the squares whose means tell whether two pictures differ
_CHANGED = 0.06  # difference of such means, of tones, which is no noise,
_OF_LIGHT = 0.2  # or this share of the brighter tones, in the dark
_BRIGHTER = 0.95  # quantile of the tones
_CHANGES = 4, 0.001  # such squares: so many at least, and this share of all


@dataclass(frozen=True)
class ConventionFinding:
    """Result of testing vectors on the neighbouring frames."""

    vectors: Vectors | None  # the reading that explains the neighbours; None: there are none
    sure: bool  # tested: something moves, and one reading is clearly better than standing still
    text: str  # for people
    notable: bool = False  # not what the names say, or doubtful: people should be told
    left: float = 1.0  # of the difference to the neighbouring frames, along the vectors

    @property
    def is_failed(self) -> bool:
        """The vectors were tested, and do not predict the neighbouring frames."""
        return self.vectors is not None and self.notable and not self.sure


@dataclass(frozen=True)
class Evidence:
    """Test of one frame's vectors."""

    lookups: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = field(
        default_factory=list
    )
    """To each neighbour: tones (n, 3) and places (n, 2) of the probes, their motion there as read
    (n, 2), and the neighbour's tones (height, width, 3)."""
    sides: tuple[int, ...] = ()
    """Of each lookup: -1 to the previous frame, 1 to the next."""
    fastest: float = 0.0
    """Length of the longest vectors [px, as read]."""
    is_below: bool = False
    """All vectors are below a pixel, or all but a few."""
    differs: bool = False
    """The picture differs from a neighbour by more than noise; only looked at where `is_below`."""
    whole: tuple[int, int] = (1, 1)
    """Width and height [px] of the whole picture."""
    rate: float | None = None
    """Frames per second, where the file states them."""
    doubt: str = ""
    """The reason why it cannot be tested."""

    @property
    def is_open(self) -> bool:
        """The vectors are so short that they may have another unit than pixels."""
        return self.is_below or self.fastest < _ACROSS

    def unit_lacking(self, vectors: Vectors) -> str:
        """The option that vectors below a pixel need if their unit is unknown; "" for others."""
        is_known = vectors.scale != 1 or vectors.convention == "blender"
        if is_known or not self.is_below or self.fastest <= _NOTHING:
            return ""
        if vectors.middle:
            return (
                "they are all below a pixel, and their unit is unknown: `vector_scale` must be "
                "twice the longest motion in pixels"
            )
        width, height = self.whole
        return (
            "they are all below a pixel: if they are fractions of the picture, "
            f"`vector_scale={width},{height}` makes them pixels"
        )

    @property
    def count(self) -> int:
        """Number of probes."""
        return len(self.lookups[0][0]) if self.lookups else 0


def gathered(
    color: np.ndarray,
    motion: np.ndarray,
    prev: np.ndarray | None,
    next_: np.ndarray | None,
    whole: tuple[int, int] | None = None,
    rate: float | None = None,
) -> Evidence:
    """The evidence of a frame: `color` and the neighbours (height, width, 3 or 4), linear.

    `motion`: (height, width, 4) [px], to_prev and to_next as they are read. A neighbour that is
    not there, or of another size, is None. `whole`: width and height of the display window. `rate`:
    frames per second, where they are known.
    """
    sides = {
        side: (m, tone(c[..., :3]))
        for side, m, c in ((-1, motion[..., :2], prev), (1, motion[..., 2:], next_))
        if c is not None and c.shape[:2] == color.shape[:2]
    }
    speeds = _speeds([m for m, _ in sides.values()] or [motion[..., :2], motion[..., 2:]])
    moving = speeds > _MOVING
    fastest, is_below = _fastest(speeds), int(np.count_nonzero(moving)) < _FEWEST
    of = {"fastest": fastest, "is_below": is_below, "whole": whole or color.shape[1::-1]}
    of["rate"] = rate
    if not sides:
        return Evidence(doubt="no neighbouring frame to test it on", **of)
    at = _some(moving if fastest >= _ACROSS else speeds > max(_SLOW * fastest, _NOTHING))
    if is_below:
        here = tone(color[..., :3])
        of["differs"] = any(_differ(here, tone) for _, tone in sides.values())
        if len(at) < _FEWEST:
            return Evidence(doubt=_NOTHING_MOVES, **of)
    y, x = at.T
    tones, places = tone(color[y, x, :3]), at[:, ::-1].astype(np.float32)
    lookups = [(tones, places, m[y, x], tone) for m, tone in sides.values()]
    return Evidence(lookups, tuple(sides), **of)


_NOTHING_MOVES = "nothing moves, so it cannot be tested"
_ZERO = (
    "by name; they are 0 everywhere, but the pictures differ, so nothing will be blurred: "
    "was the renderer's own motion blur on (Blender), or off (Arnold, Redshift)?"
)
_BELOW = (
    "by name; they are all below a pixel, but the pictures differ by more, and no unit of them "
    "predicts the neighbouring frame: check them (`vector_scale`, `vector_offset`)"
)


@dataclass(frozen=True)
class _Reading:
    """Factors of the vectors as they were read."""

    flip: str = ""
    x: float = 1.0
    y: float = 1.0
    unit: float = 1.0  # x and y are so many times that of the unit that was tried
    is_turned: bool = False

    def of(self, vectors: Vectors) -> Vectors:
        """`vectors`, read so."""
        meant = replace(vectors, flip=_combine(vectors.flip, self.flip))
        meant = replace(meant, turned=vectors.turned != self.is_turned)
        return meant.scaled(self.x, self.y)


_STATED = _Reading()


def decide(
    vectors: Vectors,
    evidence: Sequence[Evidence],
    *,
    has_both: bool = False,
    is_named: bool = True,
) -> ConventionFinding:
    """Test `vectors`, as which all motion in the evidence was read; frames are taken together.

    Every reading warps the neighbours; the one that leaves the least difference is meant. The
    stated one is kept unless another leaves less than _CLEARLY of its difference, and explains
    _MATTERS more. `has_both`: those to either side were stored, so one may be turned. `is_named`:
    their name says which way y points.
    """
    tested = [e for e in evidence if e.lookups]
    tested = [e for e in tested if not e.is_below] or tested
    is_zero = all(e.fastest <= _STILL for e in evidence if not e.doubt or e.fastest or e.is_below)
    zero = ConventionFinding(vectors, False, f"{vectors}, {_ZERO}", notable=True)
    if not tested:
        if evidence and all(e.is_below for e in evidence) and any(e.differs for e in evidence):
            return zero
        doubts = [e.doubt for e in evidence if e.doubt] or ["no frame to test it on"]
        return _untested(vectors, doubts[-1], evidence, is_named)
    probes = _Probes(tested, _PROBES)
    still = probes.difference(_Reading(x=0.0, y=0.0))
    if still == 0:
        doubt = "moving parts look the same in all frames: not testable"
        return _untested(vectors, doubt, evidence, is_named)
    stated = probes.difference(_STATED)
    best, left = _best(tested, probes, vectors, stated, has_both)
    if left > min(_CLEARLY * stated, stated - _MATTERS * still):
        best, left = _STATED, stated
    if left > _EXPLAINS * still:
        if tested[0].is_below and not any(e.differs for e in tested):
            return ConventionFinding(vectors, False, f"{vectors}, by name ({_NOTHING_MOVES})")
        if tested[0].is_below:
            text = f"{vectors}, {_BELOW}"
            return zero if is_zero else ConventionFinding(vectors, False, text, notable=True)
        text = f"{vectors}, by name; no interpretation of them predicts the neighbouring frame"
        return ConventionFinding(vectors, False, text + ": check them", notable=True)
    if best == _STATED:
        text = (
            f"moved along them, the next frame matches ({left / still:.0%} of the difference left)"
        )
        text = f"{vectors}, tested: {text}"
        return ConventionFinding(vectors, True, text, left=left / still)
    meant = best.of(vectors)
    text = (
        f"{meant}{_unit(best, tested[0])}, because moved along them, the next frame matches "
        f"({left / still:.0%} of the difference left; {stated / still:.0%} with {vectors})"
        f"{_unknown(best, meant, tested[0])}"
    )
    return ConventionFinding(meant, True, text, notable=True, left=left / still)


def _untested(
    vectors: Vectors, doubt: str, evidence: Sequence[Evidence], is_named: bool
) -> ConventionFinding:
    """The finding about vectors that cannot be tested, with the options that may be needed."""
    moving = [e for e in evidence if e.doubt != _NOTHING_MOVES and e.fastest > _NOTHING]
    units = [e.unit_lacking(vectors) for e in moving]
    lacking = [units[0]] if units and all(units) else []
    if moving and not is_named and not vectors.flip:
        lacking.append("y is taken to point down; `vector_flip=y` makes it point up")
    text = "; ".join([f"{vectors}, by name ({doubt})", *lacking])
    return ConventionFinding(vectors, False, text, notable=bool(lacking))


def _unit(reading: _Reading, evidence: Evidence) -> str:
    """The unit that a reading gives the vectors, in words."""
    if reading.x != reading.y:
        named = {1.0: "fractions of the picture", 0.5: "-1 to 1 over the picture"}
        return f" ({named.get(reading.unit, f'{reading.unit:.3g} of the picture')})"
    if evidence.is_below or (evidence.is_open and reading.x > _SCALES[-1]):
        return f" (1 is {reading.x:.4g} px)"
    if reading.x in _seconds(evidence):
        return f" (pixels per second, at {1 / reading.x:.5g} frames per second)"
    is_known = reading.x > 1 or reading.x in _PLAIN  # below a frame: the time of an open shutter
    return f" (vectors of {1 / reading.x:.3g} frames)" if reading.x != 1 and is_known else ""


def _unknown(reading: _Reading, meant: Vectors, evidence: Evidence) -> str:
    """The doubt about a reading that is no known unit, in words; "" if there is none."""
    is_known = reading.x != reading.y or reading.x >= 1 or _unit(reading, evidence)
    scale = ",".join(f"{s:g}" for s in dict.fromkeys(meant.scales))
    return (
        ""
        if is_known
        else (
            f"; they are {1 / reading.x:.3g} times as long as the motion, which is no known unit: "
            f"check them (`vector_scale={scale}` reads them so)"
        )
    )


def _seconds(evidence: Evidence) -> tuple[float, ...]:
    """Scales from pixels per second to pixels per frame; the rate of the file comes first."""
    own = (1 / evidence.rate,) if evidence.rate else ()
    return (*own, *(1 / rate for rate in _RATES))


def _best(
    tested: Sequence[Evidence], probes: _Probes, vectors: Vectors, stated: float, has_both: bool
) -> tuple[_Reading, float]:
    """The reading that is meant, and the difference that it leaves."""
    left = {_STATED: stated}
    for reading in _search(tested, probes, has_both):
        left[reading] = probes.difference(reading)
    least = min(left.values())
    own = _seconds(tested[0])[:1] if tested[0].rate else ()
    # Of readings that do as well (nothing moves along y, say) the plainest.
    best = min(
        (k for k, d in left.items() if d <= _ALIKE * least),
        key=lambda k: (
            len(_combine(vectors.flip, k.flip)),
            k.is_turned,
            k != _STATED,
            k.unit not in (_FRACTIONS if k.x != k.y else (*_PLAIN, *_POWERS, *own)),
            k.unit not in own,
            left[k],
        ),
    )
    return best, left[best]


@dataclass(frozen=True, eq=False)
class _Unit:
    """A unit that vectors may have, of `x` and `y` [px]: the multiples of it that are tried."""

    x: float
    y: float
    multiples: np.ndarray
    plain: tuple[float, ...]


def _units(evidence: Evidence, is_lost: bool) -> list[_Unit]:
    """The units that the vectors of some frames may have. `is_lost`: they predict nothing."""
    if not evidence.is_open:
        return [_Unit(1.0, 1.0, _FAR if is_lost else _SCALES, (*_PLAIN, *_seconds(evidence)))]
    width, height = evidence.whole
    span = np.log(width * 2) / np.log(_SCALES[1] / _SCALES[0])
    lengths = np.geomspace(0.5, width, int(span) + 1) / max(evidence.fastest, _NOTHING)
    found = [_Unit(1.0, 1.0, lengths, (*_PLAIN, *_POWERS))]
    if width != height:
        found.insert(0, _Unit(float(width), float(height), _SCALES, _FRACTIONS))
    return found


def _search(tested: Sequence[Evidence], probes: _Probes, has_both: bool) -> list[_Reading]:
    """Readings that may be meant: of each flip the best scale, if it does nearly as well as any.

    None if no reading is clearly better than the stated one.
    """
    few = _Probes(tested, _ROUGHLY)
    stated, still = few.difference(_STATED), few.difference(_Reading(x=0.0, y=0.0))
    turns = (False, True) if has_both else (False,)
    rough = {
        (unit, flip, turned): [
            few.difference(_reading(unit, flip, scale, turned)) for scale in unit.multiples
        ]
        for unit in _units(tested[0], stated > _HARDLY * still)
        for flip in _FLIPS
        for turned in turns
    }
    least = min(map(min, rough.values()))
    if least > _HARDLY * stated:
        return []
    most, readings = _NEARBY * least, []
    for (unit, flip, turned), differences in rough.items():
        if min(differences) <= most:
            middle = float(unit.multiples[int(np.argmin(differences))])
            readings += _refined(probes, unit, flip, turned, middle)
    return readings


def _refined(
    probes: _Probes, unit: _Unit, flip: str, turned: bool, middle: float
) -> list[_Reading]:
    """Readings with the best multiple of a unit near `middle`, as it is, and a plain one."""
    step = float(unit.multiples[1] / unit.multiples[0])
    scale = _golden(
        lambda s: probes.difference(_reading(unit, flip, s, turned)), middle / step, middle * step
    )
    found = [_reading(unit, flip, float(f"{scale:.3g}"), turned)]
    if (unit.x, unit.y) == (1, 1):
        found.append(_reading(unit, flip, 1.0, turned))
    near = [plain for plain in unit.plain if abs(np.log(plain / scale)) < np.log(step)]
    return found + [_reading(unit, flip, plain, turned) for plain in near]


def _reading(unit: _Unit, flip: str, scale: float, turned: bool) -> _Reading:
    return _Reading(flip, unit.x * scale, unit.y * scale, scale, turned)


def _golden(difference: Callable[[float], float], low: float, high: float) -> float:
    """Argument at which a function with one minimum is least."""
    inner = [high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)]
    values = [difference(s) for s in inner]
    for _ in range(_STEPS):
        if values[0] <= values[1]:
            high, inner[1], values[1] = inner[1], inner[0], values[0]
            inner[0] = high - _GOLDEN * (high - low)
            values[0] = difference(inner[0])
        else:
            low, inner[0], values[0] = inner[0], inner[1], values[1]
            inner[1] = low + _GOLDEN * (high - low)
            values[1] = difference(inner[1])
    return inner[0] if values[0] <= values[1] else inner[1]


def _combine(a: str, b: str) -> str:
    return "".join(axis for axis in "xy" if (axis in a) != (axis in b))


class _Probes:
    """At most `most` probes of several frames, evenly."""

    def __init__(self, tested: Sequence[Evidence], most: int):
        each = most // len(tested)
        self._lookups = [
            (side, *(array[:each] for array in arrays), tones)
            for e in tested
            for side, (*arrays, tones) in zip(e.sides, e.lookups, strict=True)
        ]

    def difference(self, reading: _Reading) -> float:
        """Mean difference of warped neighbours, robust against things that appear and disappear."""
        scales = zip("xy", (reading.x, reading.y), strict=True)
        factor = np.array([-s if axis in reading.flip else s for axis, s in scales], np.float32)
        total, count = 0.0, 0
        for side, here, at, motion, neighbour in self._lookups:
            turned = -factor if reading.is_turned and side < 0 else factor
            there = bilinear(neighbour, at + motion * turned)
            total += float(np.minimum(np.abs(there - here).sum(axis=1), _MOST).sum())
            count += len(here)
        return total / count


def _speeds(motions: Sequence[np.ndarray]) -> np.ndarray:
    """(height, width) length of the shortest of several motions; 0 where one is not finite."""
    with np.errstate(all="ignore"):
        speeds = np.stack([np.hypot(m[..., 0], m[..., 1]) for m in motions])
    return np.where(np.isfinite(speeds).all(axis=0), speeds.min(axis=0), 0)


def _fastest(speeds: np.ndarray) -> float:
    """Length of the longest vectors but a few; of the very longest where only a few move."""
    top = float(np.quantile(speeds, _TOP))
    return top if top > _NOTHING else float(speeds.max())


def _some(moving: np.ndarray) -> np.ndarray:
    """Up to _PROBES of the pixels (y, x) that move, in random order."""
    at = np.argwhere(moving)
    return at[np.random.default_rng(0).permutation(len(at))[:_PROBES]]


def _differ(a: np.ndarray, b: np.ndarray) -> bool:
    """Return True if two pictures' tones differ by more than noise, somewhere."""
    height, width = (_BLOCK * (side // _BLOCK) for side in a.shape[:2])
    apart = a[:height, :width].astype(np.float32) - b[:height, :width]
    light = float(max(np.quantile(tones[::3, ::3], _BRIGHTER) for tones in (a, b)))
    least = min(_CHANGED, _OF_LIGHT * light)
    blocks = apart.reshape(height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK, 3).mean(axis=(1, 3))
    changed, (fewest, share) = np.abs(blocks).max(axis=2) > least, _CHANGES
    return int(changed.sum()) >= max(fewest, share * changed.size)
