"""Videos from strangers: lists of other files, jumps in time, results that are no longer right."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
from file_lists import LISTS
from PIL import Image

import make_clips as clips
from wgmb import InputError
from wgmb.video.read.reader import VideoReader

from .processes import wgmb
from .shots import contents
from .table import Line, Tally, Trial, row

_SUFFIXES = ".mp4", ".m3u8", ".mkv", ".sdp", ".avi"
_FORMATS = "mp4", "mkv", "png", "webm", "mov", "gif"
_SECONDS, _PEAK = 30.0, 512  # s, MiB: more is a fault


@row(quick=6, full=len(LISTS) * len(_SUFFIXES))
def lists(trial: Trial) -> Iterator[Line]:
    """A text that names another video is no video, under any name: info, blur over that video."""
    tally = Tally("lists of files as videos", "files")
    other = clips.write(trial.folder / "other.mkv", codec="ffv1")
    sound = other.read_bytes()
    for kind, suffix in trial.some(product(LISTS, _SUFFIXES)):
        path = trial.folder / f"list{suffix}"
        path.write_text(LISTS[kind].format(name=other.name, path=other))
        wrong = ""
        for words in (["info", path], ["blur", path, "-o", other, "--overwrite", "-q"]):
            ended = wgmb(*words, seconds=_SECONDS)
            wrong = wrong or ended.wrong(2, name=path.name)
        wrong = wrong or ("" if other.read_bytes() == sound else "another video was written over")
        tally.note(f"{kind}, {suffix}", wrong)
    yield tally.line()


@row(quick=3, full=60)
def jumps(trial: Trial) -> Iterator[Line]:
    """Times that jump, by milliseconds to thousands of years: shown, and blurred or refused."""
    tally, rng = Tally("jumps in the times of a video", "videos"), np.random.default_rng(trial.seed)
    slowest = largest = 0.0
    for number in range(trial.count):
        steps = np.full(12, 42, np.int64)
        for place in rng.integers(0, 12, rng.integers(1, 4)):
            steps[place] = int(10 ** rng.uniform(0, 14))
        times = [Fraction(int(t), 1000) for t in np.cumsum(steps)]
        path = clips.write(trial.folder / f"{number}.mkv", times=times, codec="ffv1",
                           tick=Fraction(1, 1000))  # fmt: skip
        wrong = ""
        for words in (["info", path], ["info", path, "--scan"],
                      ["blur", path, "-o", trial.folder / f"{number}.mp4", "--fps", "60",
                       "--flow", "none", "--longest-pause", "20", "-q"]):  # fmt: skip
            ended = wgmb(*words, seconds=_SECONDS)
            slowest, largest = max(slowest, ended.seconds), max(largest, ended.peak)
            much = f"{ended.peak:.0f} MiB" if ended.peak > _PEAK else ""
            wrong = wrong or ended.wrong(0, 2, name=path.name) or much
        tally.note(f"seed {trial.seed}, {number}", wrong)
    yield tally.line(f"slowest {slowest:.1f} s, most {largest:.0f} MiB")


@row(quick=4, full=100)
def joined(trial: Trial) -> Iterator[Line]:
    """Videos of two parts, of any sizes and times: refused, or no picture is lost unsaid."""
    tally, rng = (
        Tally("videos that were simply joined", "videos"),
        np.random.default_rng(trial.seed),
    )
    refused = 0
    for number in range(trial.count):
        data, many, codec = b"", 0, str(rng.choice(["libx264", "libx265"]))
        for _ in range(2):
            count, late = int(rng.integers(2, 14)), Fraction(int(rng.integers(0, 24)), 24)
            size = [2 * int(side) for side in rng.integers(16, 40, 2)]
            frames = [clips.frame(clips.planes(n, size), "yuv420p") for n in range(count)]
            part = trial.folder / "part.ts"
            data += clips.write(part, frames, late=float(late), codec=codec).read_bytes()
            many += count
        path = trial.folder / f"{number}.ts"
        path.write_bytes(data)
        wrong = wgmb("info", path, "--scan", seconds=_SECONDS).wrong(0, 1, 2, name=path.name)
        try:
            reader = VideoReader(path)
            found = sum(1 for _ in reader)
        except InputError as error:
            refused += 1
            wrong = wrong or ("" if "its clock goes back" in str(error) else str(error))
        else:
            told = bool(reader.loss() or any("the time of another" in n for n in reader.notes))
            wrong = wrong or ("" if found == many or told else f"{found} of {many} pictures")
        tally.note(f"seed {trial.seed}, {number}", wrong)
    yield tally.line(f"{refused} refused")


@row(quick=1, full=len(_FORMATS))
def outdated_videos(trial: Trial) -> Iterator[Line]:
    """--resume of a finished video after a change of anything that it depends on, or to itself."""
    tally = Tally("finished videos, one thing changed, --resume", "runs")
    for suffix in trial.some(_FORMATS):
        for name, change in _CHANGES.items():
            place = trial.folder / f"{suffix} {name}"
            place.mkdir()
            tally.note(f"{suffix}, {name}", _outdated(place, suffix, change))
    yield tally.line()


def _outdated(place: Path, suffix: str, change: Callable[[Path, Path], list[str]]) -> str:
    """The fault in a result that --resume made of another one, beside a fresh one."""
    source = clips.write(place / "in.mkv", codec="ffv1")
    mask = place / "mask.png"
    Image.fromarray(np.full((clips.HEIGHT, clips.WIDTH), 255, np.uint8)).save(mask)
    name = "o.####.png" if suffix == "png" else f"o.{suffix}"
    old, fresh = place / "old", place / "fresh"
    common = ["--holdout", str(mask), "--flow", "dis", "-q"]
    first = wgmb("blur", source, "-o", old / name, *common, "--fps", "12")
    given = [*common, *(change(place, old) or ["--fps", "12"])]
    was = contents(old)
    again = wgmb("blur", source, "-o", old / name, *given, "--resume")
    how = [] if suffix == "png" else ["--resume"]  # segments round otherwise
    plain = wgmb("blur", source, "-o", fresh / name, *given, *how)
    said = "made otherwise" if change is not _damage else "exists and "  # it may hit the record
    wrong = first.wrong(0) or again.wrong(0, 2, name=said) or plain.wrong(0)
    if wrong:
        return wrong
    if again.code == 2 or change is _no_change:
        return "" if contents(old) == was else "what is another's was written over"
    made, want = contents(old), contents(fresh)
    odd = [found for found in want if made.get(found) != want[found]]
    return f"{odd[0]} is not that of a fresh run" if odd else ""


def _no_change(_place: Path, _old: Path) -> list[str]:
    return []


def _rate(_place: Path, _old: Path) -> list[str]:
    return ["--fps", "8"]


def _range(_place: Path, _old: Path) -> list[str]:
    return ["--frames", "2-9", "--fps", "12"]


def _cuts(_place: Path, _old: Path) -> list[str]:
    return ["--cuts", "only:4", "--fps", "12"]


def _shutter(_place: Path, _old: Path) -> list[str]:
    return ["--shutter", "300", "--fps", "12"]


def _mask(place: Path, _old: Path) -> list[str]:
    Image.fromarray(np.zeros((clips.HEIGHT, clips.WIDTH), np.uint8)).save(place / "mask.png")
    return []


def _input(place: Path, _old: Path) -> list[str]:
    frames = [clips.frame(clips.planes(n + 1), "yuv420p") for n in range(12)]
    clips.write(place / "in.mkv", frames, codec="ffv1")
    return []


def _damage(_place: Path, old: Path) -> list[str]:
    for path in sorted(old.iterdir())[:1]:
        data = bytearray(path.read_bytes())
        middle = len(data) // 2
        data[middle : middle + 60] = bytes(60)
        path.write_bytes(data)
    return []


_CHANGES = {
    "nothing": _no_change,
    "rate": _rate,
    "range": _range,
    "cuts": _cuts,
    "shutter": _shutter,
    "mask": _mask,
    "input": _input,
    "damage": _damage,
}
