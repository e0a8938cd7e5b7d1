"""GPUs that are not there, are lost or too small; threads and forks."""

from __future__ import annotations

import multiprocessing
import os
import resource
import threading
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

import make_frames as make
from wgmb import (
    Blur,
    DeviceError,
    Error,
    Frame,
)
from wgmb.cli import app

from . import ROOT, parts
from .processes import Ended, apart, limits, wgmb
from .table import Line, Tally, Trial, row

NO_VULKAN = {"VK_ICD_FILENAMES": "/nonexistent.json", "VK_DRIVER_FILES": "/nonexistent.json"}
NOTHING = NO_VULKAN | {
    "__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent",
    "LIBGL_DRIVERS_PATH": "/nonexistent",
}
NO_DISPLAY = {"DISPLAY": "", "WAYLAND_DISPLAY": ""}


@row(full=13)
def no_adapter(trial: Trial) -> Iterator[Line]:
    """Every command without a GPU, or with OpenGL alone: one line and exit code 3."""
    shot, out = ROOT / "sample" / "crossing.####.exr", trial.folder / "out"
    commands = [
        ["blur", shot, "-o", out / "o.####.exr"],
        ["render", "crossing", "-o", out / "o.png"],
        ["render", "torusphere", "-o", out / "o.mp4", "--frames", "0-3"],
        ["perceive", "crossing", "-o", out / "o.png"],
        ["compare", "crossing", "-o", out / "o.html"],
        ["bench", "--size", "64x36", "-o", out / "o.html"],
        ["view"],
        ["devices"],
    ]
    free = [
        ["--help"], ["blur", "--help"], ["--version"],
        ["shutter", "-o", out / "o.svg"],
        ["perceive", "--report", "-o", out / "r.svg"],
    ]  # fmt: skip
    out.mkdir()
    tally = Tally("no adapter, only OpenGL", "commands")
    slowest = 0.0
    for env in (NO_VULKAN, NOTHING):
        for words in trial.some([*commands, *free]):
            ended = wgmb(*words, *(["--overwrite"] if words in free[3:] else []), env=env)
            slowest = max(slowest, ended.seconds)
            tally.note(words[0], ended.wrong(0 if words in free else 3))
    yield tally.line(f"slowest {slowest:.1f} s")
    tally = Tally("no display", "commands")
    tally.note("view", wgmb("view", env=NO_DISPLAY).wrong(3, name="display"))
    yield tally.line()


def lost(arguments: list[str]) -> int:
    """In a process of its own: a run whose device is destroyed before the third frame."""
    calls, blur = count(), Blur.__call__

    def blurred(self: Any, *given: Any, **more: Any):
        if next(calls) == 2:
            self.device.destroy()
        return blur(self, *given, **more)

    Blur.__call__ = blurred
    return app.main(arguments)


def after_loss() -> str:
    """In a process of its own: what a new Blur makes of a frame after the device was lost."""
    frame, blur = parts.frame(1), Blur("tap")
    before = blur(frame)
    blur.device.destroy()
    try:
        blur(frame)
        return "a lost device draws"
    except DeviceError:
        pass
    except Exception as error:
        return f"{type(error).__name__} instead of DeviceError"
    try:
        return "" if (Blur("tap")(frame) == before).all() else "other bits"
    except Exception as error:
        return f"a new Blur: {type(error).__name__}: {error}"


def _value(ended: Ended) -> str:
    return ended.value if ended.value is not None else ended.wrong(0)


@row(quick=1, full=1)
def lost_device(trial: Trial) -> Iterator[Line]:
    """The device is lost in the middle of a run."""
    pattern = make.write_sequence(trial.folder, range(1, 7))
    tally = Tally("device lost in a run", "runs")
    out = trial.folder / "out"
    words = ["blur", pattern, "-o", str(out / "o.####.exr"), "--method", "tap"]
    ended = apart(lost, words)
    real = Ended(**{**vars(ended), "code": ended.code if ended.value is None else ended.value})
    there = sorted(p.name for p in out.iterdir()) if out.exists() else []
    blurred = ["o.0001.exr", "o.0002.exr"]  # the last may not have been written yet
    bad = "" if there in (blurred, blurred[:1], []) else f"there is {there}"
    tally.note("command", real.wrong(3) or bad)
    tally.note("library", _value(apart(after_loss)))
    yield tally.line()


