"""Videos are read as they are: every sample, every time, what colours mean, which way is up."""

import struct
from fractions import Fraction

import av
import numpy as np
import pytest
from av.sidedata.sidedata import Type
from av.video.reformatter import VideoReformatter
from PIL import Image

import make_clips as clips
from wgmb import InputError
from wgmb.cli.video_lines import describe_video
from wgmb.coding import Coding
from wgmb.io.container import picture_stream
from wgmb.io.decoding import decoded
from wgmb.io.footage import Footage
from wgmb.io.pixels import frame_of, layout, pixel_format, planes_of
from wgmb.io.timeline import Timeline, Times

pytestmark = pytest.mark.fast


def shown(footage: Footage, *which) -> list[int]:
    """The numbers of the pictures, told by their levels, which repeat after 6."""
    found = []
    for number, picture in footage.pictures(*which):
        level = float(np.median(picture.planes[0])) - 5  # in the middle of the ramp
        assert abs(level - clips.level(number)) < 12
        found.append(number)
    return found


# ---- samples --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("codec", "pixels", "want"),
    [
        ("libx264", "yuv420p", Coding(bits=8, steps=(2, 2))),
        ("libx264", "yuvj420p", Coding(bits=8, steps=(2, 2), full_range=True)),
        ("libx264", "yuv422p10le", Coding(bits=10, steps=(2, 1))),
        ("libx264", "yuv444p", Coding(bits=8, steps=(1, 1))),
        ("libx265", "yuv420p10le", Coding(bits=10, steps=(2, 2))),
        ("libx265", "yuv444p12le", Coding(bits=12, steps=(1, 1))),
        ("ffv1", "yuva444p16le", Coding(bits=16, steps=(1, 1), alpha=True)),
        ("ffv1", "yuv411p", Coding(bits=8, steps=(4, 1))),
    ],
)
def test_every_sample_is_the_one_that_was_stored(tmp_path, codec, pixels, want):
    alpha, bits = want.alpha, want.bits
    data = [clips.planes(n, steps=want.steps, bits=bits, alpha=alpha) for n in range(3)]
    tags = (2 if want.full_range else 1, 1, 1, 1)
    path = clips.write(tmp_path / "c.mkv", [clips.frame(d, pixels) for d in data], codec=codec,
                       pixels=pixels, tags=tags)  # fmt: skip
    footage = Footage(path)
    assert footage.coding == want
    assert footage.assumed == ()
    for (number, picture), stored in zip(list(footage), data, strict=True):
        assert picture.size == (clips.WIDTH, clips.HEIGHT) == footage.size
        for plane, samples in zip(picture.planes, stored, strict=True):
            assert not plane.flags.writeable
            assert plane.dtype == samples.dtype
            assert np.array_equal(plane, samples), number


@pytest.mark.parametrize(
    ("pixels", "codec", "model", "alpha"),
    [("rgb24", "png", "rgb", False), ("rgba", "png", "rgb", True), ("pal8", "png", "rgb", False),
     ("rgb48be", "png", "rgb", False), ("bgr0", "ffv1", "rgb", False),
     ("gray", "ffv1", "grey", False), ("gray16le", "ffv1", "grey", False)],
)  # fmt: skip
def test_pixels_that_are_not_planes_are_sorted_into_them(tmp_path, pixels, codec, model, alpha):
    made = av.VideoFrame(64, 48, pixels)
    rng = np.random.default_rng(5)
    for plane in made.planes:
        np.frombuffer(plane, np.uint8)[:] = rng.integers(0, 256, plane.buffer_size, np.uint8)
    if pixels == "pal8":
        np.frombuffer(made.planes[1], np.uint8)[3::4] = 255
    if model == "grey":
        want = made
    else:  # packed formats of one depth are turned into each other exactly
        want = made.reformat(format="rgba64le" if "48" in pixels else "rgba")
    path = clips.write(
        tmp_path / ("c.mov" if codec == "png" else "c.mkv"), [made], codec=codec, pixels=pixels
    )
    footage = Footage(path)
    ((_, picture),) = footage
    coding = footage.coding
    assert (coding.model, coding.alpha, coding.full_range) == (model, alpha, True)
    kind = np.uint8 if coding.bits == 8 else np.dtype("<u2")
    per = 1 if model == "grey" else 4
    rows = np.frombuffer(want.planes[0], kind).reshape(48, -1)
    stored = rows[:, : 64 * per].reshape(48, 64, per)
    assert len(picture.planes) == (1 if model == "grey" else 3 + alpha)
    for n, plane in enumerate(picture.planes):
        assert np.array_equal(plane, stored[..., n])


