"""Videos of people: long ones in the same memory, kills and resumes, and sound that stays."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from .processes import WGMB, Ended, environment, use, wgmb
from .table import Line, Tally, Trial, row

_MOST_GROWN = 20.0  # MiB after the first pictures
_FIRST = 0.25  # of a run, after which memory counts: modules are loaded, encoders have filled
_PATIENCE = 3600.0
_WORDS = "--flow", "none", "-q"


def flat(path: Path, count: int, size: tuple[int, int], fps: int = 240, tone: float = 0) -> Path:
    """A video with one thing that moves, quickly decoded, and perhaps with sound."""
    width, height = size
    part = max(2, width // 24)
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=fps, options={"preset": "ultrafast"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        heard = out.add_stream("aac", rate=48000) if tone else None
        luma = np.full((height, width), 90, np.uint8)
        chroma = np.full((height // 2, width // 2), 128, np.uint8)
        for number in range(count):
            picture = luma.copy()
            at = 3 * number % (width - part)
            picture[height // 3 : height // 3 + part, at : at + part] = 200
            whole = np.concatenate([p.ravel() for p in (picture, chroma, chroma)])
            frame = av.VideoFrame.from_ndarray(whole.reshape(-1, width), format="yuv420p")
            frame.pts, frame.time_base = number, Fraction(1, fps)
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
        if heard is not None:
            wave = np.sin(np.arange(round(48000 * tone)) * 0.05).astype(np.float32)[None]
            sound = av.AudioFrame.from_ndarray(np.repeat(wave, 2, 0), "fltp", "stereo")
            sound.sample_rate, sound.pts = 48000, 0
            out.mux(heard.encode(sound))
            out.mux(heard.encode(None))
    return path


def _held(arguments: list[str]) -> tuple[list[float], int]:
    """MiB that a run of `wgmb blur` holds, as time goes by, and its exit code."""
    quiet = subprocess.DEVNULL
    process = subprocess.Popen([*WGMB, *arguments], stdout=quiet, stderr=quiet, env=environment())
    held: list[float] = []
    while process.poll() is None:
        try:
            held.append(use(process.pid).memory / 1024)
        except OSError:  # it has ended meanwhile
            break
        time.sleep(0.25)
    return held, process.wait()


@row(full=3000)
def video_memory(trial: Trial) -> Iterator[Line]:
    """A long video is blurred in the memory of a short one: 1080p averaged, 192 x 108 by motion."""
    for flow, size in (("none", (1920, 1080)), ("dis", (192, 108))):
        source = flat(trial.folder / f"{flow}.mp4", trial.count, size)
        out = trial.folder / f"{flow} out.mp4"
        words = ["blur", str(source), "-o", str(out), "--flow", flow, "--fps", "60", "-q"]
        held, code = _held(words)
        steady = held[: len(held) - 4]  # at the end it lets go
        warm = round(_FIRST * len(steady))
        grown = max(steady[warm:], default=0.0) - (steady[warm] if warm < len(steady) else 0.0)
        tally = Tally(f"memory of {trial.count:,} pictures, --flow {flow}", "videos")
        wrong = f"exit {code}" if code else f"+{grown:.0f} MiB" if grown > _MOST_GROWN else ""
        tally.note("{} x {}".format(*size), wrong)
        yield tally.line(f"{grown:+.1f} MiB, at most {max(held, default=0):.0f} MiB")


def _times_and_sums(path: Path) -> tuple[list[float], list[int]]:
    """Times of the pictures of a video, and the sum of the luma of each."""
    with av.open(str(path)) as container:
        found = [
            (frame.time or 0.0, int(frame.to_ndarray(format="gray").sum(dtype=np.int64)))
            for frame in container.decode(video=0)
        ]
    return [time for time, _ in found], [total for _, total in found]


def _sound(path: Path) -> list[bytes]:
    with av.open(str(path)) as container:
        if not container.streams.audio:
            return []
        return [bytes(p) for p in container.demux(audio=0) if p.size]


@row(full=20, quick=2)
def resumed_videos(trial: Trial) -> Iterator[Line]:
    """`kill -9` at a random moment, then --resume: the bytes of an unbroken run with --resume.

    With sound and without. They have the times and the sound of a run without --resume, and its
    pictures but for what encoders round otherwise at the beginning of a segment.
    """
    made = [_unbroken(trial.folder / name, tone) for name, tone in (("sound", 60), ("mute", 0))]
    tally = Tally("video, --resume, beside one run without", "videos")
    for source, plain, whole, _ in made:
        other = "" if _sound(whole) == _sound(source) else "its sound is another"
        tally.note(source.parent.name, _apart(plain, whole) or other)
    yield tally.line()
    tally, midway = Tally("video, `kill -9`, then --resume", "runs"), 0
    rng = np.random.default_rng(trial.seed)
    for number in range(trial.count):
        source, _, whole, lasts = made[number % 2]
        out = source.with_name(f"out {number}.mp4")
        at_once = number % 8 > 5  # before anything is there
        midway += _killed(source, out, at_once, rng.uniform(0, 0.3) * lasts)
        again = _blurred(source, out, "--resume", seconds=_PATIENCE)
        begins = (".", f"{out.name}.")
        left = [p.name for p in source.parent.iterdir() if p.name.startswith(begins)]
        wrong = again.wrong(0) or (f"left over: {left[0]}" if left else "")
        if not wrong and out.read_bytes() != whole.read_bytes():
            wrong = _apart(whole, out) or "its bytes are others"
        tally.note(f"run {number}, {source.parent.name}", wrong)
    if not midway:
        tally.note("all runs", "none died with segments begun, so that nothing was resumed")
    yield tally.line(f"{midway} died with segments begun")


def _unbroken(folder: Path, tone: float) -> tuple[Path, Path, Path, float]:
    """A video, what it becomes without --resume and with it, and how long that took [s]."""
    folder.mkdir()
    source = flat(folder / "in.mp4", 240, (96, 64), fps=4, tone=tone)
    plain, whole = folder / "plain.mp4", folder / "whole.mp4"
    simple, ended = _blurred(source, plain), _blurred(source, whole, "--resume")
    if ended.code or simple.code:
        raise RuntimeError(ended.wrong(0) or simple.wrong(0))
    return source, plain, whole, ended.seconds


def _blurred(source: Path, out: Path, *more: str, **how: float) -> Ended:
    return wgmb("blur", source, "-o", out, *_WORDS, *more, **how)


def _killed(source: Path, out: Path, at_once: bool, wait: float) -> bool:
    """Kill a run after `wait` seconds from its first segment on, or `at_once` from its beginning.

    Returns whether segments were begun.
    """
    line = [*WGMB, "blur", str(source), "-o", str(out), *_WORDS, "--resume"]
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(line, stdout=quiet, stderr=quiet, env=environment())
    segments = out.with_name(f"{out.name}.segments")
    while not at_once and process.poll() is None and not any(segments.glob("*.mp4")):
        time.sleep(0.01)
    time.sleep(wait)
    process.send_signal(signal.SIGKILL)
    process.wait()
    return any(segments.glob("*.mp4"))


def _apart(one: Path, other: Path) -> str:
    """Differences of two videos of one picture size; "" if none matters."""
    (times, sums), (also, more) = _times_and_sums(one), _times_and_sums(other)
    far = max((abs(a - b) for a, b in zip(times, also, strict=False)), default=0.0)
    if len(times) != len(also) or far > 1e-6:
        return f"{len(also)} of {len(times)} pictures, {far:.4f} s off"
    off = max((abs(a - b) for a, b in zip(sums, more, strict=True)), default=0)
    return f"a picture is {off / (96 * 64):.1f} levels off" if off > 2 * 96 * 64 else ""


def _flash_and_click(path: Path) -> tuple[float, float]:
    """Times of the middle of the bright pictures and of the loudest sound [s].

    In slow motion a flash is several pictures long.
    """
    times, sums = _times_and_sums(path)
    darkest, brightest = min(sums), max(sums)
    shown = float(np.average(times, weights=[s > (darkest + brightest) / 2 for s in sums]))
    loud, heard = 0.0, 0.0
    with av.open(str(path)) as container:
        for frame in container.decode(audio=0):
            wave = np.abs(frame.to_ndarray()[0].astype(np.float64))
            if wave.max() > loud:
                loud = float(wave.max())
                heard = (frame.time or 0.0) + int(wave.argmax()) / frame.sample_rate
    return shown, heard


@row(full=600)
def slow_sound(trial: Trial) -> Iterator[Line]:
    """Ten minutes at --speed 0.4: a flash near the end within half an output frame of its click."""
    seconds, fps = trial.count, 24
    source, out = trial.folder / "long.mkv", trial.folder / "slow.mkv"
    flash = round((seconds - 5) * fps)
    with av.open(str(source), "w") as file:
        stream = file.add_stream("libx264", rate=fps, options={"preset": "ultrafast"})
        stream.width, stream.height, stream.pix_fmt = 32, 32, "yuv420p"
        heard = file.add_stream("flac", rate=48000)
        heard.layout = "mono"
        for number in range(seconds * fps):
            data = np.full((48, 32), 128, np.uint8)
            data[:32] = 220 if number == flash else 20
            frame = av.VideoFrame.from_ndarray(data, format="yuv420p")
            frame.pts, frame.time_base = number, Fraction(1, fps)
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
        click = round(48000 * (flash / fps + 0.001))
        for second in range(seconds):
            wave = np.zeros((1, 48000), np.int16)
            if second == click // 48000:
                wave[0, click % 48000 : click % 48000 + 48] = 30_000
            sound = av.AudioFrame.from_ndarray(wave, "s16", "mono")
            sound.sample_rate, sound.pts = 48000, 48000 * second
            sound.time_base = Fraction(1, 48000)
            file.mux(heard.encode(sound))
        file.mux(heard.encode(None))
    words = ["--flow", "none", "--speed", "0.4", "--fps", fps, "-q"]
    ended = wgmb("blur", source, "-o", out, *words, seconds=_PATIENCE)
    wrong, told = ended.wrong(0), ""
    if not wrong:
        shown, heard = _flash_and_click(out)
        apart = heard - shown - 0.001 / 0.4
        told = f"{1000 * apart:+.1f} ms apart"
        wrong = told if abs(apart) > 0.5 / fps else ""
    tally = Tally(f"{seconds} s at --speed 0.4, flash and click", "videos")
    tally.note("long.mkv", wrong)
    yield tally.line(told)
