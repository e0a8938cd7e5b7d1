"""Small videos, written with PyAV alone: pictures whose numbers can be read back, and a tone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

WIDTH, HEIGHT = 64, 48
TICK = Fraction(1, 90000)
RATE = 24


def level(number: int) -> int:
    """The luma of the frame of that number: far from its neighbours'."""
    return 40 + 35 * (number % 6)


def planes(number: int, size=(WIDTH, HEIGHT), steps=(2, 2), bits: int = 8, alpha=False):
    """Y, Cb, Cr (and alpha): a ramp from left to right over the frame's own level."""
    width, height = size
    kind, scale = (np.uint8 if bits == 8 else np.uint16), 1 << (bits - 8)
    y, x = np.mgrid[:height, :width]
    luma = level(number) + (x * 8 // width) + (y * 4 // height)
    chroma = np.mgrid[: -(-height // steps[1]), : -(-width // steps[0])]
    found = [luma * scale, (100 + chroma[1] % 32) * scale, (140 + chroma[0] % 32) * scale]
    if alpha:
        found.append((x * 255 // width) * scale)
    return tuple(plane.astype(kind) for plane in found)


def frame(data: Sequence[np.ndarray], pixels: str) -> av.VideoFrame:
    """A frame with these planes in the order of FFmpeg's own."""
    made = av.VideoFrame(data[0].shape[1], data[0].shape[0], pixels)
    for plane, samples in zip(made.planes, data, strict=True):
        raw = np.ascontiguousarray(samples).view(np.uint8).reshape(samples.shape[0], -1)
        rows = np.frombuffer(plane, np.uint8).reshape(plane.height, -1)
        rows[:, : raw.shape[1]] = raw
    return made


def grey(size: tuple[int, int], pixels: str = "yuv420p") -> av.VideoFrame:
    """One frame of mid grey."""
    made = av.VideoFrame(*size, pixels)
    for plane in made.planes:
        np.frombuffer(plane, np.uint8)[:] = 128
    return made


def write(
    path: Path,
    frames: Iterable[av.VideoFrame] | None = None,
    times: Sequence[Fraction | float] | None = None,
    *,
    codec: str = "libx264",
    pixels: str = "yuv420p",
    options: dict[str, str] | None = None,
    tags: tuple[int, int, int, int] | None = None,
    tone: float = 0,
    sound: tuple[str, int, np.ndarray] | None = None,
    gap: tuple[float, float] = (0, 0),
    late: float = 0,
    before: Callable[[av.container.OutputContainer], None] | None = None,
    also: Callable[[av.container.OutputContainer], None] | None = None,
    setup: Callable[[av.VideoStream], None] | None = None,
    kind: str | None = None,
    muxing: dict[str, str] | None = None,
    tick: Fraction = TICK,
    rate: Fraction = Fraction(RATE),
) -> Path:
    """A clip; `times` [s] of its frames, by default `rate` a second, which the file states.

    `tags`: range, matrix, transfer, primaries. `tone`: seconds of sound; or `sound`: codec,
    rate and samples. `gap`: where it pauses, and for how long [s]. `late`: how much later
    than the sound pictures begin. `setup` is called on the stream of pictures, `before` on the
    container before and `also` after they are written.
    """
    made = list(frames) if frames is not None else [frame(planes(n), pixels) for n in range(12)]
    shown = [late + t for t in (times or [n / rate for n in range(len(made))])]
    with av.open(str(path), "w", format=kind, container_options=muxing or {}) as out:
        stream = out.add_stream(codec, rate=rate, options=options or lossless(codec))
        stream.width, stream.height, stream.pix_fmt = made[0].width, made[0].height, pixels
        stream.codec_context.time_base = tick
        if tags is not None:
            context = stream.codec_context
            context.color_range, context.colorspace = tags[:2]
            context.color_trc, context.color_primaries = tags[2:]
        if setup is not None:
            setup(stream)
        if tone:
            sound = ("aac", 48000, _tone(tone))
        heard = None
        if sound is not None:
            heard = out.add_stream(sound[0], rate=sound[1])
            heard.layout = "mono"
        if before is not None:
            before(out)
        for one, time in zip(made, shown, strict=True):
            one.pts, one.time_base = round(time / tick), tick
            if tags is not None:
                one.color_range, one.colorspace = tags[:2]
                one.color_trc, one.color_primaries = tags[2:]
            out.mux(stream.encode(one))
        out.mux(stream.encode(None))
        if sound is not None and heard is not None:
            for block in samples(0, sound[1], sound[2]):
                if block.pts >= gap[0] * sound[1]:
                    block.pts += round(gap[1] * sound[1])
                out.mux(heard.encode(block))
            out.mux(heard.encode(None))
        if also is not None:
            also(out)
    return path


def lossless(codec: str) -> dict[str, str]:
    """Options that keep every sample, or nearly so."""
    return {
        "libx264": {"qp": "0", "preset": "ultrafast"},
        "libx265": {"x265-params": "lossless=1:log-level=none", "preset": "ultrafast"},
        "mpeg2video": {"qmin": "1", "qmax": "1"},
    }.get(codec, {})


def _tone(seconds: float, rate: int = 48000) -> np.ndarray:
    return 0.3 * np.sin(2 * np.pi * 440 * np.arange(round(seconds * rate)) / rate)


def samples(seconds: float, rate: int = 48000, wave: np.ndarray | None = None):
    """Sound: a tone of 440 Hz, or `wave` (-1..1), in frames of 1024 samples."""
    wave = _tone(seconds, rate) if wave is None else wave
    for begin in range(0, len(wave), 1024):
        part = np.ascontiguousarray(wave[None, begin : begin + 1024], np.float32)
        block = av.AudioFrame.from_ndarray(part, format="fltp", layout="mono")
        block.sample_rate, block.pts, block.time_base = rate, begin, Fraction(1, rate)
        yield block
