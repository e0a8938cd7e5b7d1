"""Meaning of the numbers of motion vectors, tested by warping the neighbouring frames.

A reading of the vectors is a flip of their axes and a scale. The right one puts the colours of the
neighbouring frames where those of the frame are. Up to _PROBES moving pixels are compared, over
all frames that are tested together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .vectors import Vectors

_PROBES = 20_000  # pixels compared at most
_ROUGHLY = 800  # pixels compared while the scale is searched for
_SCALES = np.geomspace(0.1, 10, 95)  # 5 % apart: half a pixel of a motion of 10
_NEARBY = 1.15  # of the least difference: as good while it is measured roughly
_HARDLY = 0.85  # of the stated reading's difference, roughly: more is not clearly better
_GOLDEN = (5**0.5 - 1) / 2
_STEPS = 10  # of the golden section: to 0.1 % of the scale
_PLAIN = tuple(sorted({float(n) for n in range(1, 11)} | {1 / n for n in range(2, 11)}))
_FLIPS = ("", "y", "x", "xy")
_MOVING = 1.0  # [px] slower pixels say nothing about a convention
_STILL = 0.05  # [px] vectors that are shorter everywhere are 0: 16-bit integers have no middle
_FEWEST = 16  # moving pixels that say anything
_BRIGHT = 1e4  # light beyond this is all the same
_MOST = 0.3  # difference of tones beyond which a pixel has merely changed
_EXPLAINS = 0.9  # what a right reading leaves at most of the unmoved difference
_CLEARLY = 0.75  # another reading must leave less than this share of the difference
_ALIKE = 1.02  # of the least difference: as good
_MATTERS = 0.05  # of the unmoved difference: what another reading must at least explain more
_BLOCK = 4  # [px] side of the squares whose means tell whether two pictures differ
_CHANGED = 0.06  # difference of such means, of tones, which is no noise
_CHANGES = 4, 0.001  # such squares: so many at least, and this share of all


@dataclass(frozen=True)
class ConventionFinding:
    """Result of testing vectors on the neighbouring frames."""

    vectors: Vectors | None  # the reading that explains the neighbours; None: there are none
    sure: bool  # something moves, and one reading is clearly better than standing still
    text: str  # for people
    notable: bool = False  # not what the names say, or doubtful: people should be told


@dataclass(frozen=True)
class Evidence:
    """Test of one frame's vectors."""

    lookups: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = field(
        default_factory=list
    )
    """To each neighbour: tones (n, 3) and places (n, 2) of the probes, their motion there as read
    (n, 2), and the neighbour's tones (height, width, 3)."""
    zero: bool = False
    """The vectors are 0 everywhere."""
    differs: bool = False
    """The picture differs from a neighbour by more than noise."""
    doubt: str = ""
    """The reason why it cannot be tested."""

    @property
    def count(self) -> int:
        """Number of probes."""
        return len(self.lookups[0][0]) if self.lookups else 0


def gathered(
    color: np.ndarray, motion: np.ndarray, prev: np.ndarray | None, next_: np.ndarray | None
) -> Evidence:
    """The evidence of a frame: `color` and the neighbours (height, width, 3 or 4), linear.

    `motion`: (height, width, 4) [px], to_prev and to_next as they are read. A neighbour that is
    not there, or of another size, is None.
    """
    sides = [
        (m, _tone(c[..., :3]))
        for m, c in ((motion[..., :2], prev), (motion[..., 2:], next_))
        if c is not None and c.shape[:2] == color.shape[:2]
    ]
    if not sides:
        return Evidence(doubt="no neighbouring frame to test it on")
    with np.errstate(invalid="ignore"):
        zero = not (np.abs(motion) > _STILL).any()
    if zero:
        here = _tone(color[..., :3])
        differs = any(_differ(here, tone) for _, tone in sides)
        return Evidence(zero=True, differs=differs, doubt=_NOTHING_MOVES)
    at = _moving_pixels([m for m, _ in sides])
    if len(at) < _FEWEST:
        return Evidence(doubt=_NOTHING_MOVES)
    y, x = at.T
    tones, places = _tone(color[y, x, :3]), at[:, ::-1].astype(np.float32)
    return Evidence([(tones, places, m[y, x], tone) for m, tone in sides])


_NOTHING_MOVES = "nothing moves, so it cannot be tested"
_ZERO = (
    "by name; they are 0 everywhere, but the pictures differ, so nothing will be blurred: "
    "was the renderer's own motion blur on (Blender), or off (Arnold, Redshift)?"
)


