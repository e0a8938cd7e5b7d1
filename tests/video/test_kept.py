"""Facts about a video that are no streams: crop, time code, names of data, views and colours."""

import io
import os
import struct
import threading
from fractions import Fraction

import av
import numpy as np
import pytest
from PIL import Image, features

import make_clips as clips
from wgmb import InputError, blur_video
from wgmb.cli.app import main
from wgmb.cli.commands.info_video import describe_video
from wgmb.io.pipes import STDOUT
from wgmb.run.pipe import blur_pipe
from wgmb.run.video import VideoRequest
from wgmb.sequence.frame_file import is_video
from wgmb.settings import OutputSettings
from wgmb.settings.video import VideoSettings
from wgmb.video.read.reader import VideoReader
from wgmb.video.read.stream_text import _read, cropped, whole_samples
from wgmb.video.write.time_code import moved
from wgmb.video.write.views import stereo_mode


def inserted(data: bytes, path: list[int], element: bytes) -> bytes:
    """A Matroska file without lengths of segment and clusters, with one more element in a path."""
    at = 0
    while at < len(data):
        length = (lambda first: 9 - first.bit_length())(data[at])
        number, at_size = int.from_bytes(data[at : at + length]), at + length
        wide = 9 - data[at_size].bit_length()
        size = int.from_bytes(data[at_size : at_size + wide]) & ((1 << 7 * wide) - 1)
        begin, unknown = at_size + wide, size == (1 << 7 * wide) - 1
        end = len(data) if unknown else begin + size
        if number == path[0]:
            inner = data[begin:end]
            inner = element + inner if len(path) == 1 else inserted(inner, path[1:], element)
            head = data[at_size:begin] if unknown else (len(inner) | 1 << 56).to_bytes(8)
            return data[:at_size] + head + inner + data[end:]
        at = end
    raise ValueError("no such element")


VIDEO = [0x18538067, 0x1654AE6B, 0xAE, 0xE0]


def matroska(path, *elements, size=(64, 48), **more):
    """A clip whose video has these elements, each a number of two bytes and its content."""
    frames = [clips.frame(clips.planes(n, size), "yuv420p") for n in range(8)]
    clips.write(path, frames, muxing={"live": "1"}, **more)
    data = path.read_bytes()
    for number, content in elements:
        data = inserted(data, VIDEO, number.to_bytes(2) + bytes([0x80 | len(content)]) + content)
    path.write_bytes(data)
    return path


@pytest.mark.fast
def test_a_crop_of_matroska_is_cut_off(tmp_path):
    """Left 4, right 6, top 3, bottom 2: chroma is whole, so that a row more is kept at the top."""
    parts = [(0x54CC, 4), (0x54DD, 6), (0x54BB, 3), (0x54AA, 2)]
    path = matroska(tmp_path / "a.mkv", *((n, bytes([v])) for n, v in parts))
    reader = VideoReader(path)
    assert reader.size == (54, 44)
    whole = dict(VideoReader(matroska(tmp_path / "b.mkv")))
    for number, picture in reader:
        luma, *chroma = picture.planes
        np.testing.assert_array_equal(luma, whole[number].planes[0][2:46, 4:58])
        for plane, full in zip(chroma, whole[number].planes[1:], strict=True):
            np.testing.assert_array_equal(plane, full[1:23, 2:29])


