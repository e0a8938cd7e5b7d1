"""The times of a video are read as they are, and its rate is told by them."""

import struct
from fractions import Fraction

import av
import numpy as np
import pytest
from av.sidedata.sidedata import Type

import make_clips as clips
from wgmb.video.read.decoder import decoded
from wgmb.video.read.reader import VideoReader
from wgmb.video.read.timeline import Timeline, Times

pytestmark = pytest.mark.fast


def shown(reader: VideoReader, *which) -> list[int]:
    """The numbers of the pictures, told by their levels, which repeat after 6."""
    found = []
    for number, picture in reader.pictures(*which):
        level = float(np.median(picture.planes[0])) - 5  # in the middle of the ramp
        assert abs(level - clips.level(number)) < 12
        found.append(number)
    return found


@pytest.mark.parametrize("kind", ["mp4", "mkv", "mov", "avi", "ts"])
@pytest.mark.parametrize("late", [0, 0.523])
def test_times_are_those_in_the_file(tmp_path, kind, late):
    late = 0 if kind == "avi" else late  # which has no times
    tick = Fraction(1, clips.RATE) if kind == "avi" else clips.TICK
    path = clips.write(tmp_path / f"c.{kind}", tone=0.5, late=late, tick=tick)
    reader = VideoReader(path)
    with av.open(str(path)) as container:
        first = next(container.decode(audio=0))
        sound = first.pts * first.time_base
    assert len(reader) == 12
    assert reader.rate == 24
    assert not reader.is_variable
    steady = [float(t - reader.times[0]) for t in reader.times]
    assert steady == pytest.approx([n / 24 for n in range(12)], abs=0.0011)
    if kind != "avi":
        assert float(reader.times[0] - sound) == pytest.approx(
            late + (1024 / 48000 if kind == "ts" else 0), abs=0.0015
        )
    assert shown(reader) == list(range(12))


@pytest.mark.parametrize("kind", ["mp4", "mkv"])
def test_a_variable_rate_is_seen_in_the_times_alone(tmp_path, kind):
    times = [Fraction(n, 60) for n in (0, 1, 3, 4, 7, 8, 9, 10, 13, 14, 15, 16)]
    reader = VideoReader(clips.write(tmp_path / f"c.{kind}", times=times))
    assert reader.is_variable
    assert reader.rate == 60
    assert [float(t) for t in reader.times] == pytest.approx([float(t) for t in times], abs=6e-4)
    assert reader.steps == pytest.approx((1 / 60, 3 / 60), abs=0.001)
    assert shown(reader) == list(range(12))


@pytest.mark.parametrize(
    ("rate", "want"),
    [("24000/1001", "24000/1001"), ("29.97", "30000/1001"), ("144", "144"), ("240", "240"),
     ("37", "37")],
)  # fmt: skip
def test_a_rate_that_is_rounded_to_milliseconds_is_known_again(tmp_path, rate, want):
    times = [n / Fraction(rate) for n in range(40)]
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(40)]
    reader = VideoReader(clips.write(tmp_path / "c.mkv", frames, times))
    assert float(reader.rate) == pytest.approx(float(Fraction(want)), rel=2e-4)
    assert want == "37" or reader.rate == Fraction(want)
    assert not reader.is_variable


@pytest.mark.parametrize("rate", ["30", "30000/1001", "60000/1001", "120000/1001"])
@pytest.mark.parametrize("count", [3, 8, 44])
def test_a_few_times_of_milliseconds_have_the_rate_that_the_file_states(tmp_path, rate, count):
    """Rounded, those of 29.97 and 30 are the same for long."""
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(count)]
    path = clips.write(tmp_path / "c.mkv", frames, rate=Fraction(rate))
    with av.open(str(path)) as container:
        assert container.streams.video[0].time_base == Fraction(1, 1000)
    reader = VideoReader(path)
    assert reader.rate == Fraction(rate) and not reader.is_variable


def test_a_rate_that_the_times_do_not_keep_is_not_believed(tmp_path):
    """Matroska states one whatever the times are."""
    times = [Fraction(n, 24) for n in range(20)]
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(20)]
    path = clips.write(tmp_path / "c.mkv", frames, times, rate=Fraction(60))
    with av.open(str(path)) as container:
        assert container.streams.video[0].average_rate == 60
    assert VideoReader(path).rate == 24


def test_steps_of_two_lengths_alone_have_a_rate():
    """RealVideo 2: the middle of the lengths is near to neither."""
    ticks = np.array([1, 82, 83, 164, 165], np.int64)
    timeline = Timeline(
        Times(ticks, Fraction(1, 1000)), ticks[:1], False, False, Fraction(1), ""
    )  # fmt: skip
    assert timeline.rate == pytest.approx(4 / 0.164, rel=0.001)
    assert timeline.is_variable


