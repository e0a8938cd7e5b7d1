"""`wgmb blur - -o -`: YUV4MPEG2 through pipes, as the file's, and every way in which one ends."""

import contextlib
import io
import os
import subprocess
import sys
import threading
from fractions import Fraction

import av
import numpy as np
import pytest

import make_clips as clips
from wgmb import InputError
from wgmb.cli.app import main, named
from wgmb.color.coding import CodedPicture, Coding
from wgmb.io.pipes import STDIN, STDOUT
from wgmb.run.pipe import reader_of
from wgmb.run.video import VideoRequest, blur_video
from wgmb.video.read.reader import VideoReader
from wgmb.video.read.stream_reader import StreamReader
from wgmb.video.y4m import Y4mReader, Y4mWriter, planes_of, space_of

SIZE = 64, 48
ENVIRONMENT = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def wgmb(*words, data=b"", **more):
    line = [sys.executable, "-m", "wgmb", "blur", *map(str, words)]
    return subprocess.run(line, input=data, capture_output=True, timeout=120, env=ENVIRONMENT,
                          **more)  # fmt: skip


class Bytes(io.BytesIO):
    """A stream that takes what it is given."""


def stream(pictures, coding, rate=Fraction(24), space="", size=SIZE):
    out = Bytes()
    writer = Y4mWriter(out, size, rate, coding, space)
    for picture in pictures:
        writer.add(picture)
    return out.getvalue()


CODINGS = [
    Coding(matrix=6, primaries=6),
    Coding(bits=10, steps=(2, 1), matrix=6, primaries=6),
    Coding(bits=16, steps=(1, 1), matrix=6, primaries=6),
    Coding(steps=(4, 1), matrix=6, primaries=6),
    Coding(steps=(1, 2), matrix=6, primaries=6, full_range=True),
    Coding(steps=(1, 1), matrix=6, primaries=6, alpha=True),
    Coding("grey", bits=12, steps=(1, 1), matrix=6, primaries=6),
]


@pytest.mark.fast
@pytest.mark.parametrize("size", [SIZE, (37, 5), (1, 1)])
@pytest.mark.parametrize("coding", CODINGS, ids=space_of)
def test_what_is_written_is_read(coding, size):
    rng, kind = np.random.default_rng(1), np.uint16 if coding.bits > 8 else np.uint8
    pictures = [
        CodedPicture(
            tuple(rng.integers(0, 2**coding.bits, s).astype(kind) for s in planes_of(size, coding)),
            coding,
        )
        for _ in range(3)
    ]
    data = stream(pictures, coding, Fraction(30000, 1001), size=size)
    reader = Y4mReader(io.BytesIO(data), "stdin")
    assert (reader.size, reader.rate, reader.coding) == (size, Fraction(30000, 1001), coding)
    for (_, ours), want in zip(reader.pictures(), pictures, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(ours.planes, want.planes, strict=True))
    assert reader.loss == ""


@pytest.mark.fast
def test_ffmpeg_reads_what_is_written_and_the_other_way_round(tmp_path):
    path = clips.write(tmp_path / "c.y4m", codec="rawvideo", kind="yuv4mpegpipe")
    data = path.read_bytes()
    reader = Y4mReader(io.BytesIO(data), "stdin")
    pictures = [picture for _, picture in reader.pictures()]
    for number, picture in enumerate(pictures):
        for ours, want in zip(picture.planes, clips.planes(number), strict=True):
            np.testing.assert_array_equal(ours, want)
    (tmp_path / "d.y4m").write_bytes(stream(pictures, reader.coding))
    with av.open(str(tmp_path / "d.y4m")) as file:
        assert file.streams.video[0].average_rate == 24
        for n, frame in enumerate(file.decode(video=0)):
            np.testing.assert_array_equal(frame.to_ndarray()[:48], clips.planes(n)[0])


