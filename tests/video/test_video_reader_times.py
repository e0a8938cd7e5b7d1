"""The times of a video are read as they are, and its rate is told by them."""

import struct
from array import array
from fractions import Fraction
from types import SimpleNamespace

import av
import numpy as np
import pytest
from av.sidedata.sidedata import Type

import make_clips as clips
from wgmb.settings.video import VideoSettings
from wgmb.video.output_times import OutputFrames
from wgmb.video.read.decoder import decoded
from wgmb.video.read.packets import completed
from wgmb.video.read.reader import VideoReader
from wgmb.video.read.timeline import Timeline, Times
from wgmb.video.write.container import kept_scheduling

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


def test_times_that_keep_no_rate_are_exact_as_they_are(tmp_path):
    times = [Fraction(n + (n > 5), 24) for n in range(12)]  # a pause
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(12)]
    reader = VideoReader(clips.write(tmp_path / "c.mkv", frames, times))
    assert float(reader.exact_times[7]) == pytest.approx(8 / 24)
    times[6] -= Fraction(1, 96)
    reader = VideoReader(clips.write(tmp_path / "d.mkv", frames, times))
    assert list(reader.exact_times) == list(reader.times)


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
    assert list(reader.exact_times) == [n / Fraction(rate) for n in range(count)]


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
        opaque = None

        def __init__(self, size):
            self.size = size

    class Stream:
        codec_context = SimpleNamespace(name="h264", extradata=None)

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


def raw(path, kind, codec, rate, **more):
    """24 frames as packets alone, without a container."""
    size = (176, 144)
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    frames = [clips.frame(clips.planes(n, size), pixels) for n in range(24)]
    rate = Fraction(rate)
    with kept_scheduling():
        return clips.write(path, frames, codec=codec, pixels=pixels, kind=kind, rate=rate, **more)


@pytest.mark.parametrize("rate", ["24000/1001", "12", "25", "60"])
@pytest.mark.parametrize(
    ("kind", "codec"),
    [("h264", "libx264"), ("hevc", "libx265"), ("mpeg2video", "mpeg2video"), ("ivf", "libsvtav1")],
)
def test_pictures_without_a_container_have_the_rate_of_their_header(tmp_path, kind, codec, rate):
    reader = VideoReader(raw(tmp_path / "c.bin", kind, codec, rate, tick=1 / Fraction(rate)))
    assert reader.rate == Fraction(rate)
    assert list(reader.times) == [reader.times[0] + n / Fraction(rate) for n in range(24)]
    assert reader.until - reader.times[0] == 24 / Fraction(rate)
    assert not any("assumed" in note and "a second" in note for note in reader.notes)


def test_raw_h263_has_one_rate(tmp_path):
    """FFmpeg makes the first step before it knows the rate."""
    reader = VideoReader(raw(tmp_path / "c.h263", "h263", "h263", "25", tick=Fraction(1, 25)))
    assert reader.rate == Fraction(30000, 1001)
    assert not reader.is_variable


@pytest.mark.parametrize(
    ("kind", "codec", "options"),
    [("hevc", "libx265", {"x265-params": "log-level=none:vui-timing-info=0"}),
     ("obu", "libsvtav1", None), ("mjpeg", "mjpeg", None)],
)  # fmt: skip
def test_a_rate_that_no_header_states_is_assumed_and_said(tmp_path, kind, codec, options):
    reader = VideoReader(raw(tmp_path / "c.bin", kind, codec, "60", options=options))
    assert reader.rate == 25
    said = "does not say when its pictures are shown: 25 a second assumed"
    assert said in reader.notes


def test_a_cut_by_stream_copy_keeps_the_times_that_are_there(tmp_path):
    """FFmpeg's reader of Matroska gives no times below zero."""
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(40)]
    times = [Fraction(n - 13, 60) for n in range(40)]
    options = {"bf": "3", "qp": "0", "b_strategy": "0", "g": "99"}
    path = clips.write(tmp_path / "c.mkv", frames, times, rate=Fraction(60), options=options,
                       muxing={"avoid_negative_ts": "disabled"})  # fmt: skip
    with av.open(str(path)) as container:
        assert sum(p.pts is None for p in container.demux(video=0) if p.size) == 13
    reader = VideoReader(path)
    assert [float(t) for t in reader.times] == pytest.approx([float(t) for t in times], abs=1e-3)
    assert reader.rate == 60
    assert not any("assumed" in note and "a second" in note for note in reader.notes)
    assert shown(reader) == list(range(40))
    assert shown(reader, 20, 25) == list(range(20, 26))


def test_times_that_are_missing_fill_the_gaps():
    """An even count of pictures in a gap; then those at the end."""

    class Found:
        untimed, count = array("q", [3, 4, 8]), 9

    shown = np.array([0, 100, 200, 500, 600, 700], np.int64)
    assert list(completed(shown, Found(), 100.0)) == [100 * n for n in range(9)]


@pytest.mark.parametrize("suffix", [".mp4", ".mov"])
def test_the_last_picture_of_a_screen_recording_lasts_as_the_file_says(tmp_path, suffix):
    times = [Fraction(n, 60) for n in (0, 1, 3, 4, 7, 30, 31, 40)]
    path = tmp_path / f"c{suffix}"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=60, options={"bf": "0", "qp": "0"})
        stream.width, stream.height, stream.pix_fmt = clips.WIDTH, clips.HEIGHT, "yuv420p"
        stream.codec_context.time_base = clips.TICK
        packets = []
        for n, time in enumerate(times):
            frame = clips.frame(clips.planes(n), "yuv420p")
            frame.pts, frame.time_base = round(time / clips.TICK), clips.TICK
            packets += stream.encode(frame)
        packets += stream.encode(None)
        packets[-1].duration = round(Fraction(3, 2) / packets[-1].time_base)
        out.mux(packets)
    reader = VideoReader(path)
    assert float(reader.duration) == pytest.approx(40 / 60 + 1.5, abs=1e-3)
    clock = VideoSettings().clock(reader, None)
    assert len(OutputFrames(reader, clock, Fraction(60))) == 130
    own = OutputFrames(reader, clock, None)
    assert len(own) == 9 and own[8].time + 1 / reader.rate == pytest.approx(reader.until)
