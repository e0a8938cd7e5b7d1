"""Facts in the packets of a stream of pictures, as they are read: when each picture is shown."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from av.packet import Packet

from ...io import limits
from .fields import SecondFields


def justified(packets: Iterable[Packet[Any]], path: Path) -> Iterator[Packet[Any]]:
    """The packets of a file; InputError once they are more than a file of its size can hold."""
    stored, read = path.stat().st_size, 0
    for count, packet in enumerate(packets):
        read += packet.size
        limits.check_packets(path, count, read, stored)
        yield packet


class PictureTimes:
    """Times in the packets of a stream of pictures [ticks of the stream's clock].

    `header`: the codec's own data.
    """

    def __init__(self, codec: str, header: bytes = b""):
        self.presented, self.decoded, self.keys = array("q"), array("q"), array("q")
        self.count = self.read = 0  # of pictures that are shown, of packets
        self.untimed = array("q")
        """Numbers, in the order of decoding, of pictures whose time is not stated."""
        self.ascends = True  # the time at which each is shown
        self.is_encrypted = False
        self._hides = SecondFields(header) if codec == "h264" else _HIDES.get(codec)
        self._durations = array("q")
        self._latest = self._last_shown = self._last_decoded = 0

    def add(self, packet: Packet[Any]) -> None:
        """Take note of a packet, unless an edit list leaves it out, or it shows nothing."""
        if not self.read:
            self.is_encrypted = packet.has_sidedata("encryption_info")
        self.read += 1
        if packet.is_discard or (self._hides is not None and self._hides(memoryview(packet))):
            return
        if packet.duration:
            self._durations.append(packet.duration)
            self._last_decoded = packet.duration
        if packet.pts is not None:
            self._add_shown(packet, packet.pts)
        else:
            self.untimed.append(self.count)
        if packet.dts is not None:
            self.decoded.append(packet.dts)
        self.count += 1

    def _add_shown(self, packet: Packet[Any], time: int) -> None:
        self.ascends = self.ascends and (not self.presented or time >= self.presented[-1])
        if not self.presented or time >= self._latest:
            self._latest, self._last_shown = time, packet.duration or 0
        self.presented.append(time)
        if packet.is_keyframe:
            self.keys.append(time)

    @property
    def are_of_each(self) -> bool:
        """Return True if the durations of packets differ: each is that of its picture."""
        return len(self._durations) > 1 and min(self._durations) < max(self._durations)

    @property
    def lasts(self) -> int:
        """The duration of the last picture [ticks]; in an MP4, of the last one that is decoded."""
        return max(self._last_shown, self._last_decoded)

    @property
    def step(self) -> int:
        """The usual duration of a packet [ticks]; 0 if packets do not state theirs."""
        return int(np.median(np.frombuffer(self._durations, np.int64))) if self._durations else 0


def completed(times: np.ndarray, packets: PictureTimes, step: float) -> np.ndarray:
    """The ascending times of all pictures [ticks], where packets state `times` of some alone.

    Pictures that are decoded before the first one that has a time go back from it by `step`. Others
    fill the gaps; those for which there is no gap go back too, or, if they are decoded late, go on
    at the end.
    """
    untimed = np.frombuffer(packets.untimed, np.int64)
    before = int((untimed == np.arange(len(untimed))).sum())
    untimed, parts = untimed[before:], [times]
    room = np.rint(np.diff(times) / step).astype(np.int64) - 1
    for number in np.flatnonzero(room > 0):
        if (count := min(int(room[number]), len(untimed))) > 0:
            parts.append(np.linspace(times[number], times[number + 1], count + 2)[1:-1])
            untimed = untimed[count:]
    early = int((untimed < packets.count / 2).sum())
    parts.append(times[0] - step * np.arange(1, before + early + 1))
    parts.append(times[-1] + step * np.arange(1, len(untimed) - early + 1))
    return np.sort(np.rint(np.concatenate(parts)).astype(np.int64))


def _hides_vp8(data: memoryview) -> bool:
    """Return True for a frame that only others build on (RFC 6386, section 9.1)."""
    return not data[0] >> 4 & 1


def _hides_vp9(data: memoryview) -> bool:
    """Return True for such a frame (VP9 bitstream specification, 6.2), if it is alone."""
    bits = data[0] << (1 if data[0] >> 4 & 3 == 3 else 0)  # profile 3 has one bit more
    shows = bits >> 3 & 1 or bits >> 1 & 1
    return not shows and data[-1] & 0xE0 != 0xC0  # the end of several frames in one packet


def _hides_gif(data: memoryview) -> bool:
    """Return True for blocks behind the last picture, such as a comment (GIF89a, 24)."""
    at = 0
    while data[at : at + 1] == b"!":  # an extension, whose blocks tell their lengths
        at += 2
        while at < len(data) and data[at]:
            at += 1 + data[at]
        at += 1
    return data[at : at + 1] != b"," and data[:3] != b"GIF"


_HIDES = {"gif": _hides_gif, "vp8": _hides_vp8, "vp9": _hides_vp9}