@pytest.mark.parametrize(
    ("pixels", "bits"), [("nv12", 8), ("nv21", 8), ("p010le", 10), ("p210le", 10)]
)
def test_what_hardware_decodes_to_is_sorted_without_a_change(pixels, bits):
    rng = np.random.default_rng(1)
    kind, high = (np.uint8, 0) if bits == 8 else (np.uint16, 16 - bits)
    y = rng.integers(0, 1 << bits, (22, 38)).astype(kind)
    rows = 22 if pixels.startswith("p2") else 11
    u, v = rng.integers(0, 1 << bits, (2, rows, 19)).astype(kind)
    pair = (v, u) if pixels == "nv21" else (u, v)
    stored = clips.frame([y << high, np.stack(pair, -1) << high], pixels)
    for tag in (0, 1, 2):
        stored.color_range = tag
        into = layout(pixels)
        assert into is not None and into.bits == bits
        for got, want in zip(planes_of(stored, into, VideoReformatter()), (y, u, v), strict=True):
            assert np.array_equal(got, want)


PLANAR = [
    Coding("yuv", bits, steps, alpha)
    for bits in (8, 10, 12)
    for steps in ((2, 2), (2, 1), (1, 1))
    for alpha in (False, True)
    if (bits, steps, alpha) != (12, (2, 2), True)
] + [
    Coding(model, bits, (1, 1), alpha)
    for model, alpha in (("rgb", False), ("rgb", True), ("grey", False))
    for bits in (8, 10, 12)
]


