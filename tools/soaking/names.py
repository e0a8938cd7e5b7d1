"""Names of files and numbers of frames, as odd as they may be; words that make no sense."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import make_frames as make
from wgmb import Clip, InputError, Output

from .processes import limits, wgmb
from .shots import shot
from .stopping import Running
from .table import Line, Tally, Trial, row

_STEMS = ("shot.", "two words.", "a#b.", "a@.", "1-5", "shot1-3", "a.<UDIM>.", "s<b>.", "9", "ü.",
          "shot_v02.", "a..", "100%.", "-o.", "~.", "[1].", "{a,b}.", "$HOME.")  # fmt: skip
_PADS = {"####": 4, "#": 1, "%04d": 4, "$F4": 4, "@@@@": 4}  # digits, at least
_MANY = ("shot.", "9", "a..", "1-5", "two words.", "shot_v02.", "a@.", "ü.")
PATTERNS = [(stem, pad) for stem in _STEMS for pad in _PADS if pad == "####" or stem in _MANY]
_NUMBERS = [8, 9, 10]


def _understood(stem: str, pad: str, folder: Path) -> str:
    """The fault in the reading of a pattern: as its files, or refused with a reason."""
    folder.mkdir()
    pattern = f"{stem}{pad}.exr"
    names = [f"{stem}{number:0{_PADS[pad]}d}.exr" for number in _NUMBERS]
    source = make.write_exr(folder / "one", make.frame(1))
    for name in names:
        (folder / name).hardlink_to(source)
    try:
        found = Clip(folder / pattern).numbers
        files = [Output(folder / pattern, numbers=[n], overwrite=True).path(n) for n in found]
    except InputError as error:
        return str(error) if "no such frames" in str(error) else ""
    if found != _NUMBERS:
        return f"frames {found[:4]}"
    return "" if [p.name for p in files] == names else f"written as {files[0].name}"


@row(full=len(PATTERNS))
def patterns(trial: Trial) -> Iterator[Line]:
    """Names of frame sequences, in every way to write the number."""
    tally = Tally("name patterns", "patterns")
    for number, (stem, pad) in enumerate(trial.some(PATTERNS)):
        try:
            wrong = _understood(stem, pad, trial.folder / str(number))
        except Exception as error:
            wrong = f"{type(error).__name__}: {error}"
        tally.note(f"{stem}{pad}.exr", wrong)
    yield tally.line()


@row(full=4)
def far_apart(trial: Trial) -> Iterator[Line]:
    """Frame numbers that are far apart, or very many: no memory for those between."""
    (trial.folder / "in").mkdir()
    for number in (1, 3_000_000_000):
        make.write_exr(trial.folder / "in" / f"shot.{number:04d}.exr", make.frame(1))
    pattern = trial.folder / "in" / "shot.####.exr"
    out = trial.folder / "out"
    cases = {
        "info": ["info", pattern],
        "blur": ["blur", pattern, "-o", out / "o.####.exr"],
        "blur --frames": ["blur", pattern, "--frames", "1-3000000000", "-o", out / "p.####.exr"],
        "render --frames": ["render", "crossing", "--frames", "0-3000000000", "-o",
                            out / "r.####.exr"],
    }  # fmt: skip
    tally = Tally("frame numbers 1 and 3,000,000,000", "commands")
    largest = 0.0
    for name in trial.some(cases):
        ended = wgmb(*cases[name], prepare=limits(memory=4096), seconds=60)
        largest = max(largest, ended.peak)
        tally.note(name, ended.wrong(0, 2))
    yield tally.line(f"at most {largest:.0f} MiB")


@row(full=100_000)
def many_files(trial: Trial) -> Iterator[Line]:
    """A folder of many frames: seconds to the first picture, and to the end after Ctrl-C."""
    made = shot(trial.folder / "in", trial.count)
    tally = Tally(f"{trial.count:,} files", "runs")
    started = time.perf_counter()
    ended = wgmb("blur", made.pattern, "--frames", "77", "-o", trial.folder / "one.####.exr",
                 "--method", "tap", "--vectors", "blender", seconds=300)  # fmt: skip
    one = time.perf_counter() - started
    tally.note("one of them", ended.wrong(0) or (f"{one:.1f} s" if one > 15 else ""))
    running = Running(made, trial.folder / "out")
    started = time.perf_counter()
    running.until(running.writing, seconds=300)
    first = time.perf_counter() - started
    code, _, stopped = running.stop(signal.SIGINT)
    wrong = f"exit {code}" if code != 130 else ""
    wrong = wrong or (f"{first:.1f} s to the first picture" if first > 15 else "")
    tally.note("all", wrong or (f"{stopped:.1f} s to stop" if stopped > 5 else ""))
    yield tally.line(f"one {one:.1f} s; all: first picture after {first:.1f} s, "
                     f"stopped within {stopped:.1f} s")  # fmt: skip


@row(full=100)
def words(trial: Trial) -> Iterator[Line]:
    """Command lines that make no sense: one line and exit code 2, never a traceback."""
    place, shown = trial.folder, trial.folder / "shot.0001.exr"
    make.write_exr(shown, make.frame(1))
    (place / "deep.toml").write_text("a = " + "[" * 5000)
    (place / "long.toml").write_text("a = " + "9" * 5000)
    (place / "number.toml").write_text('[render]\nscene = "crossing"\nset = 3\n')
    (place / "view.toml").write_text('view = 3\n[render]\nscene = "crossing"\n')
    (place / "latin.toml").write_bytes(b'[render]\nscene = "cross\xefng"\n')
    out = ["-o", place / "out" / "o.png"]
    video = ["render", "crossing", "--size", "64x36", "--frames", "0-3", "--antialias", "1", "-o"]
    cases = [
        *(["view", "--config", place / f"{n}.toml"] for n in ("deep", "long", "number", "view",
                                                             "latin")),
        ["blur", shown, *out, "--config", place / "deep.toml"],
        ["render", "crossing", *out, "--config", place / "latin.toml"],
        ["render", "crossing", *out, "--set", "name=x"],
        ["render", "crossing", *out, "--set", "speed=x"],
        ["render", "crossing", *out, "--set", "speed=nan"],
        ["render", "crossing", *out, "--size", "0x0"],
        ["render", "crossing", *out, "--size", "99999999999x9"],
        ["render", "crossing", *out, "--frames", "1-"],
        ["compare", "crossing:name=x", "-o", place / "c.html"],
        *([*video, place / f"v{fps}.{suffix}", "--fps", fps]
          for fps in ("0.333333333333", "999.999999999", "0.001", "1e-400", "nan", "1/0")
          for suffix in ("mp4", "webm")),
        ["blur", shown, *out, "--shutter", "nan"],
        ["blur", shown, *out, "--shutter", "1e400"],
        ["blur", shown, *out, "--samples", "-1"],
        ["blur", shown, *out, "--samples", "9" * 400],
        ["blur", shown, *out, "--holdout", ""],
        ["blur", shown, *out, "--holdout", "CryptoObject=hero"],
        ["blur", "", *out],
        ["blur", "-o.####.exr", *out],
        ["blur", "a\0b.exr", *out],
        ["blur", shown, "-o", ""],
        ["blur", shown, "-o", "x" * 300 + ".exr"],
        ["info", shown, "--frames", "1-1000"],
        ["info", os.fsdecode(b"\xff\xfe.exr")],
        ["nonsense"],
        [],
    ]  # fmt: skip
    tally = Tally("words that make no sense", "commands")
    for case in trial.some(cases):
        if any("\0" in str(word) for word in case):  # no process can be given these
            continue
        ended = wgmb(*case, env={"DISPLAY": "", "WAYLAND_DISPLAY": ""})
        name = " ".join(Path(str(w)).name if "/" in str(w) else str(w)[:40] for w in case)
        failed = ended.code == 1 and "frames failed" in ended.err
        tally.note(name, "" if failed and "Traceback" not in ended.err else ended.wrong(0, 2))
    yield tally.line()
