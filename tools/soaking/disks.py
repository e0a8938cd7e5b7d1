"""Disks that are full, folders that are not, outputs that cannot be written."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator
from pathlib import Path

import make_frames as make

from .processes import WGMB, limits, run, wgmb
from .shots import contents
from .table import Line, Tally, Trial, row

STILLS, VIDEOS = ("exr", "png", "tif", "jpg"), ("mp4", "mov", "mkv", "webm", "gif")
_FRAMES = 5
_FULL = 1500  # bytes a file may have


def _target(folder: Path, suffix: str) -> Path:
    return folder / (f"o.{suffix}" if suffix in VIDEOS else f"o.####.{suffix}")


@row(full=len(STILLS) + len(VIDEOS))
def full_disk(trial: Trial) -> Iterator[Line]:
    """Files that cannot grow (RLIMIT_FSIZE): an error, and nothing half written."""
    pattern = make.write_sequence(trial.folder, range(1, _FRAMES + 1))
    tally, most = Tally("full disk", "formats"), 0
    for suffix in trial.some((*STILLS, *VIDEOS)):
        out = trial.folder / suffix
        words = ["blur", pattern, "-o", _target(out, suffix), "--method", "tap"]
        ended = wgmb(*words, prepare=limits(file=_FULL))
        lines = ended.err.strip().splitlines()
        most = max(most, len(lines))
        short = Path(f"{out}").name
        wrong = f"left: {sorted(contents(out))[0]}" if contents(out) else ""
        if ended.code != 1 or "Traceback" in ended.err:
            wrong = wrong or ended.wrong(1) or f"exit {ended.code}"
        tally.note(suffix, wrong or ("" if short in ended.err else "does not name the output"))
    yield tally.line(f"at most {most} lines of error for {_FRAMES} frames")
    out = trial.folder / "kept"
    out.mkdir()
    (out / "o.0001.exr").write_bytes(b"what was there")
    words = ["blur", pattern, "-o", _target(out, "exr"), "--method", "tap", "--overwrite"]
    wgmb(*words, prepare=limits(file=_FULL))
    tally = Tally("full disk, --overwrite", "runs")
    kept = contents(out) == {"o.0001.exr": b"what was there"}
    tally.note("exr", "" if kept else "what was there is gone")
    yield tally.line()


@row(full=1)
def stamina(trial: Trial) -> Iterator[Line]:
    """A disk that is full for good ends a run early: not every frame is drawn in vain."""
    pattern = make.write_sequence(trial.folder, range(1, 61))
    out = trial.folder / "out"
    words = ["blur", pattern, "-o", _target(out, "exr"), "--method", "tap"]
    ended = wgmb(*words, prepare=limits(file=_FULL))
    lines = len(ended.err.strip().splitlines())
    tally = Tally("a disk that stays full, 60 frames", "runs")
    tally.note("exr", f"{lines} lines of error" if lines > 30 or ended.code != 1 else "")
    yield tally.line(f"{lines} lines in {ended.seconds:.1f} s")


@row(full=9)
def refused_places(trial: Trial) -> Iterator[Line]:
    """Outputs and inputs that cannot be opened: one line, exit code 2."""
    here = trial.folder
    pattern = make.write_sequence(here, (1, 2))
    (here / "file").write_text("")
    (here / "folder.exr").mkdir()
    (here / "loop").symlink_to(here / "loop")
    unread = here / "unread.exr"
    make.write_exr(unread, make.frame(1))
    unread.chmod(0)
    out = ["-o", here / "out" / "o.####.exr"]
    cases = {
        "/proc": ["blur", pattern, "-o", "/proc/nowhere/o.####.exr"],
        "under a file": ["blur", pattern, "-o", here / "file" / "o.####.exr"],
        "a folder as output": ["blur", here / "shot.0001.exr", "-o", here / "folder.exr"],
        "a link to itself": ["blur", pattern, "-o", here / "loop" / "o.####.exr"],
        "a folder as input": ["blur", here / "folder.exr", *out],
        "a folder as mask": ["blur", pattern, *out, "--holdout", here / "folder.exr"],
        "a folder as camera": ["blur", pattern, *out, "--camera", here / "folder.exr"],
        "a folder as curve": ["blur", pattern, *out, "--curve", here / "folder.exr"],
        "a folder as --config": ["blur", pattern, *out, "--config", here / "folder.exr"],
        "no such file": ["blur", here / "none.####.exr", *out],
    }
    if os.geteuid():  # root may read everything
        cases["denied"] = ["blur", unread, *out]
    tally = Tally("places that cannot be", "commands")
    for name, words in cases.items():
        if name == "a folder as mask":  # found out frame by frame
            ended = wgmb(*words)
            bad = "Traceback" in ended.err or ended.code not in (1, 2)
            tally.note(name, ended.wrong(2) if bad else "")
        else:
            tally.note(name, wgmb(*words).wrong(2))
    read_only = here / "read only"
    read_only.mkdir(mode=0o500)
    if os.geteuid():
        ended = wgmb("blur", pattern, "-o", read_only / "o.####.exr")
        tally.note("read-only folder", ended.wrong(2))
    yield tally.line("as root: nothing is denied" if not os.geteuid() else "")


@row(full=2)
def deaf_terminals(trial: Trial) -> Iterator[Line]:
    """Nobody takes what is said (/dev/full): frames are made all the same."""
    pattern = make.write_sequence(trial.folder, (1, 2))
    tally = Tally("/dev/full as stdout, stderr", "commands")
    for stream, codes in (("2>", (0,)), (">", (0,))):
        out = trial.folder / f"out{len(stream)}"
        words = [*WGMB, "blur", pattern, "-o", str(out / "o.####.exr"), "--method", "tap"]
        ended = run(["sh", "-c", f"{shlex.join(words)} {stream} /dev/full"])
        missing = f"{len(contents(out))} of 2 files" if len(contents(out)) != 2 else ""
        tally.note(stream, ended.wrong(*codes) or missing)
    ended = run(["sh", "-c", f"{shlex.join([*WGMB, 'info', pattern])} > /dev/full"])
    tally.note("info", ended.wrong(1))
    yield tally.line()