@pytest.mark.parametrize("coding", PLANAR, ids=pixel_format)
def test_planes_become_a_frame_and_come_back(coding):
    model, bits, steps, alpha = coding.model, coding.bits, coding.steps, coding.alpha
    name = pixel_format(coding)
    rng = np.random.default_rng(2)
    luma = (25, 39)
    chroma = luma if model == "rgb" else (-(-25 // steps[1]), -(-39 // steps[0]))
    shapes = [luma] if model == "grey" else [luma, chroma, chroma] + [luma] * alpha
    kind = np.uint8 if bits == 8 else np.uint16
    planes = tuple(rng.integers(0, 1 << bits, shape).astype(kind) for shape in shapes)
    into = layout(name)
    assert into is not None
    for got, want in zip(
        planes_of(frame_of(planes, name), into, VideoReformatter()), planes, strict=True
    ):
        assert np.array_equal(got, want)


# ---- what colours mean ----------------------------------------------------------------------


def plain(size, pixels="yuv420p"):
    """One frame of mid grey."""
    made = av.VideoFrame(*size, pixels)
    for plane in made.planes:
        np.frombuffer(plane, np.uint8)[:] = 128
    return made


@pytest.mark.parametrize(
    ("size", "want"),
    [((1280, 32), (1, 1, 1)), ((64, 720), (1, 1, 1)), ((720, 480), (6, 1, 6)),
     ((720, 576), (6, 1, 5))],
)  # fmt: skip
def test_untagged_colours_go_by_the_size(tmp_path, size, want):
    footage = Footage(clips.write(tmp_path / "c.mp4", [plain(size)]))
    coding = footage.coding
    assert (coding.matrix, coding.transfer, coding.primaries) == want
    name = "BT.709" if want[0] == 1 else "BT.601"
    assert footage.assumed == (f"matrix {name}", "transfer BT.709", f"primaries {name}")
    assert any("does not state its colours: matrix BT" in note for note in footage.notes)


@pytest.mark.parametrize("kind", ["mp4", "mkv"])
@pytest.mark.parametrize("tags", [(1, 9, 16, 9), (1, 9, 18, 9), (2, 1, 13, 1), (1, 1, 1, 12)])
def test_colours_that_are_tagged_are_taken_as_tagged(tmp_path, kind, tags):
    frames = [clips.frame(clips.planes(n, bits=10), "yuv420p10le") for n in range(3)]
    path = clips.write(tmp_path / f"c.{kind}", frames, codec="libx265", pixels="yuv420p10le",
                       tags=tags)  # fmt: skip
    footage, coding = Footage(path), Footage(path).coding
    assert footage.assumed == ()
    assert coding.full_range == (tags[0] == 2)
    assert (coding.matrix, coding.transfer, coding.primaries) == tags[1:]


def test_the_display_that_an_hdr10_video_was_graded_on_is_read(tmp_path):
    options = {"x265-params": "log-level=none:max-cll=1000,400:master-display="
               "G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,1)"}  # fmt: skip
    frames = [clips.frame(clips.planes(n, bits=10), "yuv420p10le") for n in range(3)]
    footage = Footage(clips.write(tmp_path / "c.mp4", frames, codec="libx265",
                                  pixels="yuv420p10le", options=options))  # fmt: skip
    assert footage.mastering is not None and footage.light_level is not None
    assert footage.mastering.for_x265() in options["x265-params"]
    assert str(footage.light_level) == "1000,400"
    assert footage.mastering.luminance == (0.0001, 1000.0)
    said = dict(describe_video(footage))
    assert said["mastered"] == (
        "on a display of 0.0001 to 1000 cd/m2; "
        "red 0.680 0.320, green 0.265 0.690, blue 0.150 0.060, white 0.313 0.329"
    )
    assert said["light"] == (
        "brightest pixel 1000, brightest mean of a picture 400 cd/m2 (MaxCLL, MaxFALL)"
    )


def test_a_codec_has_its_own_name_not_that_of_a_decoder(tmp_path):
    path = clips.write(tmp_path / "c.mp4", codec="libsvtav1", options={"svtav1-params": "lp=1"})
    assert Footage(path).codec == "av1"


# ---- times ----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["mp4", "mkv", "mov", "avi", "ts"])
@pytest.mark.parametrize("late", [0, 0.523])
def test_times_are_those_in_the_file(tmp_path, kind, late):
    late = 0 if kind == "avi" else late  # which has no times
    tick = Fraction(1, clips.RATE) if kind == "avi" else clips.TICK
    path = clips.write(tmp_path / f"c.{kind}", tone=0.5, late=late, tick=tick)
    footage = Footage(path)
    with av.open(str(path)) as container:
        first = next(container.decode(audio=0))
        sound = first.pts * first.time_base
    assert len(footage) == 12
    assert footage.rate == 24
    assert not footage.is_variable
    steady = [float(t - footage.times[0]) for t in footage.times]
    assert steady == pytest.approx([n / 24 for n in range(12)], abs=0.0011)
    if kind != "avi":
        assert float(footage.times[0] - sound) == pytest.approx(
            late + (1024 / 48000 if kind == "ts" else 0), abs=0.0015
        )
    assert shown(footage) == list(range(12))


@pytest.mark.parametrize("kind", ["mp4", "mkv"])
def test_a_variable_rate_is_seen_in_the_times_alone(tmp_path, kind):
    times = [Fraction(n, 60) for n in (0, 1, 3, 4, 7, 8, 9, 10, 13, 14, 15, 16)]
    footage = Footage(clips.write(tmp_path / f"c.{kind}", times=times))
    assert footage.is_variable
    assert footage.rate == 60
    assert [float(t) for t in footage.times] == pytest.approx([float(t) for t in times], abs=6e-4)
    assert footage.steps == pytest.approx((1 / 60, 3 / 60), abs=0.001)
    assert shown(footage) == list(range(12))


@pytest.mark.parametrize(
    ("rate", "want"),
    [("24000/1001", "24000/1001"), ("29.97", "30000/1001"), ("144", "144"), ("240", "240"),
     ("37", "37")],
)  # fmt: skip
def test_a_rate_that_is_rounded_to_milliseconds_is_known_again(tmp_path, rate, want):
    times = [n / Fraction(rate) for n in range(40)]
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(40)]
    footage = Footage(clips.write(tmp_path / "c.mkv", frames, times))
    assert float(footage.rate) == pytest.approx(float(Fraction(want)), rel=2e-4)
    assert want == "37" or footage.rate == Fraction(want)
    assert not footage.is_variable


@pytest.mark.parametrize("rate", ["30", "30000/1001", "60000/1001", "120000/1001"])
@pytest.mark.parametrize("count", [3, 8, 44])
def test_a_few_times_of_milliseconds_have_the_rate_that_the_file_states(tmp_path, rate, count):
    """Rounded, those of 29.97 and 30 are the same for long."""
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(count)]
    path = clips.write(tmp_path / "c.mkv", frames, rate=Fraction(rate))
    with av.open(str(path)) as container:
        assert container.streams.video[0].time_base == Fraction(1, 1000)
    footage = Footage(path)
    assert footage.rate == Fraction(rate) and not footage.is_variable