def decide(vectors: Vectors, evidence: Sequence[Evidence]) -> ConventionFinding:
    """Test `vectors`, as which all motion in the evidence was read; frames are taken together.

    Every reading warps the neighbours; the one that leaves the least difference is meant. The
    stated one is kept unless another leaves less than _CLEARLY of its difference, and explains
    _MATTERS more.
    """
    tested = [e for e in evidence if e.lookups]
    if not tested:
        if evidence and all(e.zero for e in evidence) and any(e.differs for e in evidence):
            return ConventionFinding(vectors, False, f"{vectors}, {_ZERO}", notable=True)
        doubts = [e.doubt for e in evidence if e.doubt] or ["no frame to test it on"]
        return ConventionFinding(vectors, False, f"{vectors}, by name ({doubts[-1]})")
    probes = _Probes(tested, _PROBES)
    still = probes.difference("", 0.0)
    if still == 0:
        text = f"{vectors}, by name (moving parts look the same in all frames: not testable)"
        return ConventionFinding(vectors, False, text)
    stated = probes.difference("", 1.0)
    flip, scale, left = _best(tested, probes, vectors, stated)
    if left > min(_CLEARLY * stated, stated - _MATTERS * still):
        flip, scale, left = "", 1.0, stated
    if left > _EXPLAINS * still:
        text = f"{vectors}, by name; no interpretation of them predicts the neighbouring frame"
        return ConventionFinding(vectors, False, text + ": check them", notable=True)
    if (flip, scale) == ("", 1.0):
        text = (
            f"moved along them, the next frame matches ({left / still:.0%} of the difference left)"
        )
        return ConventionFinding(vectors, True, f"{vectors}, tested: {text}")
    meant = replace(vectors, flip=_combine(vectors.flip, flip), scale=vectors.scale * scale)
    shown = f"{meant} (vectors of {1 / scale:.3g} frames)" if scale != 1 else f"{meant}"
    why = f"{left / still:.0%} of the difference to the next frame is left along them"
    text = f"{shown}, because {why}, and {stated / still:.0%} with {vectors}"
    return ConventionFinding(meant, True, text, notable=True)


def _best(
    tested: Sequence[Evidence], probes: _Probes, vectors: Vectors, stated: float
) -> tuple[str, float, float]:
    """The flip and scale that are meant, and the difference that they leave."""
    left = {("", 1.0): stated}
    for flip, scale in _search(tested, probes):
        left[flip, scale] = probes.difference(flip, scale)
    least = min(left.values())
    # Of readings that do as well (nothing moves along y, say) the plainest.
    best = min(
        (k for k, d in left.items() if d <= _ALIKE * least),
        key=lambda k: (
            len(_combine(vectors.flip, k[0])),
            k != ("", 1.0),
            k[1] not in _PLAIN,
            left[k],
        ),
    )
    return *best, left[best]


def _search(tested: Sequence[Evidence], probes: _Probes) -> list[tuple[str, float]]:
    """Readings that may be meant: of each flip the best scale, if it does nearly as well as any.

    None if no reading is clearly better than the stated one.
    """
    few = _Probes(tested, _ROUGHLY)
    rough = {flip: [few.difference(flip, s) for s in (1.0, *_SCALES)] for flip in _FLIPS}
    least = min(map(min, rough.values()))
    if least > _HARDLY * rough[""][0]:
        return []
    most, found = _NEARBY * least, []
    for flip, differences in rough.items():
        if min(differences) > most:
            continue
        found.append((flip, 1.0))
        middle = float((1.0, *_SCALES)[int(np.argmin(differences))])
        step = float(_SCALES[1] / _SCALES[0])
        scale = _golden(
            lambda s, flip=flip: probes.difference(flip, s), middle / step, middle * step
        )
        plain = min(_PLAIN, key=lambda p: abs(np.log(p / scale)))
        near = abs(np.log(plain / scale)) < np.log(step)
        found += [(flip, float(f"{scale:.3g}"))] + ([(flip, plain)] if near else [])
    return found


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
            (*(array[:each] for array in arrays), tones)
            for e in tested
            for *arrays, tones in e.lookups
        ]

    def difference(self, flip: str, scale: float) -> float:
        """Mean difference of warped neighbours, robust against what appears and disappears."""
        factor = np.array([-scale if axis in flip else scale for axis in "xy"], np.float32)
        total, count = 0.0, 0
        for here, at, motion, neighbour in self._lookups:
            there = _bilinear(neighbour, at + motion * factor)
            total += float(np.minimum(np.abs(there - here).sum(axis=1), _MOST).sum())
            count += len(here)
        return total / count


def _moving_pixels(motions: Sequence[np.ndarray]) -> np.ndarray:
    """Up to _PROBES pixels (y, x), in random order, that move in every given direction."""
    moving = np.ones(motions[0].shape[:2], bool)
    with np.errstate(all="ignore"):
        for motion in motions:
            speed = np.hypot(motion[..., 0], motion[..., 1])
            moving &= (speed > _MOVING) & np.isfinite(speed)
    at = np.argwhere(moving)
    return at[np.random.default_rng(0).permutation(len(at))[:_PROBES]]


def _differ(a: np.ndarray, b: np.ndarray) -> bool:
    """Return True if two pictures' tones differ by more than noise, somewhere."""
    height, width = (_BLOCK * (side // _BLOCK) for side in a.shape[:2])
    apart = a[:height, :width].astype(np.float32) - b[:height, :width]
    blocks = apart.reshape(height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK, 3).mean(axis=(1, 3))
    changed, (fewest, share) = np.abs(blocks).max(axis=2) > _CHANGED, _CHANGES
    return int(changed.sum()) >= max(fewest, share * changed.size)


def _tone(color: np.ndarray) -> np.ndarray:
    """Float16, held to 0..1 without hard limit, so that one highlight does not decide."""
    light = np.clip(np.nan_to_num(color.astype(np.float32)), 0, _BRIGHT)
    return (light / (1 + light)).astype(np.float16)


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