@pytest.mark.fast
@pytest.mark.parametrize("left", [2, 4, 34])
def test_a_crop_within_h264_is_exact(tmp_path, left):
    """FFmpeg's decoder crops the left in steps of 32 bytes, unless it is told otherwise."""
    whole = clips.write(tmp_path / "a.h264", kind="h264")
    filtered = f"h264_metadata=crop_left={left}:crop_top=2"
    with av.open(str(whole)) as file, open(tmp_path / "b.h264", "wb") as to:
        by = av.BitStreamFilterContext(filtered, file.streams.video[0])
        for packet in file.demux(video=0):
            for one in by.filter(packet if packet.size else None):
                to.write(bytes(one))
    reader = VideoReader(tmp_path / "b.h264")
    assert reader.size == (64 - left, 46)
    for (_, got), (_, want) in zip(reader, VideoReader(whole), strict=True):
        np.testing.assert_array_equal(got.planes[0], want.planes[0][2:, left:])
        np.testing.assert_array_equal(got.planes[1], want.planes[1][1:, left // 2 :])


def test_a_crop_of_all_is_none():
    assert whole_samples((30, 34, 0, 0), (64, 48), (2, 2)) == (0, 0, 0, 0)
    planes = (np.zeros((5, 7)), np.zeros((3, 4)), np.zeros((3, 4)))
    assert [p.shape for p in cropped(planes, (2, 1, 0, 1), (2, 2))] == [(4, 4), (2, 2), (2, 2)]


def test_a_cropped_video_is_written_without_its_bars(tmp_path):
    path = matroska(tmp_path / "a.mkv", (0x54BB, b"\x08"), (0x54AA, b"\x08"))
    blur_video(path, tmp_path / "b.mp4", flow="none")
    assert VideoReader(tmp_path / "b.mp4").size == (64, 32)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("tags", "want"),
    [((1, 1, 2, 2), (1, 1)), ((1, 6, 2, 2), (6, 6)), ((1, 5, 2, 2), (5, 5)),
     ((1, 9, 2, 2), (9, 9)), ((1, 2, 2, 1), (1, 1)), ((1, 2, 2, 9), (9, 9)),
     ((1, 2, 2, 2), (6, 6)), ((1, 1, 2, 12), (1, 12))],
)  # fmt: skip
def test_matrix_and_primaries_are_of_one_standard(tmp_path, tags, want):
    """Range, matrix, transfer, primaries; 2 is unspecified."""
    coding = VideoReader(clips.write(tmp_path / "a.mp4", tags=tags)).coding
    assert (coding.matrix, coding.primaries) == want


@pytest.mark.fast
@pytest.mark.parametrize(
    ("code", "rate", "by", "to", "want"),
    [("01:02:03:04", 24, 0, 24, "01:02:03:04"), ("01:02:03:23", 24, "1/24", 24, "01:02:04:00"),
     ("01:02:03:04", 24, "1/4", 48, "01:02:03:20"), ("23:59:59:24", 25, "1/25", 25, "00:00:00:00"),
     ("01:00:59;29", "30000/1001", "1001/30000", "30000/1001", "01:01:00;02"),
     ("00:59:59;29", "30000/1001", "1001/30000", "30000/1001", "01:00:00;00"),
     ("01:00:59;29", "30000/1001", 0, "60000/1001", "01:00:59;58"),
     ("01:00:00;00", "30000/1001", 0, 24, "01:00:00:00"), ("noon", 24, 0, 24, "")],
)  # fmt: skip
def test_time_codes_go_on(code, rate, by, to, want):
    assert moved(code, Fraction(rate), Fraction(by), Fraction(to)) == want


def coded(path, codec="libx264", tick=clips.TICK):
    def add(container):
        container.streams.video[0].metadata["timecode"] = "01:02:03:04"

    return clips.write(path, before=add, codec=codec, tick=tick)


def time_code(path) -> str:
    with av.open(str(path)) as container:
        texts = {k.lower(): v for k, v in container.streams.video[0].metadata.items()}
    return texts.get("timecode", "")


@pytest.mark.parametrize("to", ["mov", "mp4", "mkv", "webm"])
@pytest.mark.parametrize("kind", ["mov", "mkv", "mxf"])
def test_a_time_code_comes_along(tmp_path, kind, to):
    codec, tick = ("mpeg2video", Fraction(1, 24)) if kind == "mxf" else ("libx264", clips.TICK)
    source, path = coded(tmp_path / f"a.{kind}", codec, tick), tmp_path / f"b.{to}"
    report = blur_video(source, path, flow="none", begin=0.25, fps=48)
    is_said = "its time code (01:02:03:04) is not kept" in report.left_out
    assert is_said == (to == "webm")
    assert time_code(path) == ("" if to == "webm" else "01:02:03:20")
    assert not any("data" in line or "time code)" in line for line in report.left_out)


@pytest.mark.parametrize("to", ["mov", "mp4", "mkv"])
def test_a_time_code_is_kept_with_segments(tmp_path, to):
    source = coded(tmp_path / "a.mov")
    report = blur_video(source, tmp_path / f"b.{to}", flow="none", resume=True)
    assert time_code(tmp_path / f"b.{to}") == "01:02:03:04" and not report.left_out
    got = VideoReader(tmp_path / f"b.{to}")
    assert len(got) == 12 and got.rate == clips.RATE
    for (_, ours), (_, theirs) in zip(got, VideoReader(source), strict=True):
        levels = ours.planes[0] / 2.0 ** (got.coding.bits - 8)
        np.testing.assert_allclose(levels, theirs.planes[0], atol=9)


def test_a_time_code_is_not_kept_at_another_speed(tmp_path):
    source, said = coded(tmp_path / "a.mov"), "its time code (01:02:03:04) is not kept"
    report = blur_video(source, tmp_path / "c.mov", flow="none", speed=0.5)
    assert said in report.left_out


@pytest.mark.fast
@pytest.mark.parametrize(
    ("line", "want"),
    [("Data: bin_data (gpmd / 0x646D7067), 29 kb/s", "telemetry of GoPro"),
     ("Data: none (tmcd / 0x64636D74), 0 kb/s", "time code"),
     ("Data: klv (KLVA / 0x41564C4B)", "telemetry (KLV)"),
     ("Data: none (abcd / 0x64636261)", "abcd"),
     ("Data: bin_data (text / 0x74786574)", "text"), ("Data: none", "")],
)  # fmt: skip
def test_data_has_a_name(line, want):
    assert _read(f"[0x3](eng): {line}\n  Metadata: 1").kind == want


def test_streams_of_data_are_named(tmp_path, capsys):
    def add(container):
        container.add_data_stream("klv")

    def after(container):
        packet = av.Packet(b"\x06\x0e+4" + bytes(16))
        packet.stream, packet.time_base = container.streams[1], Fraction(1, 1000)
        packet.pts = packet.dts = 0
        container.mux(packet)

    source = clips.write(tmp_path / "a.ts", before=add, also=after)
    (data,) = VideoReader(source).streams
    assert (data.kind, data.text) == ("data", "telemetry (KLV)")
    report = blur_video(source, tmp_path / "b.mp4", flow="none")
    assert report.left_out == ["stream 1 (telemetry (KLV)) is left out"]


def element(number: int, content: bytes) -> bytes:
    return number.to_bytes(2) + bytes([0x80 | len(content)]) + content


SPHERES = {
    "whole": element(0x7671, b"\x01"),
    "turned": element(0x7671, b"\x01") + element(0x7673, struct.pack(">f", 30.0)),
    "part": element(0x7671, b"\x01") + element(0x7672, struct.pack(">5I", 0, 99, 88, 7, 6)),
    "cube": element(0x7671, b"\x02") + element(0x7672, struct.pack(">3I", 0, 0, 5)),
}


SHAPES = {"whole": "360", "turned": "360", "part": "part of a sphere", "cube": "360 degrees (cube)"}


@pytest.mark.parametrize("kind", ["mkv", "mp4"])
@pytest.mark.parametrize(
    ("to", "codec"),
    [
        ("mkv", "h264"),
        ("mp4", "h264"),
        pytest.param("mp4", "av1", marks=pytest.mark.full),
        ("mkv", "ffv1"),
        pytest.param("webm", "vp9", marks=pytest.mark.full),
    ],
)
@pytest.mark.parametrize("sphere", SPHERES)
def test_360_degrees_are_kept(tmp_path, sphere, kind, to, codec):
    source = matroska(tmp_path / "a.mkv", (0x7670, SPHERES[sphere]))
    wanted = VideoReader(source).projection
    assert wanted is not None
    if kind == "mp4":
        blur_video(source, tmp_path / "a.mp4", flow="none")
        source = tmp_path / "a.mp4"
    path = tmp_path / f"b.{to}"
    report = blur_video(source, path, flow="none", codec=codec, resume=codec == "h264")
    assert report.left_out == []
    reader = VideoReader(path)
    assert reader.projection == wanted
    assert dict(describe_video(reader))["sphere"].startswith(SHAPES[sphere])
    assert len(list(reader)) == len(VideoReader(source)) == 8 and not reader.loss()


@pytest.mark.parametrize("mode", ["left_right", "top_bottom", "right_left", "row_interleaved_lr"])
@pytest.mark.parametrize("to", ["mkv", "mp4", "mov", "gif"])
def test_two_views_are_kept_or_said(tmp_path, mode, to):
    def setup(stream):
        stream.metadata["stereo_mode"] = mode

    source = matroska(tmp_path / "a.mkv", setup=setup)
    report = blur_video(source, tmp_path / f"b.{to}", flow="none")
    is_held = to == "mkv" or (to == "mp4" and mode in ("left_right", "top_bottom"))
    said = f"its stereo layout ({mode.replace('_', ' ')}) is not kept (.mkv holds most)"
    assert (said in report.left_out) != is_held
    views = dict(describe_video(VideoReader(source)))["views"]
    assert views == f"two in a picture: {mode.replace('_', ' ')}"
    reader = VideoReader(tmp_path / f"b.{to}")
    assert len(list(reader)) == 8
    if is_held:
        assert stereo_mode(reader.facts) == mode
        again = tmp_path / "c.mkv"
        blur_video(tmp_path / f"b.{to}", again, flow="none", resume=True)
        assert stereo_mode(VideoReader(again).facts) == mode


def test_a_projection_and_two_views_go_through_pipes_or_are_said(tmp_path, device):
    def setup(stream):
        stream.metadata["stereo_mode"] = "top_bottom"

    def piped(source, output, codec=None, stdout=None):
        request = VideoRequest(video=VideoSettings(flow="none", codec=codec))
        return blur_pipe(
            source, OutputSettings(output=str(output)), request, stdout=stdout, device=device
        )

    source = matroska(
        tmp_path / "a.mkv", (0x7670, SPHERES["turned"]), setup=setup, tags=(1, 9, 16, 9)
    )
    stated = VideoReader(source).facts
    assert stated.projection is not None and stereo_mode(stated) == "top_bottom"
    said = piped(source, STDOUT, stdout=io.BytesIO()).left_out
    assert [line.split(";")[0] for line in said] == [
        "YUV4MPEG2 does not state colours, so players may show wrong ones",
        "its projection (360 degrees) is not kept (.mkv and .mp4 hold most)",
        "its stereo layout (top bottom) is not kept (.mkv holds most)",
    ]
    kept = io.BytesIO()
    assert piped(source, STDOUT, "ffv1", kept).left_out == []
    os.mkfifo(tmp_path / "fifo")
    writer = threading.Thread(target=(tmp_path / "fifo").write_bytes, args=(kept.getvalue(),))
    writer.start()
    assert piped(str(tmp_path / "fifo"), tmp_path / "b.mp4").left_out == []
    writer.join()
    reader = VideoReader(tmp_path / "b.mp4")
    assert reader.facts == stated and len(list(reader)) == 8


def test_a_sphere_that_a_container_cannot_hold_is_said(tmp_path):
    source = matroska(tmp_path / "a.mkv", (0x7670, SPHERES["turned"]))
    for to in ("b.mov", "b.gif"):
        report = blur_video(source, tmp_path / to, flow="none")
        assert any("360 degrees" in line for line in report.left_out)


def animated(path, kind):
    """Four pictures that are transparent at the left."""
    alpha = np.tile(np.arange(64, dtype=np.uint8) * 4, (48, 1))
    images = [
        Image.fromarray(np.dstack([np.full((48, 64), 60 * n, np.uint8)] * 3 + [alpha]))
        for n in range(4)
    ]
    images[0].save(path, kind, save_all=True, append_images=images[1:], duration=100)
    return path


def test_an_animated_png_is_a_video_whatever_its_name(tmp_path):
    path = animated(tmp_path / "a.png", "PNG")
    assert is_video(path)
    still = tmp_path / "b.png"
    Image.new("RGB", (8, 8)).save(still)
    assert not is_video(still) and not is_video(tmp_path / "none.png")
    assert main(["blur", str(path), "-o", str(tmp_path / "c.mov"), "--flow", "none"]) == 0
    reader = VideoReader(tmp_path / "c.mov")
    assert len(reader) == 4 and reader.coding.alpha


@pytest.mark.skipif(not features.check("avif"), reason="Pillow without AVIF")
def test_transparency_of_avif_that_is_not_read_is_said(tmp_path):
    path = animated(tmp_path / "a.avif", "AVIF")
    assert "its transparency (a stream of its own, in AVIF) is not read" in VideoReader(path).notes


def test_transparency_that_a_gif_loses_is_said_as_it_is(tmp_path):
    report = blur_video(animated(tmp_path / "a.apng", "PNG"), tmp_path / "b.gif", flow="none")
    assert any(line.startswith("wgmb writes no transparent GIF") for line in report.left_out)


@pytest.mark.parametrize("to", ["b.mp4", "b.gif", "b.webm"])
def test_a_lost_alpha_is_said_before_the_first_picture(tmp_path, capsys, to):
    path = animated(tmp_path / "a.png", "PNG")

    def refused(*given, **more):
        raise InputError("no picture is made")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("wgmb.run.video.write", refused)
        assert main(["blur", str(path), "-o", str(tmp_path / to), "--flow", "none"]) == 2
    assert "transparen" in capsys.readouterr().err
    assert main(["blur", str(path), "-o", str(tmp_path / to), "--flow", "none"]) == 0
    assert capsys.readouterr().err.count("transparen") == 1