@pytest.mark.fast
@pytest.mark.parametrize("data, said", [
    (b"", "stdin: holds no pictures"),
    (b"\x00\x00\x00\x20ftypisom", "stdin: is not YUV4MPEG2, which `ffmpeg"),
    (b"YUV4MPEG2 H4 F24:1\n", "stdin: its header lacks a size"),
    (b"YUV4MPEG2 W4 H0 F24:1\n", "stdin: its header lacks a size"),
    (b"YUV4MPEG2 W99999 H4 F24:1\n", "stdin: pictures of 99999 x 4"),
    (b"YUV4MPEG2 W30000 H30000 F24:1\n", "stdin: image of 30000 x 30000 .* `max_mb="),
    (b"YUV4MPEG2 W4 H4 F24\n", "stdin: its header has the ratio '24'"),
    (b"YUV4MPEG2 W4 H4 F24:1 It\n", "stdin: is interlaced"),
    (b"YUV4MPEG2 W4 H4 F24:1 C420p11\n", "samples of the kind '420p11' are not read"),
])  # fmt: skip
def test_a_header_that_is_none_is_one_line(data, said):
    with pytest.raises(InputError, match=said) as error:
        Y4mReader(io.BytesIO(data), "stdin")
    assert "\n" not in str(error.value)


@pytest.mark.fast
def test_what_is_cut_off_says_where():
    pictures = [CodedPicture(clips.planes(n), CODINGS[0]) for n in range(4)]
    data = stream(pictures, CODINGS[0])
    length = (len(data) - data.index(b"FRAME")) // 4
    for cut, whole, said in (
        (100, 3, "stdin: is cut off in picture 3"),
        (length - 3, 3, "stdin: is cut off in picture 3"),
        (length, 3, ""),
    ):
        reader = Y4mReader(io.BytesIO(data[:-cut]), "stdin")
        assert len(list(reader.pictures())) == whole
        assert reader.loss == said
    bad = data[:-length] + b"FRUIT" + data[5 - length :]
    reader = Y4mReader(io.BytesIO(bad), "stdin")
    assert len(list(reader.pictures())) == 3
    assert reader.loss == "stdin: is damaged before picture 3"


@pytest.mark.fast
def test_a_dash_is_a_stream():
    words = ["blur", "-", "-o", "-", "--fps", "60", "--output=-", "-q"]
    got = ["blur", STDIN, "-o", STDOUT, "--fps", "60", f"--output={STDOUT}", "-q"]
    assert named(words) == got


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    return clips.write(tmp_path_factory.mktemp("in") / "c.avi", codec="ffv1")


@pytest.fixture(scope="module")
def piped(source):
    reader = VideoReader(source)
    return stream([picture for _, picture in reader], reader.coding)


