"""Resuming with --resume, and several processes on one folder."""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import make_frames as make

from .processes import wgmb
from .shots import Shot, apart_from, contents, shot
from .stopping import Running
from .table import Line, Tally, Trial, row

# ---- several processes ----------------------------------------------------------------------


def _together(made: Shot, out: Path, whole: dict[str, bytes], count: int):
    """So many processes blur the same frames into `out`, whose final names are read all along.

    They wait for each other once they have opened the GPU. Returns how each one ended ("" if
    well), the names under which wrong bytes were seen, and how often they were read.
    """
    running = [Running(made, out, "--resume") for _ in range(count)]
    for one in running:
        if one.until(one.at_the_gpu):
            one.process.send_signal(signal.SIGSTOP)
    for one in running:
        one.process.send_signal(signal.SIGCONT)
    wrong: dict[str, str] = {}
    looks = 0
    while any(one.process.poll() is None for one in running):
        for name, data in contents(out).items():
            if not name.startswith(".") and data != whole.get(name):
                wrong[name] = f"{len(data)} of {len(whole.get(name, b''))} bytes"
        looks += 1
        time.sleep(0.001)
    ends = [one.stop(signal.SIGCONT)[:2] for one in running]
    said = [f"exit {code}: {' '.join(err.split())}" if code else "" for code, err in ends]
    return said, wrong, looks


def at_once(trial: Trial, count: int, frames: int) -> Iterator[Line]:
    """`count` processes at once, as often as the trial says."""
    made = shot(trial.folder / f"in {count}", frames, times=4)
    whole = made.whole(trial.folder / f"whole {count}")
    ends = Tally(f"{count} processes, one folder, --resume", "processes")
    seen, looks = Tally("what was seen under final names meanwhile", "files"), 0
    for number in range(trial.count):
        out = trial.folder / f"{count} at once {number}"
        said, wrong, looked = _together(made, out, whole, count)
        looks += looked
        for end in said:
            ends.note(f"trial {number}", end)
        for name in whole:
            seen.note(f"trial {number}, {name}", wrong.get(name))
        late = apart_from(contents(out), whole, all_there=True)
        seen.note(f"trial {number}, in the end", late)
    yield ends.line()
    yield seen.line(f"read {looks:,} times")


@row(quick=1, full=3)
def processes(trial: Trial) -> Iterator[Line]:
    """Four and eight processes on one folder with --resume; final names are read all along."""
    yield from at_once(trial, 4, 24 if trial.count == 1 else 40)
    if trial.count > 1:
        yield from at_once(trial, 8, 40)


# ---- output = input -------------------------------------------------------------------------


@row(quick=3, full=9)
def output_is_input(trial: Trial) -> Iterator[Line]:
    """The output is the input: by its name, through a link to the folder, by another way to it."""
    tally = Tally("output = input", "runs")
    ways = ("in", "link", "in/../in")
    cases = [(way, more) for more in ("--resume", "--overwrite", None) for way in ways]
    for number, (way, more) in enumerate(cases[: trial.count]):
        place = trial.folder / str(number)
        (place / "in").mkdir(parents=True)
        pattern = make.write_sequence(place / "in", range(1, 4))
        (place / "link").symlink_to(place / "in")
        before = contents(place / "in")
        words = ["blur", pattern, "-o", f"{place}/{way}/shot.####.exr", "--method", "tap"]
        ended = wgmb(*words, *filter(None, [more]))
        wrong = "" if contents(place / "in") == before else "the input was replaced"
        tally.note(f"-o {way}/ {more or ''}", wrong or ended.wrong(2))
    yield tally.line()


# ---- damaged results ------------------------------------------------------------------------


def _cut(share: float):
    return lambda data: data[: int(share * len(data))]


def _zeroed(at: float, count: int):
    def damage(data: bytes) -> bytes:
        start = int(at * len(data)) if at < 1 else int(at)
        return data[:start] + bytes(len(data[start : start + count])) + data[start + count :]

    return damage


DAMAGES = {
    "cut to a half": _cut(0.5),
    "cut to 90 %": _cut(0.9),
    "cut to 99 %": _cut(0.99),
    "200 bytes zeroed": _zeroed(0.6, 200),
    "zeros from byte 2,048 on": _zeroed(2048, 1 << 30),
}


