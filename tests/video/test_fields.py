"""H.264 of fields that are pictures of their own (PAFF): two are one frame, in any container."""

from fractions import Fraction

import av
import numpy as np
import pytest

import make_clips as clips
from wgmb.video.read import fields
from wgmb.video.read.reader import VideoReader

COUNT, SPEED = 8, 4  # frames; pixels a frame
WIDTH, HEIGHT = 64, 32


class Bits:
    """A unit of H.264, bit by bit."""

    def __init__(self):
        self.bits: list[int] = []

    def put(self, *numbers: tuple[int, int]) -> "Bits":
        for count, value in numbers:
            self.bits += [value >> (count - 1 - n) & 1 for n in range(count)]
        return self

    def codes(self, *numbers: int) -> "Bits":
        """In Exp-Golomb."""
        for number in numbers:
            length = (number + 1).bit_length()
            self.put((length - 1, 0), (length, number + 1))
        return self

    def samples(self, plane: np.ndarray) -> None:
        self.bits += [0] * (-len(self.bits) % 8)
        self.bits += np.unpackbits(np.ascontiguousarray(plane)).tolist()

    def unit(self, head: int) -> bytes:
        bits = [*self.bits, 1]
        data = np.packbits(np.array(bits, np.uint8)).tobytes()
        out = bytearray()
        for byte in data:
            if byte <= 3 and out[-2:] == b"\0\0":
                out.append(3)
            out.append(byte)
        return bytes([head]) + bytes(out)


def headers() -> list[bytes]:
    """The parameters of a sequence of fields and of its pictures; no prediction."""
    sequence = Bits().put((8, 77), (8, 0), (8, 30)).codes(0, 0, 0, 4, 1).put((1, 0))
    sequence.codes(WIDTH // 16 - 1, HEIGHT // 32 - 1).put((2, 0), (1, 1), (2, 0))
    picture = Bits().codes(0, 0).put((2, 0)).codes(0, 0, 0).put((3, 0)).codes(0, 0, 0)
    return [sequence.unit(0x67), picture.put((3, 4)).unit(0x68)]


def field(luma: np.ndarray, number: int, parity: int, is_second: bool) -> bytes:
    """A field of plain samples (I_PCM)."""
    begins = number == 0 and not is_second
    bits = Bits().codes(0, 7, 0).put((4, number % 16), (1, 1), (1, parity))
    bits.codes(*[0] * begins).put((8, 2 * number + is_second), (1 + begins, 0)).codes(0, 1)
    for x in range(0, WIDTH, 16):
        bits.codes(25)
        bits.samples(luma[:, x : x + 16])
        for _ in range(2):
            bits.samples(np.full((8, 8), 128, np.uint8))
    return bits.unit(0x65 if begins else 0x21)


def frames(first: int) -> list[list[bytes]]:
    """The units of each frame: a bar that goes right from field to field, of which one is first."""
    made = []
    for n in range(COUNT):
        units = headers() if n == 0 else []
        for second, parity in enumerate((first, 1 - first)):
            luma = np.full((HEIGHT // 2, WIDTH), 60, np.uint8)
            begin = 8 + SPEED * n + SPEED // 2 * second
            luma[:, begin : begin + 12] = 200
            units.append(field(luma, n, parity, bool(second)))
        made.append(units)
    return made


def coded(units: list[bytes]) -> bytes:
    return b"".join(b"\0\0\0\1" + unit for unit in units)


def written(folder, kind: str, first: int, are_apart: bool):
    """A file whose packets are frames, or, `are_apart`, fields with times of their own."""
    made = frames(first)
    raw = folder / "raw.h264"
    raw.write_bytes(b"".join(map(coded, made)))
    if kind == "h264":
        return raw
    path = folder / f"a.{kind}"
    with av.open(str(raw)) as source, av.open(str(path), "w") as to:
        stream = to.add_stream_from_template(source.streams.video[0])
        stream.time_base = Fraction(1, 90000)
        for n, units in enumerate(made):
            parts = [units[:-1], units[-1:]] if are_apart else [units]
            for k, part in enumerate(parts):
                packet = av.Packet(coded(part))
                packet.stream, packet.time_base = stream, Fraction(1, 90000)
                packet.pts = packet.dts = 3600 * n + 1800 * k
                packet.duration, packet.is_keyframe = 3600 // len(parts), n == 0 and not k
                to.mux(packet)
    return path


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize(
    ("kind", "are_apart"),
    [("h264", False), ("ts", False), ("ts", True), ("mkv", False), ("mkv", True), ("mp4", True)],
)
def test_two_fields_are_one_frame(tmp_path, kind, are_apart, first):
    """Each field was counted as a frame, and half of the pictures could not be decoded."""
    reader = VideoReader(written(tmp_path, kind, first, are_apart))
    assert reader.is_interlaced and len(reader) == 2 * COUNT and reader.rate == 50
    light = [np.clip(p.planes[0].astype(float) - 120, 0, None).mean(0) for _, p in reader]
    at = [float((row * np.arange(WIDTH)).sum() / row.sum()) for row in light]
    np.testing.assert_allclose(np.diff(at), SPEED / 2, atol=0.1)
    assert reader.loss() == "" and not any("left out" in note for note in reader.notes)


@pytest.mark.parametrize("options", ["interlaced=1:tff=1", "interlaced=1:cqm=jvt", "keyint=4"])
@pytest.mark.parametrize("kind", ["h264", "mp4", "ts"])
def test_frames_are_no_fields(tmp_path, options, kind):
    path = clips.write(tmp_path / f"a.{kind}", options={"x264-params": options})
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        hides = fields.SecondFields(stream.codec_context.extradata or b"")
        packets = [memoryview(p) for p in file.demux(stream) if p.size]
        assert len(packets) == 12 and not any(map(hides, packets))
        known = hides._parameters
    assert known is not None and known.has_fields == ("interlaced" in options)


def test_units_of_any_bytes_are_read():
    rng = np.random.default_rng(0)
    hides = fields.SecondFields(b"")
    for _ in range(300):
        noise = rng.integers(0, 256, int(rng.integers(0, 40)), dtype=np.uint8).tobytes()
        for head in (b"\0\0\1\x67\x64", b"\0\0\1\x41", b"\0\0\1"):
            hides(memoryview(head + noise))
        fields.SecondFields(b"\1\x64\0\x1e\xff\xe1\0\x20\x67" + noise)
