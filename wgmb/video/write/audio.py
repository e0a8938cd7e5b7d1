"""Sound at another speed: decoded, stretched or resampled, and encoded again."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from fractions import Fraction
from typing import cast

import av
import numpy as np
from av.audio.layout import AudioLayout
from av.audio.resampler import AudioResampler
from av.audio.stream import AudioStream
from av.codec.codec import UnknownCodecError
from av.container import OutputContainer
from av.error import BlockingIOError, EOFError, FFmpegError
from av.filter import Graph
from av.packet import Packet

from ..clock import Clock
from .time_stretch import TimeStretch

_ENCODERS = {"opus": "libopus", "vorbis": "libopus", "mp3": "libmp3lame", "mp3float": "libmp3lame"}
_SAME = ("aac", "flac", "alac", "ac3", "eac3", "pcm_")  # whose encoders have the decoders' names
_BY_DEFAULT = {"webm": "libopus"}  # elsewhere AAC
_PER_CHANNEL = 96_000  # bits a second, at least
_GAP = Fraction(1, 20)  # of the input's times [s], that silence fills


class SoundAtSpeed:
    """A stream of sound at a Clock's speed, at its own pitch or (`keeps_pitch` False) as a tape.

    Gaps in the input's times stay gaps, as silence. `into` is the output's stream that `encoder`
    made.
    """

    def __init__(self, source: AudioStream, into: AudioStream, clock: Clock, keeps_pitch: bool):
        self._source, self._into, self._clock = source, into, clock
        self._rate = source.rate
        self._fltp = AudioResampler("fltp", source.layout, self._rate)
        if keeps_pitch:
            self._changed = TimeStretch(self._rate, source.layout.nb_channels, clock.speed)
        else:
            self._changed = Resampled(self._rate, source.layout, clock.speed)
        self._begin: Fraction | None = None  # input time of the first sample that is taken
        self._received = self._written = 0

    def take(self, packet: Packet[AudioStream] | None) -> Iterator[Packet[AudioStream]]:
        """The packets that are ready once `packet` is there; None: the rest."""
        with contextlib.suppress(EOFError):
            for samples, time in self._decoded(packet):
                for part in self._placed(samples, time):
                    yield from self._encode(self._changed.add(part))
        if packet is None:
            yield from self._encode(self._changed.rest())
            yield from self._into.encode(None)

    def _decoded(
        self, packet: Packet[AudioStream] | None
    ) -> Iterator[tuple[np.ndarray, Fraction | None]]:
        """Samples, (channels, count) float32, and when they begin [s]."""
        try:
            frames = self._source.decode(packet)
        except FFmpegError as error:
            if isinstance(error, EOFError):
                raise
            return  # damaged: the gap is filled with silence
        for frame in frames:
            time = None if frame.pts is None else frame.pts * cast(Fraction, frame.time_base)
            frame.pts = None
            for made in self._fltp.resample(frame):
                yield made.to_ndarray(), time
                time = None

    def _placed(self, samples: np.ndarray, time: Fraction | None) -> Iterator[np.ndarray]:
        """The samples that lie within the clock's part, and silence before them for a gap."""
        if self._begin is None:
            first = self._clock.first
            audible = self._clock.back(Fraction(0)) if first is None else first
            self._begin = max(time or Fraction(0), audible)
        if time is not None:
            ahead = round((time - self._begin) * self._rate) - self._received
            if ahead < 0 and (self._received == 0 or ahead < -_GAP * self._rate):
                samples = samples[:, -ahead:]
            elif ahead > _GAP * self._rate:
                yield from self._within(np.zeros((len(samples), ahead), np.float32))
        yield from self._within(samples)

    def _within(self, samples: np.ndarray) -> Iterator[np.ndarray]:
        """Without the samples after the clock's end."""
        count = samples.shape[1]
        if self._clock.end is not None and self._begin is not None:
            left = round((self._clock.end - self._begin) * self._rate) - self._received
            count = max(min(count, left), 0)
        self._received += count
        for at in range(0, count, self._rate):  # a long gap a second at a time
            yield samples[:, at : min(at + self._rate, count)]

    def _encode(self, samples: np.ndarray) -> Iterator[Packet[AudioStream]]:
        if not samples.shape[1] or self._begin is None:
            return
        frame = av.AudioFrame.from_ndarray(
            np.ascontiguousarray(samples, np.float32), "fltp", self._source.layout.name
        )
        frame.sample_rate, frame.time_base = self._rate, Fraction(1, self._rate)
        frame.pts = round(self._clock.out(self._begin) * self._rate) + self._written
        self._written += samples.shape[1]
        yield from self._into.encode(frame)


class Resampled:
    """Sound that is resampled: its pitch follows its speed. The same words as Stretch."""

    def __init__(self, rate: int, layout: AudioLayout, speed: Fraction):
        # As if its rate were k p, made k q: exactly p / q as fast, whatever the speed.
        times = max(round(rate / speed.denominator), 1)
        slow, fast = times * speed.numerator, times * speed.denominator
        graph = Graph()
        source = graph.add_abuffer(
            sample_rate=slow, format="fltp", layout=layout, time_base=Fraction(1, slow)
        )
        resample = graph.add("aresample", str(fast))
        source.link_to(resample)
        resample.link_to(graph.add("abuffersink"))
        graph.configure()
        self._graph, self._rate, self._layout, self._received = graph, slow, layout.name, 0

    def add(self, samples: np.ndarray) -> np.ndarray:
        """Take in samples; return those that are ready."""
        data = np.ascontiguousarray(samples, np.float32)
        frame = av.AudioFrame.from_ndarray(data, "fltp", self._layout)
        frame.sample_rate, frame.time_base = self._rate, Fraction(1, self._rate)
        frame.pts = self._received
        self._received += samples.shape[1]
        self._graph.push(frame)
        return self._pulled(len(samples))

    def rest(self) -> np.ndarray:
        """Return the remaining samples; nothing can be added then."""
        if not self._received:
            return np.zeros((1, 0), np.float32)
        self._graph.push(None)
        return self._pulled(1)

    def _pulled(self, channels: int) -> np.ndarray:
        found: list[np.ndarray] = []
        with contextlib.suppress(BlockingIOError, EOFError):
            while True:
                found.append(cast(av.AudioFrame, self._graph.pull()).to_ndarray())
        return np.concatenate(found, 1) if found else np.zeros((channels, 0), np.float32)


def encoder(source: AudioStream, container: OutputContainer) -> AudioStream:
    """A stream like `source` that encodes; AAC (in WebM Opus) where its own codec has no encoder.

    Raises ValueError if the container holds neither.
    """
    name = source.codec_context.name
    wanted = _ENCODERS.get(name, name if name.startswith(_SAME) else "")
    fallback = _BY_DEFAULT.get(container.format.name, "aac")
    for choice in dict.fromkeys((wanted, fallback)):
        with contextlib.suppress(ValueError, UnknownCodecError):
            if choice:
                return _added(source, container, choice)
    raise ValueError(f"{container.format.name} holds neither {wanted} nor {fallback}")


def _added(source: AudioStream, container: OutputContainer, name: str) -> AudioStream:
    rates = av.Codec(name, "w").audio_rates
    rate = source.rate if not rates or source.rate in rates else max(rates)
    stream = cast(AudioStream, container.add_stream(name, rate=rate))
    stream.layout = source.layout
    if not name.startswith(("pcm_", "flac", "alac")):
        stream.bit_rate = max(source.bit_rate or 0, _PER_CHANNEL * source.layout.nb_channels)
    return stream