@row(quick=4, full=4)
def damaged(trial: Trial) -> Iterator[Line]:
    """Results that were damaged are made anew by --resume: 5 damages in 4 formats."""
    tally, count = Tally("damaged results, --resume", "files"), len(DAMAGES)
    pattern = make.write_sequence(trial.folder, range(1, count + 1))
    for suffix in trial.some(("exr", "png", "tif", "jpg")):
        out = trial.folder / suffix
        words = ["blur", pattern, "-o", out / f"o.####.{suffix}", "--method", "tap"]
        wgmb(*words)
        whole = contents(out)
        for (name, data), damage in zip(sorted(whole.items()), DAMAGES.values(), strict=True):
            (out / name).write_bytes(damage(data))
        ended = wgmb(*words, "--resume")
        found = contents(out)
        for name, (what, damage) in zip(sorted(whole), DAMAGES.items(), strict=True):
            same = damage(whole[name]) == whole[name]  # a file that ends before
            kept = found[name] != whole[name] and not same
            tally.note(f"{suffix}, {what}", "kept" if kept else ended.wrong(0))
    yield tally.line()


# ---- what a frame was made of ---------------------------------------------------------------


def _redone(pattern: str, out: Path, fresh: Path, *more: str) -> str:
    """The fault in `out` after --resume, beside a fresh run's files."""
    words = ["blur", pattern, "--method", "gather", "--samples", "4", *more]
    ended = wgmb(*words, "-o", out / "o.####.exr", "--resume")
    again = wgmb(*words, "-o", fresh / "o.####.exr")
    wrong = ended.wrong(0) or again.wrong(0)
    return wrong or apart_from(contents(out), contents(fresh), all_there=True)


def _begin(place: Path, *more: str) -> tuple[str, Path]:
    """Five frames, blurred with their neighbours; what moves is nearer."""
    place.mkdir()
    for n in range(1, 6):
        _write(place, n)
    pattern, out = str(place / "shot.####.exr"), place / "out"
    wgmb("blur", pattern, "--method", "gather", "--samples", "4", *more, "-o", out / "o.####.exr")
    return pattern, out


def _write(place: Path, number: int, light: float = 1.0) -> Path:
    channels = make.frame(number)
    _, to_next = make.motion(number)
    channels["ViewLayer.Depth.Z"] = np.where(to_next[..., 0] > 0, 4, 10).astype(np.float32)
    for name in (name for name in channels if name.rpartition(".")[2] in "RGB"):
        channels[name] = (channels[name] * light).astype(np.float16)
    return make.write_exr(place / f"shot.{number:04d}.exr", channels)


@row(quick=2, full=4)
def renewed_inputs(trial: Trial) -> Iterator[Line]:
    """A frame is made anew if one of those that it was made of was replaced."""
    tally = Tally("inputs renewed, --resume", "runs")

    def neighbour(place: Path) -> str:
        pattern, out = _begin(place)
        _write(place, 3, light=0.9)
        return _redone(pattern, out, place / "fresh")

    def older(place: Path) -> str:
        pattern, out = _begin(place)
        path = _write(place, 3, light=0.9)
        past = time.time() - 1000
        os.utime(path, (past, past))
        return _redone(pattern, out, place / "fresh")

    def removed(place: Path) -> str:
        pattern, out = _begin(place)
        (place / "shot.0005.exr").unlink()
        (out / "o.0005.exr").unlink()
        return _redone(pattern, out, place / "fresh")

    def restored(place: Path) -> str:
        pattern, out = _begin(place)
        shutil.rmtree(out)
        aside = (place / "shot.0003.exr").rename(place / "aside.exr")
        wgmb("blur", pattern, "--method", "gather", "--samples", "4", "--skip-missing",
             "-o", out / "o.####.exr")  # fmt: skip
        aside.rename(place / "shot.0003.exr")
        return _redone(pattern, out, place / "fresh")

    for what in (neighbour, older, removed, restored)[: trial.count]:
        tally.note(what.__name__, what(trial.folder / what.__name__))
    yield tally.line()


@row(quick=1, full=4)
def subsets(trial: Trial) -> Iterator[Line]:
    """Some frames first, all of them later: the same as all at once."""
    tally = Tally("--frames subsets, then all with --resume", "runs")
    for number, first in enumerate(("1-4", "5-8", "2,7", "1-12x3")[: trial.count]):
        place = trial.folder / str(number)
        place.mkdir()
        for n in range(1, 13):  # slow at first, then fast; y upside down: found by testing only
            velocity = (0.8, 0.4) if n < 6 else (4.0, 2.0)
            to_prev, to_next = make.motion(n, velocity)
            flip = np.array([1, -1], np.float32)
            channels = make.frame(n, None, velocity) | make.written(
                "nuke", to_prev * flip, to_next * flip
            )
            make.write_exr(place / f"shot.{n:04d}.exr", channels)
        pattern, out = str(place / "shot.####.exr"), place / "out"
        wgmb("blur", pattern, "--method", "gather", "--samples", "4", "--frames", first,
             "-o", out / "o.####.exr")  # fmt: skip
        tally.note(f"--frames {first}", _redone(pattern, out, place / "fresh"))
    yield tally.line()
