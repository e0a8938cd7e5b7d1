"""Videos: long ones in little memory, short ones of every kind, and what a kill leaves."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from wgmb import Output
from wgmb.sequence.frame_file import FrameFile

from .processes import apart, use
from .shots import contents, shot
from .stopping import Running
from .table import Line, Tally, Trial, row

_CLOCK = 0.0101  # seconds: GIF counts hundredths
_SUFFIXES = ("mp4", "mov", "mkv", "webm", "gif")
_SHAPES = [
    (64, 36, "24", 5),
    (65, 37, "24", 5),
    (1, 1, "24", 3),
    (2, 3, "25", 3),
    (64, 36, "24000/1001", 5),
    (64, 36, "30", 1),
    (64, 36, "60", 5),
    (64, 36, "1", 3),
    (64, 36, "1/3", 3),
    (64, 36, "1000", 5),
]  # width, height, frames a second, frames


def written(path: str, width: int, height: int, fps: str, count: int, noise: bool) -> list[float]:
    """In a process of its own: MiB before the first frame, most of it since, and seconds."""
    rng = np.random.default_rng(1)
    picture = rng.random((height, width, 3), np.float32)
    started, before = time.perf_counter(), use().memory
    output = Output(path, numbers=list(range(count)), fps=Fraction(fps))
    most = before
    for number in range(count):
        if noise:
            picture = rng.random((height, width, 3), np.float32)
        output.write(picture, FrameFile(number, Path(), None, {}, {}))
        if number % 16 == 0:
            most = max(most, use().memory)
    output.close()
    peak = _peak()
    return [before / 1024, max(most / 1024, peak), time.perf_counter() - started]


def _peak() -> float:
    """MiB that this process held at most."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


def _look(path: Path, count: int, fps: Fraction) -> str:
    """The fault in a video."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        times = [frame.time for frame in container.decode(stream)]
    if len(times) != count:
        return f"{len(times)} of {count} frames"
    lasts, wanted = times[-1] - times[0], float((count - 1) / fps)
    if abs(lasts - wanted) > max(0.01 * wanted, _CLOCK):
        return f"{lasts:.3f} s from the first frame to the last instead of {wanted:.3f} s"
    return ""


@row(full=len(_SHAPES))
def short_videos(trial: Trial) -> Iterator[Line]:
    """Videos of a few frames: odd sizes and rates, in every format."""
    tally = Tally("short videos", "videos")
    for width, height, fps, count in trial.some(_SHAPES):
        for suffix in _SUFFIXES:
            if suffix == "gif" and Fraction(fps) > 50:  # more than the format can tell
                continue
            path = trial.folder / f"{width}x{height} {fps.replace('/', ' ')} {count}.{suffix}"
            ended = apart(written, str(path), width, height, fps, count, True)
            wrong = ended.wrong(0) or _look(path, count, Fraction(fps))
            tally.note(path.name, wrong)
    yield tally.line()


@row(full=10_000)
def long_video(trial: Trial) -> Iterator[Line]:
    """An MP4 of thousands of frames holds no more memory than a short one."""
    path = trial.folder / "long.mp4"
    few = apart(written, str(trial.folder / "few.mp4"), 320, 180, "24", 100, True)
    ended = apart(written, str(path), 320, 180, "24", trial.count, True, seconds=3600)
    if few.value is None or ended.value is None:
        raise RuntimeError(few.wrong(0) or ended.wrong(0))
    more = ended.value[1] - few.value[1]
    wrong = _look(path, trial.count, Fraction(24)) or (f"{more:+.0f} MiB" if more > 16 else "")
    tally = Tally(f"MP4 of {trial.count:,} frames", "videos")
    tally.note("noise", wrong)
    yield tally.line(f"{ended.value[2]:.0f} s, most {ended.value[1]:.0f} MiB, "
                     f"100 frames {few.value[1]:.0f} MiB")  # fmt: skip


@row(full=300)
def gif_memory(trial: Trial) -> Iterator[Line]:
    """A GIF holds its frames in memory, at most once."""
    width, height = 320, 180
    path = trial.folder / "noise.gif"
    ended = apart(written, str(path), width, height, "25", trial.count, True, seconds=3600)
    if ended.value is None:
        raise RuntimeError(ended.wrong(0))
    before, most, seconds = ended.value
    bytes_ = width * height * 3 * trial.count / (1 << 20)
    tally = Tally(f"GIF of {trial.count} frames of {width} x {height}, noise", "videos")
    allowed = 1.25 * bytes_ + 48  # and the encoder
    tally.note("noise", f"+{most - before:.0f} MiB" if most - before > allowed else "")
    yield tally.line(
        f"{seconds:.0f} s, {before:.0f} -> {most:.0f} MiB; the frames are {bytes_:.0f} MiB"
    )


@row(full=8)
def killed_videos(trial: Trial) -> Iterator[Line]:
    """A video that is killed is not there, and the next run leaves nothing of it behind."""
    made = shot(trial.folder / "in", 120)
    tally = Tally("video, `kill -9`, then again", "runs")
    rng = np.random.default_rng(trial.seed)
    for number in range(trial.count):
        suffix = _SUFFIXES[number % 4]
        out = trial.folder / f"out {number}"
        target = out / f"o.{suffix}"
        running = Running(made, out, target=target)
        running.until(lambda out=out: out.exists() and any(out.iterdir()))
        time.sleep(rng.random() * 0.3)
        code, _, _ = running.stop(signal.SIGKILL)
        half = code == -signal.SIGKILL and target.exists()
        again = Running(made, out, "--overwrite", target=target)
        end = again.process.wait(300)
        again.err.close()
        left = [name for name in contents(out) if name != target.name]
        wrong = "half a video is there" if half else f"exit {end}" if end else ""
        wrong = wrong or (f"left over: {left[0]}" if left else "")
        tally.note(suffix, wrong or _look(target, made.count, Fraction(24)))
    yield tally.line()