@pytest.mark.parametrize(
    ("suffix", "keys"), [(".mkv", 0), (".mp4", 1)], ids=["VC-1 and RealVideo", "CAVS"]
)
def test_pictures_whose_times_are_those_of_decoding_are_counted(tmp_path, suffix, keys):
    """B-frames come before, with later times. `keys`: by how much those of key frames are later."""
    options = {"bf": "2", "b_strategy": "0", "qp": "8", "g": "12"}
    plain = clips.write(tmp_path / "in.mp4", options=options)
    path = tmp_path / f"c{suffix}"
    with av.open(str(plain)) as source, av.open(str(path), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0], opaque=True)
        for n, packet in enumerate(p for p in source.demux() if p.size):
            packet.stream, packet.time_base = stream, Fraction(1, 24)
            packet.pts = packet.dts = n
            packet.pts += keys if packet.is_keyframe else 0
            target.mux_one(packet)
    with av.open(str(path)) as container:
        raw = [frame.pts for frame in container.decode(video=0)]
    assert raw != sorted(raw)
    reader, wanted = VideoReader(path), VideoReader(plain)
    assert shown(reader) == shown(wanted)
    assert reader.loss() == ""
    assert reader.rate == 24


@pytest.mark.parametrize(
    ("profile", "full_range", "want"),
    [(0, 1, "its colours come out wrong"), (1, 0, "those of its base layer"),
     (0, 0, "those of its base layer")],
)  # fmt: skip
def test_dolby_vision_without_a_base_layer_is_said(
    tmp_path, monkeypatch, profile, full_range, want
):
    """The header as FFmpeg has it: of three offsets first, then two kinds, the profile, ..."""
    header = struct.pack("=BxHBBBBBBB", 2, 18, profile, 0, 0, 0, 23, 1, full_range)
    data = struct.pack("=3Q", 48, 0, 0).ljust(48, b"\0") + header
    monkeypatch.setattr(
        "wgmb.video.read.reader.side_data_of", lambda frame: {Type.DOVI_METADATA: data}
    )
    assert any(want in note for note in VideoReader(clips.write(tmp_path / "c.mp4")).notes)


def test_packets_without_data_do_not_end_a_stream():
    """PMP has them for pictures that repeat the one before."""

    class Packet:
        def __init__(self, size):
            self.size = size

    class Stream:
        def decode(self, packet):
            return [packet.size] if packet is not None else ["the end"]

    class Container:
        def demux(self, stream):
            return iter([Packet(3), Packet(0), Packet(5), Packet(0)])

    assert list(decoded(Container(), Stream())) == [3, 5, "the end"]


def test_what_an_edit_list_leaves_out_is_left_out(tmp_path):
    """Three frames lie before the beginning that the file states."""
    times = [Fraction(n - 3, 24) for n in range(12)]
    path = clips.write(tmp_path / "c.mp4", times=times, options={"bf": "0", "qp": "0", "g": "30"},
                       muxing={"use_editlist": "1", "avoid_negative_ts": "disabled"})  # fmt: skip
    with av.open(str(path)) as container:
        assert container.streams.video[0].frames == 12
    reader = VideoReader(path)
    assert len(reader) == 9
    assert reader.times[0] == 0
    levels = [float(np.median(p.planes[0])) for _, p in reader.pictures()]
    assert [round(level - 5) for level in levels] == pytest.approx(
        [clips.level(n) for n in range(3, 12)], abs=8
    )


@pytest.mark.parametrize("kind", ["mp4", "mkv", "ts"])
@pytest.mark.parametrize("g", ["4", "250"])
def test_pictures_from_the_middle_are_those_of_a_whole_pass(tmp_path, kind, g):
    """With B-frames and open groups, whose first pictures build on the group before."""
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(30)]
    options = {"g": g, "bf": "3", "x264-params": "open-gop=1:keyint-min=1:scenecut=0", "qp": "8"}
    reader = VideoReader(clips.write(tmp_path / f"c.{kind}", frames, options=options))
    whole = dict(reader)
    for first in (0, 3, 4, 11, 17, 29):
        part = dict(reader.pictures(first, first + 2))
        assert list(part) == [n for n in range(first, first + 3) if n < 30]
        for number, picture in part.items():
            for a, b in zip(picture.planes, whole[number].planes, strict=True):
                assert np.array_equal(a, b), number
    assert reader.loss() == ""
