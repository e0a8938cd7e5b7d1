"""Videos are read as they are: every sample, what colours mean, which way is up."""

import re
from fractions import Fraction

import av
import numpy as np
import pytest
from av.video.reformatter import VideoReformatter

import make_clips as clips
from wgmb.cli.commands.info_video import describe_video
from wgmb.color.coding import Coding
from wgmb.video.pixels import (
    frame_of,
    layout,
    pixel_format,
    planes_of,
)
from wgmb.video.read.reader import VideoReader
from wgmb.video.write.container import kept_scheduling

pytestmark = pytest.mark.fast


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
    reader = VideoReader(path)
    assert reader.coding == want
    assert reader.assumed == ()
    for (number, picture), stored in zip(list(reader), data, strict=True):
        assert picture.size == (clips.WIDTH, clips.HEIGHT) == reader.size
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
    reader = VideoReader(path)
    ((_, picture),) = reader
    coding = reader.coding
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


@pytest.mark.parametrize(
    ("size", "want"),
    [((1280, 32), (1, 1, 1)), ((64, 720), (1, 1, 1)), ((720, 480), (6, 1, 6)),
     ((720, 576), (6, 1, 5))],
)  # fmt: skip
def test_untagged_colours_go_by_the_size(tmp_path, size, want):
    reader = VideoReader(clips.write(tmp_path / "c.mp4", [clips.grey(size)]))
    coding = reader.coding
    assert (coding.matrix, coding.transfer, coding.primaries) == want
    name = "BT.709" if want[0] == 1 else "BT.601"
    assert reader.assumed == (f"matrix {name}", "transfer BT.709", f"primaries {name}")
    assert any("does not state its colours: matrix BT" in note for note in reader.notes)


@pytest.mark.parametrize("kind", ["mp4", "mkv"])
@pytest.mark.parametrize("tags", [(1, 9, 16, 9), (1, 9, 18, 9), (2, 1, 13, 1), (1, 1, 1, 12)])
def test_colours_that_are_tagged_are_taken_as_tagged(tmp_path, kind, tags):
    frames = [clips.frame(clips.planes(n, bits=10), "yuv420p10le") for n in range(3)]
    path = clips.write(tmp_path / f"c.{kind}", frames, codec="libx265", pixels="yuv420p10le",
                       tags=tags)  # fmt: skip
    reader, coding = VideoReader(path), VideoReader(path).coding
    assert reader.assumed == ()
    assert coding.full_range == (tags[0] == 2)
    assert (coding.matrix, coding.transfer, coding.primaries) == tags[1:]


def test_the_display_that_an_hdr10_video_was_graded_on_is_read(tmp_path):
    options = {"x265-params": "log-level=none:max-cll=1000,400:master-display="
               "G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,1)"}  # fmt: skip
    frames = [clips.frame(clips.planes(n, bits=10), "yuv420p10le") for n in range(3)]
    reader = VideoReader(clips.write(tmp_path / "c.mp4", frames, codec="libx265",
                                  pixels="yuv420p10le", options=options))  # fmt: skip
    assert reader.mastering is not None and reader.light_level is not None
    assert reader.mastering.for_x265() in options["x265-params"]
    assert str(reader.light_level) == "1000,400"
    assert reader.mastering.luminance == (0.0001, 1000.0)
    said = dict(describe_video(reader))
    assert said["mastered"] == (
        "on a display of 0.0001 to 1000 cd/m2; "
        "red 0.680 0.320, green 0.265 0.690, blue 0.150 0.060, white 0.313 0.329"
    )
    assert said["light"] == (
        "brightest pixel 1000, brightest mean of a picture 400 cd/m2 (MaxCLL, MaxFALL)"
    )


CAPTIONS = b"\xb5\0\x31GA94\3\x42\xff\xfc\x94\x2c\xfc\x94\x2c\xff"  # of ATSC A/53, part 4
SHAPE = b"\xb5\0\x31DTG1\x41\xfa"  # of ETSI TS 101 154, annex B


@pytest.mark.parametrize(
    ("data", "said"),
    [(CAPTIONS, "closed captions in its pictures (CEA-608, CEA-708) are not kept"),
     (SHAPE, "its active format description (AFD) is not kept")],
)  # fmt: skip
def test_data_in_pictures_that_is_lost_is_said(tmp_path, data, said):
    path = clips.write(tmp_path / "a.h264", kind="h264")
    assert said not in VideoReader(path).notes
    message = b"\0\0\1\x06\x04" + bytes([len(data)]) + data + b"\x80"
    slices = re.compile(rb"\x00\x00\x01[\x01\x21\x25\x41\x61\x65]")
    path.write_bytes(slices.sub(lambda match: message + match[0], path.read_bytes()))
    assert said in VideoReader(path).notes