def test_a_rate_that_the_times_do_not_keep_is_not_believed(tmp_path):
    """Matroska states one whatever the times are."""
    times = [Fraction(n, 24) for n in range(20)]
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(20)]
    path = clips.write(tmp_path / "c.mkv", frames, times, rate=Fraction(60))
    with av.open(str(path)) as container:
        assert container.streams.video[0].average_rate == 60
    assert Footage(path).rate == 24


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
    footage, wanted = Footage(path), Footage(plain)
    assert shown(footage) == shown(wanted)
    assert footage.loss() == ""
    assert footage.rate == 24


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
    monkeypatch.setattr("wgmb.io.footage._side_data", lambda frame: {Type.DOVI_METADATA: data})
    assert any(want in note for note in Footage(clips.write(tmp_path / "c.mp4")).notes)


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
    footage = Footage(path)
    assert len(footage) == 9
    assert footage.times[0] == 0
    levels = [float(np.median(p.planes[0])) for _, p in footage.pictures()]
    assert [round(level - 5) for level in levels] == pytest.approx(
        [clips.level(n) for n in range(3, 12)], abs=8
    )


@pytest.mark.parametrize("kind", ["mp4", "mkv", "ts"])
@pytest.mark.parametrize("g", ["4", "250"])
def test_pictures_from_the_middle_are_those_of_a_whole_pass(tmp_path, kind, g):
    """With B-frames and open groups, whose first pictures build on the group before."""
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(30)]
    options = {"g": g, "bf": "3", "x264-params": "open-gop=1:keyint-min=1:scenecut=0", "qp": "8"}
    footage = Footage(clips.write(tmp_path / f"c.{kind}", frames, options=options))
    whole = dict(footage)
    for first in (0, 3, 4, 11, 17, 29):
        part = dict(footage.pictures(first, first + 2))
        assert list(part) == [n for n in range(first, first + 3) if n < 30]
        for number, picture in part.items():
            for a, b in zip(picture.planes, whole[number].planes, strict=True):
                assert np.array_equal(a, b), number
    assert footage.loss() == ""