@pytest.mark.parametrize("flow", ["none", pytest.param("dis", marks=pytest.mark.full)])
def test_a_pipe_gives_the_pictures_of_the_file(source, piped, tmp_path, flow):
    blur_video(source, tmp_path / "o.mkv", codec="ffv1", fps=60, flow=flow)
    want = [picture.planes for _, picture in VideoReader(tmp_path / "o.mkv")]
    done = wgmb("-", "-o", "-", "--fps", 60, "--flow", flow, data=piped)
    assert done.returncode == 0
    reader = Y4mReader(io.BytesIO(done.stdout), "stdout")
    assert reader.rate == 60
    got = [picture.planes for _, picture in reader.pictures()]
    assert len(got) == len(want) == 30
    for ours, theirs in zip(got, want, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(ours, theirs, strict=True))
    header = done.stdout.index(b"\n") + 1
    assert len(done.stdout) == header + 30 * (6 + SIZE[0] * SIZE[1] * 3 // 2)
    said = done.stderr.decode().splitlines()
    assert said[-1] == "30 frames -> stdout"
    (stated,) = [line for line in said if line.startswith("stdin: does not state its colours")]
    assert "--color-in" in stated


@pytest.mark.full
def test_one_side_may_be_a_file(source, piped, tmp_path):
    done = wgmb(source, "-o", "-", "--flow", "none", "-q")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.split(b"\n", 1)[1] == piped.split(b"\n", 1)[1]
    out = tmp_path / "o.mkv"
    done = wgmb("-", "-o", out, "--codec", "ffv1", "--flow", "none", "-q", data=done.stdout)
    assert (done.returncode, done.stderr) == (0, b"")
    for (_, ours), (_, want) in zip(VideoReader(out), VideoReader(source), strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(ours.planes, want.planes, strict=True))
    done = wgmb("-", "-o", out, "--flow", "none", "-q", data=piped)
    assert done.returncode == 2 and b"--overwrite replaces it" in done.stderr


def test_named_pipes_and_two_in_a_row(piped, tmp_path):
    for name in ("a", "b", "c"):
        os.mkfifo(tmp_path / name)
    writer = threading.Thread(target=(tmp_path / "a").write_bytes, args=(piped,))
    writer.start()
    line = [sys.executable, "-m", "wgmb", "blur"]
    words = [["a", "-o", "b"], ["b", "-o", "c"]]
    running = [
        subprocess.Popen([*line, *w, "--flow", "none", "-q"], cwd=tmp_path, env=ENVIRONMENT)
        for w in words
    ]
    got = (tmp_path / "c").read_bytes()
    writer.join()
    assert [process.wait(60) for process in running] == [0, 0]
    assert got.split(b"\n", 1)[1] == piped.split(b"\n", 1)[1]


def test_an_empty_pipe_is_one_line():
    done = wgmb("-", "-o", "-")
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr == b"wgmb: stdin: holds no pictures\n"


@pytest.mark.fast
@pytest.mark.parametrize("data, said", [
    (b"garbage" * 90, "stdin: is not a video that can be read from"),
    (b"YUV4MPEG2 rubbish\n", "stdin: its header lacks a size"),
    (b"\0\0\0\x20ftypisom" + bytes(90), "-movflags frag_keyframe"),
    (b"ffconcat version 1.0\nfile in.mkv\n", "stdin: is not a video"),
])  # fmt: skip
def test_what_is_no_video_is_one_line(data, said):
    with pytest.raises(InputError, match=said) as error:
        reader_of(Unseekable(data), "stdin", VideoRequest())
    assert "\n" not in str(error.value)


@pytest.mark.fast
@pytest.mark.parametrize("words, said", [
    ("- -o out.####.png", "a pipe becomes a pipe (-) or a video"),
    ("- -o out.y4m", "a pipe becomes a pipe (-) or a video"),
    ("- -o out.mkv --codec gif", "gif goes into .gif"),
    ("- -o - --codec h264", "--codec into a pipe is ffv1"),
    ("- -o - --quality 9", "--quality and --encoder are for files"),
    ("- -o - --codec ffv1 --quality 9", "ffv1 has no quality"),
    ("- -o - --resume", "--resume needs files"),
    ("- -o - --begin 1", "--begin is for files"),
    ("- -o - --frames 1-9", "--frames is for files"),
    ("- -o - --holdout static", "--holdout of a video is for files"),
    ("- x -o -", "a pipe must be the only input"),
])  # fmt: skip
def test_what_a_pipe_cannot_is_one_line_before_anything_is_opened(words, said, capfd, monkeypatch):
    monkeypatch.setattr("wgmb.gpu.open_device", None)
    assert main(["blur", *words.split()]) == 2
    out, err = capfd.readouterr()
    assert said in err and err.count("\n") == 1 and out == ""


@pytest.mark.fast
@pytest.mark.parametrize("which", [0, 1])
def test_a_terminal_is_neither_end(which, capfd, monkeypatch):
    monkeypatch.setattr("os.isatty", lambda number: number == which)
    assert main(["blur", "-", "-o", "-"]) == 2
    name = ("input", "output")[which]
    assert capfd.readouterr().err.startswith(f"wgmb: standard {name} is a terminal; ")


@pytest.mark.parametrize("kind, codec", [
    ("matroska", "ffv1"), ("nut", "rawvideo"), ("mpegts", "libx264"), ("mp4", "libx264")
])  # fmt: skip
def test_whatever_ffmpeg_reads_without_seeking_goes_in(kind, codec, tmp_path):
    tags = (1, 9, 16, 9)  # limited BT.2020 with PQ
    muxing = {"movflags": "frag_keyframe+empty_moov"} if kind == "mp4" else {}
    path = clips.write(tmp_path / "in", codec=codec, kind=kind, tags=tags, muxing=muxing, tone=0.5)
    reader = StreamReader(Unseekable(path.read_bytes()), "stdin")
    assert (reader.size, reader.rate) == (SIZE, 24)
    got = list(reader.pictures())
    assert [number for number, _ in got] == list(range(12)) and reader.loss == ""
    for (_, ours), (_, want) in zip(got, VideoReader(path), strict=True):
        assert kind == "nut" or (ours.coding.matrix, ours.coding.transfer) == (9, 16)
        assert all(np.array_equal(a, b) for a, b in zip(ours.planes, want.planes, strict=True))
    assert any("left out: audio" in note for note in reader.notes)


class Unseekable(io.BufferedReader):
    def __init__(self, data):
        super().__init__(io.BytesIO(data))

    def seekable(self):
        return False

    def seek(self, *where):
        raise io.UnsupportedOperation


@pytest.mark.full
def test_matroska_goes_out_with_its_colours_and_bits(tmp_path):
    tags = (1, 9, 16, 9)
    frames = [clips.frame(clips.planes(n, bits=10), "yuv420p10le") for n in range(5)]
    path = clips.write(tmp_path / "in.mkv", frames, codec="ffv1", pixels="yuv420p10le", tags=tags)
    done = wgmb("-", "-o", "-", "--codec", "ffv1", "--flow", "none", data=path.read_bytes())
    assert done.returncode == 0 and b"does not state its colours" not in done.stderr
    (tmp_path / "out.mkv").write_bytes(done.stdout)
    blur_video(path, tmp_path / "file.mkv", codec="ffv1", flow="none")
    ours, want = VideoReader(tmp_path / "out.mkv"), VideoReader(tmp_path / "file.mkv")
    assert ours.coding == want.coding == VideoReader(path).coding
    assert (ours.coding.bits, ours.rate) == (10, 24)
    for (_, a), (_, b) in zip(ours, want, strict=True):
        assert all(np.array_equal(x, y) for x, y in zip(a.planes, b.planes, strict=True))
    again = StreamReader(Unseekable(done.stdout), "stdin", "bt709")
    assert (again.coding.matrix, again.coding.transfer, again.coding.primaries) == (1, 1, 1)


def test_what_a_file_has_besides_its_pictures_is_said(tmp_path):
    path = clips.write(tmp_path / "a.mkv", tone=0.3)
    done = wgmb(path, "-o", "-", "--flow", "none")
    assert b"only its pictures go through a pipe; left out: audio\n" in done.stderr


def test_what_a_file_has_lost_is_said_as_without_a_pipe(tmp_path):
    path = clips.write(tmp_path / "a.mkv", codec="ffv1")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    plain = VideoReader(path)
    assert len(list(plain)) < 12 and plain.loss()
    done = wgmb(path, "-o", "-", "--flow", "none", "--duplicates", "fill")
    assert done.returncode == 1 and plain.loss() in done.stderr.decode()
    assert b"no repeated picture found\n" in done.stderr


def test_a_stream_of_uneven_times_is_refused_and_pauses_leave_places(tmp_path):
    frames = [clips.frame(clips.planes(n), "yuv420p") for n in range(6)]

    def stream_at(times, **more):
        path = clips.write(tmp_path / "t.mkv", frames, times, codec="ffv1")
        return StreamReader(Unseekable(path.read_bytes()), "stdin", **more)

    even = [Fraction(n, 24) for n in (0, 1, 2, 3, 6, 7)]
    assert [n for n, _ in stream_at(even).pictures()] == [0, 1, 2, 3, 6, 7]
    seldom = [Fraction(n) / 24 for n in (0, 1.5, 2.5, 3.5, 4.5, 5.5)]
    assert [n for n, _ in stream_at(seldom).pictures()] == list(range(6))
    uneven = [Fraction(n) / 24 for n in (0, 1.5, 2, 3.5, 4, 5)]
    with pytest.raises(InputError, match=r"picture 3 follows after 6.\.. ms, at 2.* `fps_in`"):
        list(stream_at(uneven).pictures())
    assert [n for n, _ in stream_at(uneven, keeps_time=False).pictures()] == list(range(6))
    with pytest.raises(InputError, match=r"nothing for 0 s after picture 3; `longest_pause=1`"):
        list(stream_at(even, pause=0.1).pictures())
    one = clips.write(tmp_path / "one.ts").read_bytes()
    with pytest.raises(InputError, match=r"stdin: its clock goes back by 0\.46 s after picture 11"):
        list(StreamReader(Unseekable(2 * one), "stdin").pictures())


def test_matroska_that_is_cut_off_or_damaged_is_said(tmp_path):
    path = clips.write(tmp_path / "a.mkv", codec="ffv1", options={"slicecrc": "1", "level": "3"})
    data = path.read_bytes()
    reader = StreamReader(Unseekable(data[: len(data) * 2 // 3]), "stdin")
    count = len(list(reader.pictures()))
    assert 5 < count < 11 and "stdin: is " in reader.loss, reader.loss
    data = clips.write(tmp_path / "b.mkv").read_bytes()
    middle = len(data) // 2
    bad = data[:middle] + bytes(40) + data[middle + 40 :]
    reader = StreamReader(Unseekable(bad), "stdin")
    assert len(list(reader.pictures())) == 12
    assert reader.loss == "stdin: 1 damaged picture"


def test_exceptions_of_the_stream_arrive_unchanged(tmp_path):
    data = clips.write(tmp_path / "a.mkv", codec="ffv1").read_bytes()

    class Broken(Unseekable):
        def read(self, count=-1):
            if self.tell() > len(data) // 2:
                raise KeyboardInterrupt
            return super().read(min(count, 500))

    with pytest.raises(KeyboardInterrupt):
        list(StreamReader(Broken(data), "stdin").pictures())


def test_the_shape_of_pixels_goes_through(piped, tmp_path):
    out, aspect = Bytes(), Fraction(16, 11)
    Y4mWriter(out, SIZE, Fraction(24), CODINGS[0], aspect=aspect)
    assert Y4mReader(io.BytesIO(out.getvalue()), "stdin").facts.pixel_aspect == aspect
    wide = piped.replace(b"A1:1", b"A16:11", 1)
    done = wgmb("-", "-o", tmp_path / "o.mp4", "--flow", "none", "-q", data=wide)
    assert done.returncode == 0 and VideoReader(tmp_path / "o.mp4").pixel_aspect == aspect


def test_a_stream_that_ends_early_is_blurred_so_far_and_said(piped):
    done = wgmb("-", "-o", "-", "--flow", "none", "-q", data=piped[:-50])
    assert done.returncode == 1
    assert done.stderr == b"wgmb: stdin: is cut off in picture 11\n"
    assert len(list(Y4mReader(io.BytesIO(done.stdout), "stdout").pictures())) == 11
    done = wgmb("-", "-o", "-", "-q", data=piped.replace(b"F24:1", b"F0:0", 1))
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr == b"wgmb: stdin: does not say its rate; set --fps-in\n"


def test_a_reader_that_goes_away_is_one_line(piped):
    header, frames = piped.split(b"\n", 1)
    many = header + b"\n" + frames * 40
    line = [sys.executable, "-m", "wgmb", "blur", "-", "-o", "-", "--flow", "none", "-q"]
    pipe = subprocess.PIPE
    process = subprocess.Popen(line, stdin=pipe, stdout=pipe, stderr=pipe, env=ENVIRONMENT)

    def feed():
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(many)
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()

    writer = threading.Thread(target=feed)
    writer.start()
    process.stdout.read(20_000)
    process.stdout.close()
    with process.stderr as err:
        said = err.read().decode()
    assert process.wait(60) == 1
    writer.join()
    assert said.startswith("wgmb: the reader closed the pipe after ") and said.count("\n") == 1
