"""Memory, descriptors and threads: the same after the last frame as after the first."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from . import parts, shots
from .processes import WGMB, Use, apart, environment, growth, use
from .table import Line, Trial, row

MOST = 24.0  # KiB a frame of 96 x 54: what allocators scatter about
_WARM = 500  # frames, until pools, the quality of the viewer and the allocator have settled
_SETTLED = 0.15  # share of a run after which memory counts
_MOST_A_THOUSAND = 4.0  # MiB per 1,000 frames of a long run


def grown(name: str, warm: int, count: int) -> float:
    """In a process of its own: KiB that a frame of the part leaves behind."""
    return growth(parts.make(name), warm, count)


@row(quick=100, full=400)
def leaks(trial: Trial) -> Iterator[Line]:
    """KiB that a frame leaves behind: every method and variant, rendered scenes, the viewer."""
    warm = max(_WARM, trial.count // 2)

    def tried(name: str) -> Line:
        ended = apart(grown, name, warm, trial.count, seconds=60 + 3 * (warm + trial.count))
        what, frames = f"memory a frame, {name}", f"{trial.count} frames after {warm}"
        if ended.value is None:
            return Line(what, frames, "no", ended.wrong(0), False)
        ok = ended.value <= MOST
        told = f"{ended.value:+.1f} KiB a frame, at most {MOST:g}"
        return Line(what, frames, "yes" if ok else "no", told, ok)

    with ThreadPoolExecutor(2) as pool:  # they mostly start and compile, on one core
        yield from pool.map(tried, parts.PARTS)


def drawn(name: str, count: int) -> list[list[float]]:
    """In a process of its own: what it holds, some 100 times in a run of `count` frames."""
    step, held = parts.make(name), []
    for number in range(count):
        step(number)
        if number % max(1, count // 100) == 0:
            held.append([number, *vars(use()).values()])
    return held


def _long(what: str, tried: int, held: list[list[float]]) -> Line:
    """The line of a long run, from (frames so far, KiB, descriptors, threads) in their order."""
    later = np.array([h for h in held if h[0] >= _SETTLED * tried] or held[-1:])
    span = max(1.0, later[-1, 0] - later[0, 0])
    mib = (later[-1, 1] - later[0, 1]) / 1024
    rate = 1000 * mib / span
    third = max(1, len(later) // 3)  # pools come and go: their middle must not rise
    files, threads = (np.median(later[-third:, i]) - np.median(later[:third, i]) for i in (2, 3))
    ok = len(later) > 1 and rate <= _MOST_A_THOUSAND and max(files, threads) <= 1
    return Line(
        what,
        f"{tried:,} frames",
        "yes" if ok else "no",
        f"{later[0, 1] / 1024:.1f} (frame {later[0, 0]:.0f}) -> {later[-1, 1] / 1024:.1f} MiB, "
        f"{rate:+.1f} MiB per 1,000; most descriptors {later[:, 2].max():.0f}, "
        f"threads {later[:, 3].max():.0f}",
        ok,
    )


@row(full=3200)
def soak_library(trial: Trial) -> Iterator[Line]:
    """Thousands of frames through one Blur."""
    for name in ("tap", "gather, arrays", "gather"):
        ended = apart(drawn, name, trial.count, seconds=600 + trial.count)
        if ended.value is None:
            raise RuntimeError(ended.wrong(0))
        yield _long(f"soak, library, {name}", trial.count, ended.value)


@row(full=3200)
def soak_command(trial: Trial) -> Iterator[Line]:
    """Thousands of EXR files through one `wgmb blur`, watched from outside."""
    for method in ("tap", "gather"):
        shot = shots.shot(trial.folder / method, trial.count, method)
        out = trial.folder / f"{method} out"
        held, code = _watched(shot.arguments(out), out)
        line = _long(f"soak, `wgmb blur --method {method}`, EXR", trial.count, held)
        yield line if code == 0 else Line(line.what, line.tried, "no", f"exit {code}", False)


def _watched(arguments: list[str], out: Path) -> tuple[list[list[float]], int]:
    """Memory of a run as its files appear, and its exit code."""
    quiet = subprocess.DEVNULL
    process = subprocess.Popen([*WGMB, *arguments], stdout=quiet, stderr=quiet, env=environment())
    held: list[list[float]] = []
    while process.poll() is None:
        written = sum(1 for _ in out.iterdir()) if out.exists() else 0
        now: Use | None = None
        if written:
            try:
                now = use(process.pid)
            except OSError:  # it ended meanwhile
                break
        if now is not None and now.memory > 0:
            held.append([written, *vars(now).values()])
        time.sleep(0.25)
    return held or [[0, 0.0, 0, 0]], process.wait()