# ---- which way is up, fields ----------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
@pytest.mark.parametrize("mirror", [False, True])
def test_pictures_are_upright(tmp_path, degrees, mirror):
    """Against FFmpeg's own filters for what its display matrix says."""
    path = clips.write(
        tmp_path / "c.mov", [clips.frame(clips.planes(1, steps=(2, 1)), "yuv422p")],
        pixels="yuv422p", setup=lambda s: s.set_display_rotation(degrees, hflip=mirror),
    )  # fmt: skip
    footage = Footage(path)
    ((_, picture),) = footage
    stored = clips.planes(1, steps=(2, 1))[0]
    want = np.rot90(stored, degrees // 90)
    if mirror:
        want = want[:, ::-1]
    assert np.array_equal(picture.planes[0], want)
    assert footage.size == picture.size == want.shape[::-1]
    assert picture.coding.steps == ((1, 2) if degrees % 180 else (2, 1))
    assert footage.coding == picture.coding


def test_an_interlaced_frame_is_two_pictures(tmp_path):
    """A bar moves 2 px a field: the fields of a frame show it at two places."""
    frames = []
    for n in range(8):
        luma = np.full((48, 64), 50, np.uint8)
        for field in (0, 1):
            x = 4 + 4 * n + 2 * (1 - field)  # the lower field comes first
            luma[field::2, x : x + 12] = 200
        chroma = np.full((24, 32), 128, np.uint8)
        frames.append(clips.frame([luma, chroma, chroma], "yuv420p"))
    path = clips.write(tmp_path / "c.ts", frames, codec="mpeg2video", tick=Fraction(1, 25),
                       times=[Fraction(n, 25) for n in range(8)],
                       options={"flags": "+ilme+ildct", "qmin": "1", "qmax": "2"})  # fmt: skip
    footage = Footage(path)
    assert footage.is_interlaced
    assert footage.rate == 50
    assert len(footage) == 16
    assert any("two pictures (50 a second)" in note for note in footage.notes)
    places = {}
    for number, picture in footage:
        row = picture.planes[0][10:38].astype(float).mean(0) - 50
        places[number] = float((row * np.arange(64)).sum() / row.sum())
    assert list(places) == list(range(16))
    assert np.diff(list(places.values())) == pytest.approx(2, abs=0.6)
    later = dict(footage.pictures(9, 12))
    assert list(later) == [9, 10, 11, 12]
    for number, picture in later.items():
        row = picture.planes[0][10:38].astype(float).mean(0) - 50
        assert (row * np.arange(64)).sum() / row.sum() == pytest.approx(places[number], abs=0.01)


# ---- files that are not whole ---------------------------------------------------------------


def long(tmp_path, kind, count=48, **more):
    """A clip that nothing can be left out of unseen: pictures of noise."""
    rng = np.random.default_rng(3)
    frames = []
    for n in range(count):
        luma, *chroma = clips.planes(n)
        noise = rng.integers(0, 30, luma.shape, np.uint8)
        frames.append(clips.frame([luma + noise, *chroma], "yuv420p"))
    options = {"crf": "20", "g": "12"}
    return clips.write(tmp_path / f"c.{kind}", frames, options=options, tone=2, **more)


def test_an_mp4_without_its_end_says_what_is_missing(tmp_path):
    path = long(tmp_path, "mp4")
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(InputError, match=r"c\.mp4: is cut off: its index \(moov\)") as error:
        Footage(path)
    assert str(error.value).count("\n") == 0


@pytest.mark.parametrize(
    ("kind", "muxing"), [("mkv", {}), ("mp4", {"movflags": "faststart"}), ("avi", {})]
)
def test_a_file_that_was_cut_off_says_where(tmp_path, kind, muxing):
    tick = Fraction(1, 24)
    path = long(tmp_path, kind, muxing=muxing, tick=tick)
    whole = path.read_bytes()
    assert not any("cut off" in note for note in Footage(path).notes)
    path.write_bytes(whole[: len(whole) // 2])
    footage = Footage(path)
    got = [n for n, _ in footage]
    assert 10 < len(got) < 40
    (note,) = [note for note in footage.notes if "is cut off: it ends at" in note]
    assert note.endswith(("of 2.00 s", "of 2.02 s", "of 2.05 s"))


@pytest.mark.parametrize("kind", ["mp4", "mkv"])
def test_damaged_bytes_are_counted_in_pictures(tmp_path, kind):
    path = long(tmp_path, kind)
    data = bytearray(path.read_bytes())
    at = len(data) // 3
    data[at : at + 400] = np.random.default_rng(4).bytes(400)
    path.write_bytes(data)
    footage = Footage(path)
    got = [n for n, _ in footage]
    assert len(got) + len(footage.missing) == len(footage)
    said = " ".join((footage.loss(), *footage.notes))
    assert any(word in said for word in ("could not be decoded", "are damaged", "pause once"))


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"", "is empty"), (b"hello " * 100, "is not a video"), (None, "no such file")],
)
def test_what_is_no_video_is_one_line(tmp_path, content, said):
    path = tmp_path / "c.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=rf"c\.mp4: {said}") as error:
        Footage(path)
    assert "\n" not in str(error.value)


