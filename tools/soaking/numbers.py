"""Values that are not finite or absurd, odd sizes, and the same bits however a run is made."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from wgmb import METHODS, Blur, Frame

from . import parts
from .processes import Ended, apart
from .table import Line, Tally, Trial, row

VALUES = {
    "NaN": np.nan,
    "a NaN with a payload": np.array(0xFFC12345, np.uint32).view(np.float32)[()],
    "inf": np.inf,
    "-inf": -np.inf,
    "denormal": 1e-42,
    "65520": 65520.0,
    "1e38": 1e38,
    "3.4e38": 3.4e38,
    "-3.4e38": -3.4e38,
    "-1": -1.0,
}
INPUTS = ("color", "alpha", "motion", "depth", "normal", "holdout", "scale")
_PLACES = {
    "a pixel": np.s_[4, 5],
    "the corner": np.s_[-1, -1],
    "a row": np.s_[3, :],
    "a half": np.s_[:, :6],
    "everything": np.s_[:, :],
}
_METHODS = [name for name, method in METHODS.items() if "scene" not in method.needs]
_SHAPES = {"12 x 9": (12, 9), "33 x 7": (33, 7)}
SIZES = [(1, 1), (1, 2), (2, 1), (3, 2), (1, 64), (64, 1), (7, 7), (8, 8), (9, 9), (17, 33),
         (255, 3), (65, 1024), (16384, 2)]  # fmt: skip


def _spoiled(size: tuple[int, int], what: list[tuple[str, str, str]]) -> Frame:
    """A frame with values put into inputs at places."""
    plain = parts.frame(1, size)
    ones = np.ones(size[::-1], np.float32)
    arrays = {name: array.copy() for name, array in plain.arrays.items()}
    arrays |= {"holdout": ones * 0.5, "scale": ones.copy()}
    for given, value, place in what:
        name = "color" if given == "alpha" else given
        at = _PLACES[place]
        array = arrays[name][..., 3] if given == "alpha" else arrays[name]
        array[at] = VALUES[value]
    return replace(plain, **arrays)


def _bad(made: np.ndarray, size: tuple[int, int]) -> str:
    if made.shape[:2] != size[::-1]:
        return f"shape {made.shape}"
    nan, inf = np.isnan(made).sum(), np.isinf(made).sum()
    return f"{nan} NaN, {inf} infinite" if nan or inf else ""


def grid(cases: list[Any]) -> list[list[str]]:
    """In a process of its own: what was wrong, (case, what) each; cases are (shape, method,
    things that are put in).
    """
    blurs: dict[str, Blur] = {}
    wrong = []
    with np.errstate(all="ignore"):
        for shape, method, what in cases:
            if method not in blurs:
                blurs[method] = Blur(method, samples=4, shutter=360)
            size = _SHAPES[shape]
            one = _spoiled(size, [tuple(w) for w in what])
            one = one.between(parts.frame(0, size), one)
            if bad := _bad(blurs[method](one), size):
                wrong.append([f"{method}, {shape}, {what}", bad])
    return wrong


def _told(what: str, tried: int, ended: Ended, unit: str) -> Line:
    if ended.value is None:
        return Line(what, f"{tried:,} {unit}", "no", ended.wrong(0), False)
    tally = Tally(what, unit, tried, [": ".join(one) for one in ended.value])
    return tally.line()


@row(full=10_000)
def values(trial: Trial) -> Iterator[Line]:
    """NaN, infinity and absurd values in every input: nothing but finite numbers comes out."""
    every = itertools.product(_SHAPES, _METHODS, INPUTS, VALUES, _PLACES)
    cases = [(shape, method, [what]) for shape, method, *what in every]
    chosen = trial.some(cases)
    ended = apart(grid, chosen, seconds=120 + len(chosen))
    yield _told("NaN, inf, denormal, 3.4e38 ...: one at a time", len(chosen), ended, "cases")
    rng = np.random.default_rng(trial.seed)

    def one() -> list[str]:
        return [str(rng.choice(list(names))) for names in (INPUTS, VALUES, _PLACES)]

    def several() -> list[Any]:
        shape, method = (str(rng.choice(list(names))) for names in (_SHAPES, _METHODS))
        return [shape, method, [one() for _ in range(int(rng.integers(2, 6)))]]

    chosen = [several() for _ in range(trial.count // 2)]
    ended = apart(grid, chosen, seconds=120 + len(chosen))
    yield _told("the same, several at random", len(chosen), ended, "cases")


def sized(sizes: list[list[int]]) -> list[list[str]]:
    """In a process of its own: what was wrong, by size and method."""
    wrong = []
    for width, height in sizes:
        for method in _METHODS:
            one = parts.frame(1, (width, height))
            made = Blur(method, samples=4)(one.between(one, one))  # pyright: ignore[reportArgumentType, reportCallIssue]
            if bad := _bad(made, (width, height)):
                wrong.append([f"{width} x {height}, {method}", bad])
    return wrong


@row(full=len(SIZES))
def sizes(trial: Trial) -> Iterator[Line]:
    """Odd sizes, from 1 x 1 on, through every method."""
    chosen = trial.some(SIZES)
    ended = apart(sized, chosen, seconds=600)
    yield _told("odd sizes", len(chosen) * len(_METHODS), ended, "sizes x methods")


def digests(names: list[str], backwards: bool) -> dict[str, list[str]]:
    """In a process of its own: of every part's first frames, and of the first one once more."""
    found = {}
    for name in reversed(names) if backwards else names:
        step = parts.make(name)
        found[name] = [hashlib.sha256(step(n).tobytes()).hexdigest() for n in (0, 1, 2, 0)]
    return found


@row(full=len(parts.PARTS))
def bits(trial: Trial) -> Iterator[Line]:
    """The same bits with 1, 2 and 4 threads, in another order, and once more."""
    # The viewer's clock goes on, and what is perceived depends on what was seen before.
    still = [n for n in parts.PARTS if "viewer" not in n and n != "perceive"]
    names = trial.some(still)
    runs = [(1, False), (2, False), (4, False), (2, True)]
    found = []
    for threads, backwards in runs:
        env = {"LP_NUM_THREADS": threads}
        ended = apart(digests, names, backwards, env=env, seconds=900)
        if ended.value is None:
            raise RuntimeError(ended.wrong(0))
        found.append(ended.value)
    tally = Tally("same bits: LP_NUM_THREADS 1, 2, 4, 2 in another order; again", "parts")
    for name in names:
        different = len({tuple(one[name]) for one in found})
        again = all(one[name][0] == one[name][3] for one in found)
        wrong = f"{different} results" if different > 1 else "" if again else "not again"
        tally.note(name, wrong)
    yield tally.line()


def locked(count: int) -> list[list[str]]:
    """In a process of its own: what differs between locked frames and plain arrays."""
    wrong = []
    for method in _METHODS:
        once, kept = Blur(method, samples=4), Blur(method, samples=4)  # pyright: ignore[reportArgumentType, reportCallIssue]
        frames = parts.neighbourly(range(count), size=(24, 16))
        for number, one in enumerate(frames):
            plain = replace(one, prev=one.prev and replace(one.prev), next=one.next)
            if (once(plain) != kept(one)).any():
                wrong.append([method, f"frame {number} differs"])
    return wrong


@row(full=20)
def locked_frames(trial: Trial) -> Iterator[Line]:
    """Frames that stay on the GPU give the bits of those that are uploaded again."""
    ended = apart(locked, trial.count, seconds=600)
    yield _told("locked frames, beside arrays", trial.count * len(_METHODS), ended, "frames")