def test_a_codec_has_its_own_name_not_that_of_a_decoder(tmp_path):
    with kept_scheduling():
        path = clips.write(tmp_path / "c.mp4", codec="libsvtav1", options={"svtav1-params": "lp=1"})
    assert VideoReader(path).codec == "av1"


# ---- which way is up, fields ----------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
@pytest.mark.parametrize("mirror", [False, True])
def test_pictures_are_upright(tmp_path, degrees, mirror):
    """Against FFmpeg's own filters for what its display matrix says."""
    path = clips.write(
        tmp_path / "c.mov", [clips.frame(clips.planes(1, steps=(2, 1)), "yuv422p")],
        pixels="yuv422p", setup=lambda s: s.set_display_rotation(degrees, hflip=mirror),
    )  # fmt: skip
    reader = VideoReader(path)
    ((_, picture),) = reader
    stored = clips.planes(1, steps=(2, 1))[0]
    want = np.rot90(stored, degrees // 90)
    if mirror:
        want = want[:, ::-1]
    assert np.array_equal(picture.planes[0], want)
    assert reader.size == picture.size == want.shape[::-1]
    assert picture.coding.steps == ((1, 2) if degrees % 180 else (2, 1))
    assert reader.coding == picture.coding


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
    reader = VideoReader(path)
    assert reader.is_interlaced
    assert reader.rate == 50
    assert len(reader) == 16
    assert any("two pictures (50 a second)" in note for note in reader.notes)
    places = {}
    for number, picture in reader:
        row = picture.planes[0][10:38].astype(float).mean(0) - 50
        places[number] = float((row * np.arange(64)).sum() / row.sum())
    assert list(places) == list(range(16))
    assert np.diff(list(places.values())) == pytest.approx(2, abs=0.6)
    later = dict(reader.pictures(9, 12))
    assert list(later) == [9, 10, 11, 12]
    for number, picture in later.items():
        row = picture.planes[0][10:38].astype(float).mean(0) - 50
        assert (row * np.arange(64)).sum() / row.sum() == pytest.approx(places[number], abs=0.01)


@pytest.mark.parametrize("order", ["tff", "bff"])
def test_h264_of_fields_has_its_order_of_fields(tmp_path, order):
    """MBAFF, as broadcasts have it: which field is the first one is a flag of each frame."""
    graph, first = av.filter.Graph(), int(order == "bff")
    source = graph.add_buffer(width=128, height=96, format="yuv420p", time_base=Fraction(1, 25))
    setfield = graph.add("setfield", order)
    source.link_to(setfield)
    setfield.link_to(graph.add("buffersink"))
    graph.configure()
    frames, chroma = [], np.full((48, 64), 128, np.uint8)
    for n in range(8):
        luma = np.full((96, 128), 50, np.uint8)
        luma[first::2, 4 * n + 10 : 4 * n + 30] = luma[1 - first :: 2, 4 * n + 12 : 4 * n + 32] = (
            200
        )
        one = clips.frame([luma, chroma, chroma], "yuv420p")
        one.pts, one.time_base = n, Fraction(1, 25)
        graph.push(one)
        frames.append(graph.pull())
    options = {"x264-params": "interlaced=1", "crf": "10"}
    path = clips.write(tmp_path / "c.ts", frames, [Fraction(n, 25) for n in range(8)],
                       options=options, rate=Fraction(25), tick=Fraction(1, 25))  # fmt: skip
    places = []
    for _, picture in VideoReader(path):
        row = picture.planes[0].astype(float).mean(0) - 50
        places.append(float((row * np.arange(128)).sum() / row.sum()))
    assert np.diff(places) == pytest.approx(2, abs=0.6)


def test_two_threads_may_read_one_video_at_the_same_time(tmp_path):
    """On a busy machine the thread that read ahead for one segment may outlive it."""
    footage = VideoReader(clips.write(tmp_path / "c.mp4", options={"g": "4"}))
    old, new, count = footage.pictures(), footage.pictures(), len(footage)
    numbers = [next(new)[0] for _ in range(2)]
    assert [next(old)[0] for _ in range(count - 2)] == list(range(count - 2))
    assert numbers + [number for number, _ in new] == list(range(count))
    assert not footage.missing
