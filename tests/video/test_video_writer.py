"""Pictures go into a video as they are coded, at the times they are given, or not at all."""

import os
import sys
from dataclasses import replace
from fractions import Fraction

import av
import numpy as np
import pytest

import make_clips as clips
from wgmb import InputError
from wgmb.color.coding import CodedPicture, Coding
from wgmb.video.clock import Clock, tick
from wgmb.video.hdr10 import LightLevel, Mastering
from wgmb.video.read.reader import VideoReader
from wgmb.video.write import container, encoders
from wgmb.video.write.encoders import CODECS, Facts, chosen
from wgmb.video.write.format import VideoFormat
from wgmb.video.write.writer import VideoWriter

pytestmark = pytest.mark.fast

RATE = Fraction(24)
PQ = Coding("yuv", 10, (2, 2), False, False, 9, 16, 9)
P3 = ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06), (0.3127, 0.329))


def pictures(coding: Coding, count=5, size=(clips.WIDTH, clips.HEIGHT)) -> list[CodedPicture]:
    """The picture of make_clips, as `coding` has it."""
    found = []
    for n in range(count):
        y, u, v, a = clips.planes(n, size, coding.steps, coding.bits, alpha=True)
        planes = {"yuv": (y, u, v), "rgb": (y, y[::-1], y // 2), "grey": (y,)}[coding.model]
        planes = (*planes, a) if coding.alpha else planes
        found.append(CodedPicture(tuple(np.ascontiguousarray(p) for p in planes), coding))
    return found


def write(path, coding, codec=None, times=None, made=None, quality=None, facts=None, base=None):
    """A video of `pictures`; returns what was written."""
    encoding = chosen(path, codec, quality)
    coding, _ = encoding.coding(coding)
    made = made or pictures(coding)
    times = times or [n / RATE for n in range(len(made))]
    base, facts = base or tick(*times), facts or Facts()
    form = VideoFormat(encoding, coding, made[0].size, RATE, base, facts)
    video = VideoWriter(path, path.with_name("part"), form)
    for picture, time in zip(made, times, strict=True):
        assert not path.exists()
        video.add(picture, Fraction(time))
    video.close()
    assert not path.with_name("part").exists()
    return made


# ---- the table ------------------------------------------------------------------------------


@pytest.mark.parametrize("codec", CODECS)
def test_the_table_names_what_the_encoders_have(codec):
    found = CODECS[codec]
    for kind, encoder in (("", found.software), *found.hardware):
        if kind == "videotoolbox" and sys.platform != "darwin":
            continue  # only Apple's builds have it
        formats = {form.name for form in av.Codec(encoder.name, "w").video_formats or []}
        assert set(encoder.pixels) <= formats or (kind == "v4l2m2m" and not formats)
        context = av.CodecContext.create(encoder.name, "w")
        options = {o.name for o in context.supported_options.private}
        generic = {o.name for o in context.supported_options.generic}
        asked = {encoder.quality, encoder.parameters, *dict(encoder.options)} - {""}
        assert asked <= options | generic


EVERY = [
    Coding(model, bits, steps, alpha)
    for model in ("yuv", "rgb", "grey")
    for bits in (8, 9, 10, 12, 14, 16)
    for steps in ((2, 2), (2, 1), (1, 1), (1, 2), (4, 1), (4, 4))
    for alpha in (False, True)
    if model == "yuv" or steps == (1, 1)
]


@pytest.mark.parametrize("codec", [name for name in CODECS if name != "gif"])
def test_every_coding_has_a_nearest_one_and_losses_are_told(codec):
    encoding = chosen(f"x{CODECS[codec].suffixes[0]}", codec)
    for wanted in EVERY:
        found, lost = encoding.coding(wanted)
        assert encoding.pixels(found) in encoding.encoder.pixels
        assert encoding.coding(found)[0] == found
        assert (wanted.alpha and not found.alpha) == any("transparency" in text for text in lost)
        assert (wanted.bits > found.bits) == any("bits of" in text for text in lost)
        assert (found.matrix == 0) == (found.model == "rgb")


@pytest.mark.parametrize(
    ("path", "options", "said"),
    [
        ("a.avi", {}, "must end in one of .mp4"),
        ("a.mp4", {"codec": "h256"}, "did you mean 'h265'"),
        ("a.mp4", {"codec": "prores"}, r"prores goes into \.mov, \.mkv; \.mp4 takes h264, h265"),
        ("a.mov", {"quality": 3}, "codec prores has no quality"),
        ("a.mp4", {"quality": 52}, "quality of h264 must be 0 to 51"),
        ("a.mp4", {"encoder": "nvenk"}, "did you mean 'nvenc'"),
        (
            "a.mov",
            {"encoder": "qsv"},
            "encoder qsv is not for prores; it is for h264, h265, av1, vp9",
        ),
        ("a.mp4", {"encoder": "v4l2m2m", "quality": 9}, "h264_v4l2m2m has no quality to choose"),
        ("a.mp4", {"encoder": "videotoolbox", "codec": "av1"}, "is for h264, h265"),
    ],
)
def test_what_does_not_fit_together_is_refused(path, options, said):
    with pytest.raises(InputError, match=said):
        chosen(path, **options)


def test_an_encoder_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setitem(CODECS, "av1", encoders.Codec((".mp4",), encoders.Encoder("x", ())))
    with pytest.raises(InputError, match=r"encoder x is not in this build of PyAV$"):
        chosen("a.mp4", "av1")


HARDWARE = [(codec, kind) for codec, one in CODECS.items() for kind, _ in one.hardware]


@pytest.mark.parametrize(("codec", "kind"), HARDWARE)
def test_a_hardware_encoder_opens_or_says_why_not(tmp_path, codec, kind):
    path = tmp_path / f"a{CODECS[codec].suffixes[0]}"
    try:
        encoding = chosen(path, codec, encoder=kind)
        coding, _ = encoding.coding(Coding())
        part = tmp_path / "part"
        form = VideoFormat(encoding, coding, (256, 256), RATE, 1 / RATE)
        VideoWriter(path, part, form).abandon()
    except InputError as error:
        name = dict(CODECS[codec].hardware)[kind].name
        why = str(error).removeprefix(f"encoder {name} ")
        assert why.startswith(
            ("does not start: it needs", "is not in this build of PyAV, which has")
        )
    assert list(tmp_path.iterdir()) == []


def test_apples_encoder_counts_its_quality_the_other_way():
    """From 1 to 100, the best, in units of which 118 are one."""
    apple = dict(CODECS["h265"].hardware)["videotoolbox"]
    asked = [int(apple.of_quality(quality)["global_quality"]) for quality in (0, 18, 51)]
    assert asked == [11800, 64 * 118, 118]


# ---- samples, colours, times ----------------------------------------------------------------


@pytest.mark.parametrize("coding", [c for c in EVERY if c.bits in (8, 10, 12, 16)], ids=str)
def test_ffv1_keeps_every_sample(tmp_path, coding):
    written = write(tmp_path / "v.mkv", coding, "ffv1")
    reader = VideoReader(tmp_path / "v.mkv")
    assert reader.coding == written[0].coding
    for (_, got), want in zip(reader, written, strict=True):
        for a, b in zip(got.planes, want.planes, strict=True):
            assert np.array_equal(a, b)


@pytest.mark.parametrize(
    ("name", "codec", "bits", "steps", "near"),
    [
        ("v.mp4", "h264", 8, (2, 2), 2), ("v.mkv", "h264", 10, (1, 1), 6),
        ("v.mp4", "h265", 8, (2, 2), 2), ("v.mp4", "h265", 10, (2, 1), 6),
        ("v.mov", "h265", 12, (1, 1), 24), ("v.mkv", "av1", 10, (2, 2), 8),
        ("v.mp4", "av1", 8, (2, 2), 3), ("v.webm", "vp9", 8, (2, 2), 3),
        ("v.mp4", "vp9", 8, (1, 1), 3), ("v.mov", "prores", 10, (2, 1), 4),
        ("v.mkv", "prores", 10, (1, 1), 4),
    ],
)  # fmt: skip
@pytest.mark.parametrize("colours", [(1, 1, 1), (9, 16, 9), (9, 18, 9), (1, 13, 1), (6, 6, 6)])
def test_pictures_and_their_tags_come_back(tmp_path, name, codec, bits, steps, near, colours):
    matrix, transfer, primaries = colours
    coding = Coding("yuv", bits, steps, False, False, matrix, transfer, primaries)
    written = write(tmp_path / name, coding, codec, quality=4 if CODECS[codec].quality else None)
    reader = VideoReader(tmp_path / name)
    held = reader.coding
    if codec == "prores" and steps == (1, 1):  # FFmpeg decodes 4444 to 12 bits
        held, near = replace(held, bits=10), near << 2
    assert held == coding
    assert reader.assumed == ()
    assert [float(t) for t in reader.times] == pytest.approx([n / 24 for n in range(5)], abs=6e-4)
    for (_, got), want in zip(reader, written, strict=True):
        for a, b in zip(got.planes, want.planes, strict=True):
            more = reader.coding.bits - bits
            assert np.abs(a.astype(int) - (b.astype(int) << more)).mean() < near


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize(("name", "codec"), [("v.mp4", "h264"), ("v.mkv", "h265"),
                                             ("v.mp4", "av1"), ("v.webm", "vp9")])  # fmt: skip
def test_the_range_is_kept(tmp_path, name, codec, full):
    write(tmp_path / name, Coding(full_range=full), codec)
    assert VideoReader(tmp_path / name).coding.full_range == full


def test_alpha_goes_into_prores_4444(tmp_path):
    coding = Coding("yuv", 10, (1, 1), True)
    written = write(tmp_path / "v.mov", coding)
    reader = VideoReader(tmp_path / "v.mov")
    assert reader.coding.alpha
    shift = reader.coding.bits - 10  # FFmpeg decodes it to 12 bits
    for (_, got), want in zip(reader, written, strict=True):
        apart = np.abs((got.planes[3] >> shift).astype(int) - want.planes[3])
        assert apart.max() <= 1


@pytest.mark.parametrize(
    ("name", "codec"), [("v.mp4", "h265"), ("v.mkv", "h265"), ("v.mp4", "av1"), ("v.mkv", "h264")]
)
def test_hdr10_data_is_what_it_was(tmp_path, name, codec):
    facts = Facts(mastering=Mastering(P3, (0.0005, 1000.0)), light_level=LightLevel(993, 412))
    write(tmp_path / name, PQ, codec, facts=facts)
    reader = VideoReader(tmp_path / name)
    assert reader.coding == PQ
    assert reader.light_level == facts.light_level
    assert reader.mastering is not None
    assert reader.mastering.luminance == pytest.approx((0.0005, 1000.0), abs=1e-4)
    assert reader.mastering.primaries is not None
    assert np.ravel(reader.mastering.primaries) == pytest.approx(np.ravel(P3), abs=2e-5)


@pytest.mark.parametrize(
    ("name", "codec"),
    [("v.mp4", "h264"), ("v.mkv", "h265"), ("v.mkv", "h264"), ("v.mov", "prores"),
     ("v.mkv", "prores"), ("v.mp4", "vp9"), ("v.mp4", "av1"), ("v.webm", "vp9"),
     ("v.mkv", "ffv1"), ("v.mkv", "av1")],
)  # fmt: skip
def test_pixels_that_are_not_square_are_tagged(tmp_path, name, codec):
    facts = Facts(pixel_aspect=Fraction(64, 45))
    write(tmp_path / name, Coding(), codec, facts=facts)
    told = chosen(name, codec).left_out(facts)
    assert VideoReader(tmp_path / name).pixel_aspect == (1 if told else Fraction(64, 45))
    assert not told or "64/45 times as wide as high" in told[0]


@pytest.mark.parametrize(("name", "codec"), [("v.mp4", "h264"), ("v.mp4", "h265"),
                                             ("v.mkv", "av1"), ("v.webm", "vp9"),
                                             ("v.mov", "prores"), ("v.mkv", "ffv1")])  # fmt: skip
def test_odd_sizes(tmp_path, name, codec):
    encoding = chosen(name, codec)
    coding = encoding.coding(Coding())[0]
    made = pictures(coding, size=(65, 49))
    write(tmp_path / name, coding, codec, made=made)
    ((_, got), *_) = VideoReader(tmp_path / name)
    assert got.size == ((66, 50) if encoding.encoder.even else (65, 49))
    assert np.abs(got.planes[0][:49, :65].astype(int) - made[0].planes[0]).mean() < 3
    if encoding.encoder.even:  # the last column and row are there twice
        assert np.abs(got.planes[0][:, 65].astype(int) - got.planes[0][:, 64]).mean() < 3


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize(("name", "codec"), [("v.mp4", "h264"), ("v.mp4", "h265"),
                                             ("v.mkv", "h265"), ("v.mp4", "av1"),
                                             ("v.webm", "vp9"), ("v.mov", "prores")])  # fmt: skip
def test_a_few_pictures_are_a_video(tmp_path, name, codec, count):
    """x265 leaves the decoding times of one or two frames to chance."""
    encoding = chosen(name, codec)
    made = pictures(encoding.coding(Coding())[0], count)
    write(tmp_path / name, Coding(), codec, made=made)
    assert [n for n, _ in VideoReader(tmp_path / name)] == list(range(count))


@pytest.mark.parametrize(("name", "codec"), [("v.mp4", "h264"), ("v.mp4", "h265"),
                                             ("v.mp4", "av1"), ("v.mov", "prores"),
                                             ("v.mp4", "vp9")])  # fmt: skip
def test_times_are_exact(tmp_path, name, codec):
    """Also those that keep no steady rate, and a beginning after 0."""
    steps = [0, 1, 3, 4, 7, 8, 9, 13]
    times = [Fraction(23, 1000) + Fraction(1001 * n, 60000) for n in steps]
    encoding = chosen(name, codec)
    made = pictures(encoding.coding(Coding())[0], len(times))
    write(tmp_path / name, Coding(), codec, times, made)
    reader = VideoReader(tmp_path / name)
    assert list(reader.times) == times
    assert reader.is_variable


def test_times_that_do_not_ascend_are_refused(tmp_path):
    with pytest.raises(InputError, match="do not ascend"):
        write(tmp_path / "v.mp4", Coding(), times=[0, 1, 1, 2, 3], base=Fraction(1, 24))


def test_a_video_without_pictures_is_none(tmp_path):
    encoding = chosen("v.mp4")
    form = VideoFormat(encoding, Coding(), (64, 48), RATE, 1 / RATE)
    video = VideoWriter(tmp_path / "v.mp4", tmp_path / "part", form)
    with pytest.raises(InputError, match="no pictures to write"):
        video.close()
    assert list(tmp_path.iterdir()) == []


def test_a_picture_of_another_kind_is_refused(tmp_path):
    made = [*pictures(Coding(), 2), *pictures(Coding(), 1, (32, 32))]
    with pytest.raises(InputError, match=r"picture of \(32, 32\)"):
        write(tmp_path / "v.mp4", Coding(), made=made)


def test_what_cannot_be_written_names_the_file(tmp_path):
    encoding = chosen("v.mp4")
    with pytest.raises(OSError, match=r"v\.mp4: No such file"):
        form = VideoFormat(encoding, Coding(), (64, 48), RATE, 1 / RATE)
        VideoWriter(tmp_path / "v.mp4", tmp_path / "none" / "part", form)


# ---- the clock ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("times", "want"),
    [(["1/24"], "1/24"), (["1001/30000", "1001/60000"], "1001/60000"),
     (["1/60", "23/1000"], "1/3000"), (["0", "1/25"], "1/25"), (["1/9999991", "1/24"], "1/90000")],
)  # fmt: skip
def test_the_tick_that_times_are_multiples_of(times, want):
    assert tick(*map(Fraction, times)) == Fraction(want)


def test_a_clock_goes_there_and_back():
    clock = Clock(Fraction(1, 3), Fraction(2, 5), Fraction(1, 7))
    assert clock.out(Fraction(1, 3)) == Fraction(1, 7)
    assert clock.out(Fraction(1, 3) + 2) == Fraction(1, 7) + 5
    assert clock.back(clock.out(Fraction(9, 11))) == Fraction(9, 11)


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="this system has no policies")
@pytest.mark.parametrize(("name", "codec"), [("v.mp4", "av1"), ("v.mp4", "h265"), ("v.mp4", None)])
def test_no_thread_is_made_real_time(tmp_path, monkeypatch, name, codec):
    """SVT-AV1 would where it may, as root: new threads would inherit it and hold others up."""
    begin, during = container.begin, []

    def observed(*given):
        stream = begin(*given)
        during.extend(os.sched_getscheduler(int(n)) for n in os.listdir("/proc/self/task"))
        return stream

    monkeypatch.setattr(container, "begin", observed)
    write(tmp_path / name, Coding(bits=8), codec)
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
    assert during
    assert not {os.SCHED_FIFO, os.SCHED_RR} & set(during)
