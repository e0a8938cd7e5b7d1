"""Runs that are killed or interrupted, at any time: whole files, and the rest made later."""

from __future__ import annotations

import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .processes import WGMB, environment, wgmb
from .shots import Shot, apart_from, contents, shot
from .table import Line, Tally, Trial, row

_KILLS = 4  # of one run, before it is let finish
_PATIENCE = 30.0  # seconds for what should take less than one
_IMPORTING = b"_multiarray_umath"  # NumPy: what wgmb imports is on its way
_DRIVER = b"libvulkan"  # opened with the GPU


class Running:
    """A `wgmb blur` under way."""

    def __init__(self, shot: Shot, out: Path, *more: str, target: Path | None = None):
        self.out, self.err = out, tempfile.TemporaryFile()  # noqa: SIM115 - closed with it
        self.process = subprocess.Popen(
            [*WGMB, *shot.arguments(out, *more, target=target)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self.err,
            env=environment(),
        )

    def until(self, ready: Callable[[], object], seconds: float = 60) -> bool:
        """Wait until `ready()`; False if the run ended before, or it took too long."""
        ends = time.monotonic() + seconds
        while not ready():
            if self.process.poll() is not None or time.monotonic() > ends:
                return False
            time.sleep(0.001)
        return True

    def importing(self) -> bool:
        """True if wgmb's own start has begun."""
        return self._has_loaded(_IMPORTING)

    def at_the_gpu(self) -> bool:
        """True if it has begun to open one."""
        return self._has_loaded(_DRIVER)

    def _has_loaded(self, name: bytes) -> bool:
        try:
            return name in Path(f"/proc/{self.process.pid}/maps").read_bytes()
        except OSError:
            return False

    def writing(self) -> bool:
        """True if a first picture exists."""
        return self.out.exists() and any(self.out.glob("o.*.exr"))

    def stop(self, number: signal.Signals) -> tuple[int, str, float]:
        """Send a signal: the exit code, what was said on stderr, and seconds until the end."""
        started = time.perf_counter()
        self.process.send_signal(number)
        try:
            code = self.process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        took = time.perf_counter() - started
        self.err.seek(0)
        said = self.err.read().decode("utf-8", "backslashreplace")
        self.err.close()
        return code, said, took


def _unbroken(shot: Shot, folder: Path) -> tuple[dict[str, bytes], float, float]:
    """Files of an unbroken run; seconds of it before and after the first picture."""
    running = Running(shot, folder)
    started = time.perf_counter()
    running.until(running.writing)
    first = time.perf_counter() - started
    running.process.wait()
    running.err.close()
    found = contents(folder)
    if len(found) != shot.count:
        raise RuntimeError(f"{len(found)} of {shot.count} files in an unbroken run")
    return found, first, time.perf_counter() - started - first


def _kills(method: str, trial: Trial) -> Line:
    """Kill, look, go on; after a few kills let it finish, and begin anew."""
    rng = np.random.default_rng(trial.seed)
    place = trial.folder / method
    made = shot(place / "in", 240 if trial.count > 20 else 80, method)
    whole, first, rest = _unbroken(made, place / "whole")
    tally, midway = Tally(f"`kill -9`, `--resume`, {method}", "runs"), 0
    for number in range(trial.count):
        out = place / f"out {number // _KILLS}"
        running = Running(made, out, "--resume")
        early = number % 2
        running.until(running.importing if early else running.writing)
        time.sleep(rng.random() * (first if early else 0.8 * rest))
        code, _, _ = running.stop(signal.SIGKILL)
        midway += code == -signal.SIGKILL and 0 < len(list(out.glob("o.*"))) < made.count
        wrong = apart_from(contents(out), whole, all_there=False)
        if number % _KILLS == _KILLS - 1 or number == trial.count - 1:
            ended = wgmb(*made.arguments(out, "--resume"), seconds=600)
            later = ended.wrong(0) or apart_from(contents(out), whole, all_there=True)
            wrong = wrong or (f"after --resume: {later}" if later else "")
        tally.note(number, wrong)
    return tally.line(f"{midway} died with some frames done")


@row(quick=8, full=100)
def kills(trial: Trial) -> Iterator[Line]:
    """`kill -9` at random times, also while modules are imported; then --resume."""
    for method in ("tap", "gather") if trial.count > 20 else ("tap",):
        yield _kills(method, trial)


def _stops(trial: Trial, made: Shot, unbroken: tuple[Any, ...], early: bool) -> Line:
    rng = np.random.default_rng(trial.seed)
    whole, first, rest = unbroken
    when = "in the first second" if early else "while frames are written"
    tally, slowest = Tally(f"SIGINT, SIGTERM {when}", "runs"), 0.0
    for number in range(trial.count):
        out = trial.folder / f"{early} {number}"
        name = ("SIGINT", "SIGTERM")[number % 2]
        running = Running(made, out)
        under_way = running.until(running.importing if early else running.writing)
        time.sleep(rng.random() * (0.7 * first if early else 0.5 * rest))
        under_way &= running.process.poll() is None
        code, said, took = running.stop(signal.Signals[name])
        if under_way:
            slowest = max(slowest, took)
            there = contents(out)
            if code == 0 and there == whole:  # it was done before it heard the signal
                continue
            wrong = _manners(code, said) or apart_from(there, whole, all_there=False)
            tally.note(name, wrong or _rests(there))
    return tally.line(f"gone within {slowest:.2f} s")


def _manners(code: int, said: str) -> str:
    if code == 130 and said == "wgmb: interrupted\n":
        return ""
    last = (said.strip().splitlines() or ["nothing said"])[-1]
    return f"{'traceback, ' if 'Traceback' in said else ''}exit {code}: {last}"


def _rests(there: dict[str, bytes]) -> str:
    rests = [name for name in there if name.startswith(".")]
    return f"left over: {rests[0]}" if rests else ""


@row(quick=4, full=50)
def stops(trial: Trial) -> Iterator[Line]:
    """Ctrl-C and SIGTERM: while modules are imported and the GPU is opened, and later."""
    made = shot(trial.folder / "in", 120 if trial.count < 20 else 240)
    unbroken = _unbroken(made, trial.folder / "whole")
    for early in (True, False):
        yield _stops(trial, made, unbroken, early)
