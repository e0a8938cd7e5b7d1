"""Files that may come under a video's name: lists of other files, views, pauses of years, links."""

import contextlib
import itertools
import os
import subprocess
import sys
import tracemalloc
from fractions import Fraction

import av
import numpy as np
import pytest
from file_lists import LISTS, refer
from watched import Watched

from wgmb import InputError, blur_video
from wgmb.color.coding import Coding
from wgmb.run.video import VideoRequest
from wgmb.settings import OutputSettings
from wgmb.settings.video import VideoSettings
from wgmb.video.clock import Clock, tick
from wgmb.video.output_times import OutputFrames
from wgmb.video.read.container import READERS
from wgmb.video.read.reader import VideoReader
from wgmb.video.write.encoders import chosen
from wgmb.video.write.format import VideoFormat
from wgmb.video.write.segments import Segments


def write(path, times, size=(32, 32), pixels="yuv420p", codec="ffv1"):
    """A video with a picture at each time [ms]."""
    with av.open(str(path), "w") as file:
        stream = file.add_stream(codec, rate=24)
        stream.width, stream.height, stream.pix_fmt = *size, pixels
        stream.codec_context.time_base = Fraction(1, 1000)
        for n, time in enumerate(times):
            array = np.full((size[1], size[0], 3), 40 * (n % 6), np.uint8)
            frame = av.VideoFrame.from_ndarray(array, "rgb24").reformat(format=pixels)
            frame.pts, frame.time_base = time, Fraction(1, 1000)
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
    return path


@pytest.mark.parametrize("suffix", [".mp4", ".m3u8", ".mkv", ".sdp", ".avi"])
@pytest.mark.parametrize("kind", LISTS)
def test_a_list_of_files_is_no_video(tmp_path, kind, suffix):
    other = write(tmp_path / "other.mkv", [0, 42, 84])
    listed = tmp_path / f"list{suffix}"
    listed.write_text(LISTS[kind].format(name=other.name, path=other))
    with pytest.raises(InputError, match=rf"list\{suffix}: is (a list of other files|no|not)"):
        VideoReader(listed)


def test_readers_are_those_of_the_library_that_read_one_file():
    known = {name for names in av.formats_available for name in names.split(",")}
    readers = set(READERS.split(","))
    assert readers <= known
    # Every reader of FFmpeg that opens what a file names, runs a script or uses a device.
    assert not readers & {
        "aax", "alias_pix", "avisynth", "concat", "dash", "fbdev", "ffmetadata", "hls", "image2",
        "imf", "kmsgrab", "lavfi", "mlv", "rtp", "rtsp", "sdp", "tedcaptions", "vapoursynth",
        "video4linux2", "v4l2", "vobsub", "webm_dash_manifest", "x11grab",
    }  # fmt: skip


@pytest.fixture
def other(tmp_path):
    """A video, and whether anybody opens it."""
    path = write(tmp_path / "other.mov", [0, 42, 84], codec="mjpeg", pixels="yuvj420p")
    watched = Watched(path)
    yield path, watched.was_opened
    watched.close()


READABLE = sorted({name for names in av.formats_available for name in names.split(",")})


@pytest.mark.parametrize("kind", [pytest.param(k, marks=pytest.mark.full) for k in LISTS] + [None])
def test_no_reader_of_the_library_opens_what_a_text_names(tmp_path, other, kind):
    """FFmpeg chooses by what a file is called, too. None: each reader takes another list."""
    path, was_opened = other
    lists, tried = itertools.cycle([kind] if kind else LISTS), 0
    for reader in READABLE:
        with contextlib.suppress(ValueError):  # only written
            known = av.ContainerFormat(reader, "r").extensions
            listed = tmp_path / f"list.{next(iter(sorted(known)), reader)}"
            listed.write_text(LISTS[next(lists)].format(name=path.name, path=path))
            with pytest.raises(InputError) as refused:
                VideoReader(listed)
            assert str(refused.value).startswith(f"{listed}: ")
            assert "\n" not in str(refused.value)
            assert not was_opened(), (reader, listed)
            tried += 1
    assert tried > 300


