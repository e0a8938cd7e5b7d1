"""Memory of the viewer: playing, and in the hands of somebody who tries everything."""

from __future__ import annotations

import contextlib
import ctypes
import random
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from wgmb import viewer
from wgmb.allocator import bound_free_memory
from wgmb.viewer.state.state import COMPARE, TONES, State
from wgmb.viewer.window import Viewer
from wgmb.viewer.window import frame as viewed

from . import footage, parts
from .processes import apart, use
from .table import Line, Trial, row

_MOST = 8.0  # MiB a minute, playing
_MOST_USED = 1.0  # MiB a minute of a long use, once it is warm
_WARM = 900.0  # seconds until all methods are compiled, and wgpu's blocks of memory are enough
_SHORTEST = 600.0  # seconds of a use, once it is warm, that can be judged
_SAMPLE = 5.0  # seconds from one look at the memory to the next
_BLOCK = 60.0  # seconds whose mean is one point of the slope: what is open changes meanwhile
_SIZE = 640, 400
_PAUSE = 0.02  # seconds from one frame of the panel to the next
_CHANGE = 0.5  # seconds from one thing that is done to the next
_KEYS = ("ArrowLeft", "ArrowRight", "Home", "End", "Tab", " ", *"clerbxiah[]0")


def played(name: str, seconds: float) -> list[float]:
    """In a process of its own: seconds, frames and MiB that playing for so long took."""
    step, number = parts.make(name), 0
    while number < 40:
        step(number)
        number += 1
    started, before = time.perf_counter(), use().memory
    while time.perf_counter() - started < seconds:
        step(number)
        number += 1
    took = time.perf_counter() - started
    return [took, number - 40, (use().memory - before) / 1024]


@row(full=600)
def viewer_plays(trial: Trial) -> Iterator[Line]:
    """The viewer playing a scene, for ten minutes."""
    for name in ("viewer tap", "viewer gather"):
        ended = apart(played, name, trial.count / 2, seconds=120 + trial.count)
        if ended.value is None:
            raise RuntimeError(ended.wrong(0))
        took, count, mib = ended.value
        ok = 60 * mib / took <= _MOST
        yield Line(f"{name}, playing `crossing`", f"{took:.0f} s, {count:.0f} frames",
                   "yes" if ok else "no", f"{60 * mib / took:+.1f} MiB a minute", ok)  # fmt: skip


@row(full=3600)
def viewer_used(trial: Trial) -> Iterator[Line]:
    """Somebody changes settings, seeks, plays and opens other files for an hour."""
    ended = apart(used, trial.count, trial.seed, str(trial.folder), seconds=300 + 2 * trial.count)
    if ended.value is None:
        raise RuntimeError(ended.wrong(0))
    looks, done = np.array(ended.value[0]), ended.value[1]
    rate, error, first, last = _slope(looks)
    ok = rate - 2 * error <= _MOST_USED
    told = f"{first:.0f} -> {last:.0f} MiB, {rate:+.2f} +- {error:.2f} MiB a minute"
    tried = f"{looks[-1, 0]:.0f} s, {done:,} changes"
    right = "too short to tell" if np.isinf(error) else "yes" if ok else "no"
    yield Line("viewer, used", tried, right, told, ok)


def _slope(looks: np.ndarray) -> tuple[float, float, float, float]:
    """From (seconds, MiB) MiB a minute and their standard error, and MiB at first and at last.

    Of the last two thirds of a use, from _WARM on at the earliest; the error of one that is too
    short is infinite.
    """
    later = looks[looks[:, 0] >= max(_WARM, looks[-1, 0] / 3)]
    if len(later) == 0 or later[-1, 0] - later[0, 0] < _SHORTEST:
        return 0.0, np.inf, looks[0, 1], looks[-1, 1]
    blocks = ((later[:, 0] - later[0, 0]) // _BLOCK).astype(int)
    held = np.array([later[blocks == block].mean(axis=0) for block in np.unique(blocks)])
    (rate, _), spread = np.polyfit(held[:, 0] / 60, held[:, 1], 1, cov=True)
    return float(rate), float(np.sqrt(spread[0, 0])), held[0, 1], held[-1, 1]


def _held() -> float:
    """MiB of this process, without what the allocator has free."""
    with contextlib.suppress(AttributeError, OSError):  # another libc than glibc
        ctypes.CDLL(None).malloc_trim(0)
    return use().memory / 1024


def used(seconds: float, seed: int, folder: str) -> list[Any]:
    """In a process of its own: (seconds so far, MiB) every few seconds, and the count of changes.

    Pictures are drawn beside the window, as without a GPU.
    """
    sample = Path(__file__).parents[2] / "sample"
    video = footage.flat(Path(folder) / "a.mp4", 48, (320, 180), fps=24)
    sources = ["crossing", str(sample / "crossing.####.exr"), str(video)]
    bound_free_memory()  # as `view` does
    window = viewer.offscreen(State(), _SIZE, threaded=True)
    rng, looks, done = random.Random(seed), [], 0
    started = time.perf_counter()
    change_at = look_at = started
    while (now := time.perf_counter()) - started < seconds:
        if now >= change_at:
            _change(window, rng, sources)
            change_at, done = now + _CHANGE, done + 1
        viewed(window)
        if now >= look_at:
            looks.append([now - started, _held()])
            look_at = now + _SAMPLE
        time.sleep(_PAUSE)
    window.close()
    return [looks, done]


def _change(window: Viewer, rng: random.Random, sources: list[str]) -> None:
    """One thing that somebody may do."""
    state, info = window.state, window._info
    if info is None:
        return
    first, last = state.span
    can = info.available
    changes: list[Callable[[], object]] = [
        lambda: replace(state, frame=float(rng.randint(first, last)), playing=False),
        lambda: replace(state, playing=True),
        lambda: state.with_settings(shutter=float(rng.choice([0, 90, 180, 270, 360]))),
        lambda: state.with_settings(samples=rng.choice([4, 8, 16])),
        lambda: state.with_method(rng.choice(can.methods)) if can.methods else state,
        lambda: replace(state, look=rng.choice(can.looks)),
        lambda: replace(state, compare=rng.choice(COMPARE), against=rng.choice(can.rivals)),
        lambda: replace(state, exposure=rng.uniform(-2, 2), tone=rng.choice(TONES)),
        lambda: replace(state, wipe=rng.random(), zoom=rng.choice([1.0, 2.0])),
        lambda: replace(state, inspect=not state.inspect, arrows=not state.arrows),
        lambda: state.swapped() if state.kept else state.keeping(),
        lambda: window.canvas.submit_event(
            {"event_type": "key_down", "key": rng.choice(_KEYS), "modifiers": ()}
        ),
        lambda: window.canvas.set_logical_size(*rng.choice([_SIZE, (800, 500), (500, 400)])),
        lambda: state.opened(rng.choice(sources)),
    ]
    made = rng.choice(changes)()
    if isinstance(made, State):
        window.state = made