def test_sound_alone_has_no_pictures(tmp_path):
    path = tmp_path / "c.m4a"
    with av.open(str(path), "w", format="mp4") as out:
        sound = out.add_stream("aac", rate=48000)
        sound.layout = "mono"
        for block in clips.samples(0.2):
            out.mux(sound.encode(block))
        out.mux(sound.encode(None))
    with pytest.raises(InputError, match="no pictures that move; it holds audio"):
        Footage(path)


def test_absurd_sizes_are_refused(tmp_path):
    path = clips.write(tmp_path / "c.mp4", [plain((1280, 720))])
    with pytest.raises(InputError, match="max_mb"):
        Footage(path, max_mb=2)


def test_names_that_look_like_addresses_are_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "http:").mkdir()
    path = clips.write(tmp_path / "x.mp4")
    path.rename(tmp_path / "http:" / "a%02d.mp4")
    assert len(Footage("http:/a%02d.mp4")) == 12


def test_a_playlist_leads_nowhere(tmp_path):
    (tmp_path / "c.m3u8").write_text("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n"
                                     "http://127.0.0.1:9/a.ts\n#EXT-X-ENDLIST\n")  # fmt: skip
    with pytest.raises(InputError, match=r"c\.m3u8: "):
        Footage(tmp_path / "c.m3u8")


def test_pictures_of_another_size_are_scaled_to_that_of_the_first(tmp_path):
    """Recordings of calls change their size; a raw stream is joined of two."""
    parts = []
    for size in ((64, 48), (128, 96)):
        frames = [clips.frame(clips.planes(n, size), "yuv420p") for n in range(4)]
        parts.append(clips.write(tmp_path / f"{size[0]}.h264", frames, kind="h264").read_bytes())
    (tmp_path / "both.h264").write_bytes(b"".join(parts))
    footage = Footage(tmp_path / "both.h264")
    assert not footage.scaling()
    pictures = dict(footage)
    assert footage.scaled == {4, 5, 6, 7} and len(pictures) == 8 and not footage.loss()
    assert "4 pictures of another size were scaled to 64 x 48, from 0." in footage.scaling()
    for n, picture in pictures.items():
        assert picture.size == (64, 48)
        luma, want = picture.planes[0].astype(int), clips.planes(n % 4)[0]
        assert np.abs(luma - want).max() <= 2


def test_a_single_picture_has_the_rate_that_its_file_states(tmp_path):
    one = [clips.frame(clips.planes(0), "yuv420p")]
    assert Footage(clips.write(tmp_path / "a.mp4", one, rate=Fraction(50))).rate == 50


def test_a_stream_of_alpha_is_not_taken_for_the_pictures(tmp_path):
    """As in animated AVIF, where it may come with more bits than the pictures."""
    path = tmp_path / "a.mkv"
    with av.open(str(path), "w") as out:
        kinds = ("yuv420p", "gray")
        streams = [out.add_stream("ffv1", rate=24) for _ in kinds]
        for stream, pixels in zip(streams, kinds, strict=True):
            stream.width, stream.height, stream.pix_fmt = clips.WIDTH, clips.HEIGHT, pixels
        for n in range(3):
            planes = clips.planes(n)
            for stream, pixels in zip(streams, kinds, strict=True):
                one = clips.frame(planes if pixels == "yuv420p" else planes[:1], pixels)
                one.pts, one.time_base = n, Fraction(1, 24)
                out.mux(stream.encode(one))
        for stream in streams:
            out.mux(stream.encode(None))
    with av.open(str(path)) as container:

        class Streams:
            """Those of the container; FFmpeg thinks the grey one best."""

            video = container.streams.video

            def best(self, kind):
                return self.video[1]

        class Container:
            streams = Streams()

        assert picture_stream(Container(), path).index == 0  # pyright: ignore


def test_animated_webp_is_refused_by_its_name(tmp_path):
    frames = [Image.new("RGB", (32, 20), (40 * n, 0, 0)) for n in range(4)]
    path = tmp_path / "a.webp"
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=40)
    with pytest.raises(InputError, match=r"a\.webp: animated WebP is not read; GIF, APNG and AVIF"):
        Footage(path)