def too_large(side: int) -> str:
    """In a process of its own: a frame that memory is too small for, then one that fits."""
    small, blur = parts.frame(1), Blur("tap")
    before = blur(small)
    large = Frame(np.zeros((side, side, 4), "f4"), motion=np.zeros((side, side, 4), "f4"))
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (held + (64 << 20), hard))
    try:
        blur(large)
        said = "drawn all the same"
    except (Error, MemoryError) as error:
        said = "" if f"{side}" in str(error) else f"does not say the size: {error}"
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (hard, hard))
    try:
        after = "" if (Blur("tap")(small) == before).all() else "other bits afterwards"
    except Exception as error:
        after = f"afterwards {type(error).__name__}: {error}"
    return "; ".join(filter(None, [said, after]))


@row(quick=1, full=3)
def little_memory(trial: Trial) -> Iterator[Line]:
    """Too little memory for a frame on the GPU: that frame fails, the next one is right."""
    tally = Tally("out of GPU memory in a run", "runs")
    for side in (2048, 4096, 6000)[: trial.count]:
        tally.note(f"{side} x {side}, library", _value(apart(too_large, side)))
    if trial.count > 1:
        zeros = {name: np.zeros((4096, 6144), np.float16) for name in ("R", "G", "B")}
        zeros |= {f"velocity.{c}": np.zeros((4096, 6144), np.float16) for c in "xy"}
        make.write_exr(trial.folder / "big.0001.exr", zeros)
        words = ["blur", trial.folder / "big.0001.exr", "-o", trial.folder / "o.exr"]
        ended = wgmb(*words, "--method", "tap", prepare=limits(memory=3125))
        told = "Traceback" not in ended.err and "failed" in ended.err and ended.code == 1
        last = (ended.err.strip().splitlines() or [""])[-1]
        tally.note("6144 x 4096, command", "" if told else f"exit {ended.code}: {last}")
    yield tally.line()


def shared(threads: int, frames: int, own: bool) -> str:
    """In a process of its own: one Blur, or one each, called from several threads."""
    given = [parts.frame(n) for n in range(4)]
    alone = Blur("tap", samples=4)
    right = [alone(one) for one in given]
    wrong: list[str] = []

    def work() -> None:
        blur = Blur("tap", samples=4) if own else alone
        try:
            for n in range(frames):
                if (blur(given[n % 4]) != right[n % 4]).any():
                    wrong.append("other bits")
        except Exception as error:
            wrong.append(f"{type(error).__name__}: {error}")

    each = [threading.Thread(target=work) for _ in range(threads)]
    for thread in each:
        thread.start()
    for thread in each:
        thread.join()
    return wrong[0] if wrong else ""


@row(quick=1, full=6)
def threads(trial: Trial) -> Iterator[Line]:
    """One Blur called from several threads; and a Blur each."""
    many, frames = (2, 20) if trial.count == 1 else (8, 50)
    for own in (False, True):
        what = "a Blur each" if own else "one Blur"
        tally = Tally(f"{what}, {many} threads, {frames} frames each", "runs")
        for number in range(trial.count):
            tally.note(number, _value(apart(shared, many, frames, own)))
        yield tally.line()


def _drawn(number: int) -> float:
    return float(Blur("tap", samples=4)(parts.frame(number)).sum())


def forked_first(count: int) -> str:
    """In a process of its own: a pool of forked processes, before there is a device."""
    with multiprocessing.get_context("fork").Pool(2) as pool:
        try:
            found = pool.map_async(_drawn, range(count)).get(60)
        except Exception as error:
            return f"{type(error).__name__}: {error}"
    return "" if found == [_drawn(n) for n in range(count)] else "other results"


def forked_later(_: int) -> str:
    """In a process of its own: a process forked after there is a device is refused."""
    _drawn(1)
    reads, writes = os.pipe()
    if (pid := os.fork()) == 0:
        said = "it draws"
        try:
            _drawn(2)
        except DeviceError:
            said = ""
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
        os.write(writes, f"{said}\n".encode())
        os._exit(0)
    os.close(writes)
    said = os.read(reads, 4096).decode()
    os.waitpid(pid, 0)
    return said.strip() if said else "it died"


@row(full=1)
def forks(trial: Trial) -> Iterator[Line]:
    """Forked processes: they may draw if there was no device, and are refused otherwise."""
    tally = Tally("fork before, and after there is a device", "runs")
    tally.note("before, 2 processes", _value(apart(forked_first, 4)))
    tally.note("after", _value(apart(forked_later, 1, seconds=60)))
    yield tally.line()