def test_a_film_opens_no_other_that_it_refers_to(tmp_path, other):
    path, was_opened = other
    film = tmp_path / "film.mov"
    film.write_bytes(refer(path.read_bytes(), path.name))
    assert was_opened()
    with av.open(str(film), container_options={"enable_drefs": "1"}) as file:
        assert was_opened()  # where it is allowed to
        assert len(list(file.decode(video=0))) == 3
    with pytest.raises(InputError, match=r"film\.mov: "):
        VideoReader(film)
    assert not was_opened()


def test_a_picture_named_as_one_of_many_opens_no_other(tmp_path):
    """`image2` takes %d for a number, where FFmpeg is allowed to."""
    for n in range(3):
        (tmp_path / f"p{n}.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    path = tmp_path / "p%d.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(InputError, match=r"p%d\.png"):
        VideoReader(path)


def test_a_list_neither_hangs_nor_is_written_over(tmp_path):
    (tmp_path / "live.m3u8").write_text(LISTS["hls without an end"].format(name="secret.ts"))
    (tmp_path / "in.mp4").write_text("ffconcat version 1.0\nfile live.m3u8\n")
    done = subprocess.run(
        [sys.executable, "-m", "wgmb", "info", "in.mp4"],
        cwd=tmp_path, capture_output=True, text=True, timeout=60,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("wgmb: in.mp4: is a list of other files")


def test_a_pause_of_a_day_is_refused_by_its_length(tmp_path):
    path = write(tmp_path / "day.mkv", [0, 42, 84, 126, 86_400_000])
    with pytest.raises(InputError, match=r"a pause of 86,400 s after 0.13 s.*longest_pause=86400"):
        blur_video(path, tmp_path / "o.mp4", fps=60, flow="none")
    blur_video(path, tmp_path / "o.mp4", fps=60, flow="none", end=0.2)
    hour = write(tmp_path / "hour.mkv", [0, 42, 84, 126, 3_600_000])
    blur_video(hour, tmp_path / "p.mp4", fps=1 / 60, flow="none", longest_pause=3600)
    assert len(VideoReader(tmp_path / "p.mp4")) in (60, 61)
    with pytest.raises(InputError, match="`longest_pause` must be above 0 seconds, got 0"):
        blur_video(path, tmp_path / "q.mp4", longest_pause=0)


def test_frames_at_the_times_of_the_pictures_do_not_fill_a_pause(tmp_path):
    path = write(tmp_path / "day.mkv", [0, 42, 84, 126, 86_400_000])
    reader = VideoReader(path)
    clock = Clock(reader.times[0], Fraction(1), Fraction(0), None, None)
    assert len(OutputFrames(reader, clock, None, 600)) <= 6


def test_output_frames_of_short_pauses_are_not_listed(tmp_path):
    """Each pause is allowed; together they are 100 million frames."""
    path = write(tmp_path / "lots.mkv", [590_000 * n for n in range(200)])
    run = VideoRequest(video=VideoSettings(flow="none")).open()
    tracemalloc.start()
    plan = run.plan(path, OutputSettings(output=str(tmp_path / "o.mp4"), fps="1000"))
    assert len(plan.wanted) > 100_000_000
    assert plan.wanted.times[-1] - plan.wanted.times[0] > 117_000
    assert plan.wanted.tick == Fraction(1, 1000)
    path, tick = tmp_path / "o.mp4", plan.wanted.tick
    form = VideoFormat(chosen(path), Coding(), (32, 32), Fraction(1000), tick)
    segments = Segments(path, form, plan.wanted.times, {})
    assert len(segments.to_do()) > 10_000
    segments.release()
    assert tracemalloc.get_traced_memory()[1] < 20 << 20
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("suffix", "holds", "longest"),
    [(".mp4", 170_000, "178,956"), (".mov", 170_000, "178,956"), (".gif", 600, "655")],
)
def test_what_a_container_can_hold_between_pictures_is_said(tmp_path, suffix, holds, longest):
    """FFmpeg ended with "Invalid argument", or wrote the times as one tick, 11 minutes, ..."""
    for pause in (holds, 1_000_000):
        path = write(tmp_path / "in.mkv", [0, 42, 84, 1000 * pause, 1000 * pause + 42])
        to = tmp_path / f"o{suffix}"
        more = {"flow": "none", "longest_pause": 1e9, "fps": "source", "overwrite": True}
        if pause == holds:
            blur_video(path, to, **more)
            assert float(VideoReader(to).times[3]) == pytest.approx(pause, rel=1e-3)
            continue
        with pytest.raises(InputError) as error:
            blur_video(path, to, **more)
        assert f"{suffix} holds at most {longest} s from one picture" in str(error.value)
        assert "got 1,000,000 s; .mkv holds more" in str(error.value)
    blur_video(path, tmp_path / "o.mkv", **more)
    assert float(VideoReader(tmp_path / "o.mkv").times[3]) == 1_000_000


@pytest.mark.parametrize("fps", [None, Fraction(30)])
def test_output_frames_have_a_key_of_their_own(tmp_path, fps):
    reader = VideoReader(write(tmp_path / "in.mkv", [0, 42, 84, 126, 170, 201]))
    clocks = [Clock(), Clock(speed=Fraction(2)), Clock(end=Fraction(1, 10)), Clock(Fraction(1, 9))]
    keys = {OutputFrames(reader, clock, fps).key for clock in clocks}
    assert len(keys) == len(clocks)
    assert OutputFrames(reader, clocks[0], fps).key in keys
    frames = OutputFrames(reader, clocks[1], fps)
    assert list(frames.times) == [frame.time for frame in frames]
    assert frames.tick == tick(*frames.times, frames[0].interval)
    assert frames.times[1:3] == [frame.time for frame in frames[1:3]]


def test_pictures_a_million_seconds_apart_have_a_rate(tmp_path):
    reader = VideoReader(write(tmp_path / "two.mkv", [0, 1_002_001_000_000]))
    assert 0 < reader.rate < Fraction(1, 1_000_000)


@pytest.mark.parametrize("to", ["mask.png", "./mask.png", "link.png"])
def test_a_mask_is_never_written_over(tmp_path, to):
    path = write(tmp_path / "in.mkv", [0, 42], codec="ffv1")
    with av.open(str(tmp_path / "mask.png"), "w", format="image2") as file:
        stream = file.add_stream("png", rate=1)
        stream.width, stream.height, stream.pix_fmt = 32, 32, "rgb24"
        image = av.VideoFrame.from_ndarray(np.full((32, 32, 3), 255, np.uint8), "rgb24")
        file.mux(stream.encode(image))
        file.mux(stream.encode(None))
    (tmp_path / "link.png").symlink_to("mask.png")
    before = (tmp_path / "mask.png").read_bytes()
    with pytest.raises(InputError, match="is the input"):
        blur_video(
            path, tmp_path / to, holdout=str(tmp_path / "mask.png"), end=0.03, overwrite=True
        )
    assert (tmp_path / "mask.png").read_bytes() == before


def test_segments_are_not_written_through_a_link(tmp_path):
    path = write(tmp_path / "in.mkv", [0, 42, 84])
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim/00000.mp4").write_text("precious")
    (tmp_path / "o.mp4.segments").symlink_to("victim")
    with pytest.raises(InputError, match=r"o\.mp4\.segments: is a link"):
        blur_video(path, tmp_path / "o.mp4", flow="none", resume=True)
    assert (tmp_path / "victim/00000.mp4").read_text() == "precious"


def test_a_video_that_appears_during_the_run_is_kept(tmp_path):
    path, to = write(tmp_path / "in.mkv", [0, 42, 84]), tmp_path / "o.mp4"

    def progress(number, state):
        to.write_text("of another program")

    with pytest.raises(OSError, match=r"o\.mp4: was written by another process during this run"):
        blur_video(path, to, flow="none", progress=progress)
    assert to.read_text() == "of another program"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in.mkv", "o.mp4"]
    blur_video(path, to, flow="none", progress=progress, overwrite=True)
    assert len(VideoReader(to)) == 3


@pytest.mark.parametrize("pixels", ["gbrp", "yuv420p", "yuv422p", "yuv444p"])
@pytest.mark.parametrize("size", [(1, 1), (1, 6), (6, 1), (3, 5)])
def test_pictures_of_one_sample_of_chroma(tmp_path, pixels, size):
    path = write(tmp_path / "px.nut", [0, 42, 84], size, pixels, "rawvideo")
    blur_video(path, tmp_path / "o.mp4", flow="none")
    found = VideoReader(tmp_path / "o.mp4").size
    assert all(length <= is_now <= length + 1 for length, is_now in zip(size, found, strict=True))
