"""Decode the pictures of a video, from any of them on, each with its number."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.container import InputContainer
from av.error import EOFError, FFmpegError
from av.video.stream import VideoStream

from . import damage
from .container import opened
from .timeline import Timeline

REORDERED = 12  # pictures that are looked at to tell times of decoding from times of showing


class Decoder:
    """Decodes one stream of a file, whose pictures are shown at the times of a Timeline."""

    def __init__(self, path: Path, index: int, timeline: Timeline, max_mb: float):
        self._path, self._index, self._timeline, self._max_mb = path, index, timeline, max_mb

    def frames(self, first: int) -> Iterator[tuple[int, av.VideoFrame]]:
        """Frames and their numbers, which ascend, from one at or before `first` on.

        Frames that cannot be decoded are left out. Several threads decode until there is an error,
        because they lose undamaged pictures, too; then one does. Frames are counted from where
        their times turn out to be those of decoding. Others may be asked for meanwhile, in other
        threads.
        """
        last, careful = -1, False
        while True:
            try:
                for number, frame in self._begun(max(last + 1, first), careful):
                    if number > last:
                        last = number
                        yield number, frame
                return
            except _DamagedError:
                careful = True
            except _DecodingTimesError as error:
                self._timeline = error.counted

    def _begun(self, first: int, careful: bool) -> Iterator[tuple[int, av.VideoFrame]]:
        """Frames from the last key frame on that leads to `first`."""
        if first >= len(self._timeline.times):
            return
        for key in [*self._keys_before(first), None]:
            with opened(self._path, self._max_mb, is_known=True) as container:
                stream = cast(VideoStream, container.streams[self._index])
                stream.thread_type = "SLICE" if careful else "AUTO"
                if key is not None:
                    with contextlib.suppress(FFmpegError):
                        container.seek(key, stream=stream)
                frames = self._numbered(decoded(container, stream, key, careful))
                begin = next(frames, None)
                if key is not None and (begin is None or begin[0] > first):
                    continue  # it went too far: some formats are sought by guessing
                if begin is not None:
                    yield begin
                    yield from frames
                return

    def _keys_before(self, first: int) -> list[int]:
        """Ticks at which to begin decoding, the nearest first, if not at the beginning."""
        if self._timeline.in_order:
            return []
        tick = self._timeline.times.ticks[first]
        last = int(np.searchsorted(self._timeline.keys, tick, side="right")) - 1
        return [int(self._timeline.keys[n]) for n in (last, last - 1, last - 4) if n > 0]

    def _numbered(self, frames: Iterator[av.VideoFrame]) -> Iterator[tuple[int, av.VideoFrame]]:
        ticks, before = self._timeline.times.ticks, -1
        for frame in frames:
            number = before + 1
            if not self._timeline.in_order and frame.pts is not None:
                number = int(np.searchsorted(ticks, frame.pts))
                if number == len(ticks) or ticks[number] != frame.pts:
                    continue  # what edits leave out
                if number > before + 1 >= 1:
                    frames = self._checked(frame, frames)
            if before < number < len(ticks):
                before = number
                yield number, frame

    def _checked(
        self, frame: av.VideoFrame, frames: Iterator[av.VideoFrame]
    ) -> Iterator[av.VideoFrame]:
        """The same frames after one that left out a time: some are lost, or all have another order.

        The latter as in VC-1 and RealVideo, or where a program gave times of decoding only.
        """
        counted = self._timeline.counted
        if counted is None or len(counted.times) != len(self._timeline.times):
            return frames
        ahead = list(islice(frames, REORDERED))
        shown = [one.pts for one in (frame, *ahead) if one.pts is not None]
        if shown != sorted(shown):
            raise _DecodingTimesError(counted)
        return chain(ahead, frames)


def decoded(
    container: InputContainer, stream: VideoStream, key: int | None = None, careful: bool = True
) -> Iterator[av.VideoFrame]:
    """All frames that can be decoded; from the key frame at the tick `key` or one before on.

    Not `careful`: _DamagedError where one cannot be, and where a checksum is wrong.
    """
    waiting = key is not None
    packets = damage.marked(container.demux(stream), stream.codec_context)
    while True:
        try:
            packet = next(packets, None)
        except FFmpegError:  # said by the Timeline
            packet = None
        if waiting and packet is not None:
            if not packet.is_keyframe or packet.pts is None:
                continue
            if key is not None and packet.pts > key:
                return
            waiting = False
        if packet is not None and not packet.size:
            continue  # a repeated picture (PMP), or PyAV's sign of the end, after which comes None
        if packet is not None and packet.opaque is not None and not careful:
            raise _DamagedError
        try:
            yield from stream.decode(packet)
        except EOFError:
            return
        except FFmpegError:
            if not careful:
                raise _DamagedError from None
        if packet is None:
            return


class _DamagedError(Exception):
    """A frame could not be decoded, or is damaged."""


class _DecodingTimesError(Exception):
    """Frames have the times of their decoding; they are to be counted."""

    def __init__(self, counted: Timeline):
        super().__init__()
        self.counted = counted
