"""A video in segments goes on after a kill, and is then as if it had been made in one run."""

import os
import signal
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

import make_clips as clips
from wgmb import InputError
from wgmb.color.coding import CodedPicture, Coding
from wgmb.io import leftovers
from wgmb.video.clock import tick
from wgmb.video.hdr10 import LightLevel
from wgmb.video.read.reader import VideoReader
from wgmb.video.write import segments as segmenting
from wgmb.video.write.encoders import Facts, chosen
from wgmb.video.write.format import VideoFormat
from wgmb.video.write.other_streams import OtherStreams
from wgmb.video.write.segments import Segments, remove_left
from wgmb.video.write.writer import VideoWriter

pytestmark = pytest.mark.fast

RATE = Fraction(30000, 1001)
COUNT = 40  # in segments of 15: the last has 10


@pytest.fixture(autouse=True)
def _short(monkeypatch):
    monkeypatch.setattr(segmenting, "SECONDS", Fraction(1, 2))


def picture(number: int, coding: Coding) -> CodedPicture:
    return CodedPicture(clips.planes(number, steps=coding.steps, bits=coding.bits), coding)


def segmented(path, codec=None, times=None, made_of=None, bits=8, facts=None):
    """Segments of a video whose picture n is painted by make_clips."""
    times = times or [n / RATE for n in range(COUNT)]
    encoding = chosen(path, codec)
    coding, _ = encoding.coding(Coding(bits=bits))
    base = tick(*times, 1 / RATE)
    size = clips.WIDTH, clips.HEIGHT
    form = VideoFormat(encoding, coding, size, RATE, base, facts or Facts())
    parts = Segments(path, form, times, made_of or {"a": 1})
    return parts, coding, times


def fill(parts, coding, times, stop=None) -> list[int]:
    """Make what is to do; `stop`: fail after so many pictures. Returns the numbers made."""
    made = []
    for numbers in parts.to_do():
        segment = parts.begin(numbers)
        for n in numbers:
            if stop is not None and len(made) == stop:
                return made  # as after a kill: nothing is closed or abandoned
            segment.add(picture(n, coding), times[n])
            made.append(n)
        segment.close()
    return made


def in_one_run(path, codec, times, bits=8, others=None):
    encoding = chosen(path, codec)
    coding, _ = encoding.coding(Coding(bits=bits))
    size, base = (clips.WIDTH, clips.HEIGHT), tick(*times, 1 / RATE)
    form = VideoFormat(encoding, coding, size, RATE, base)
    video = VideoWriter(path, path.with_name("part"), form, others=others)
    for n, time in enumerate(times):
        video.add(picture(n, coding), time)
    video.close()


KINDS = [("v.mp4", None, 8), ("v.mp4", "h265", 10), ("v.mkv", None, 8), ("v.mkv", "av1", 10),
         ("v.mov", None, 8), ("v.webm", None, 8), ("v.mkv", "ffv1", 8), ("v.mp4", "av1", 8),
         ("v.mkv", "h265", 8), ("v.mp4", "vp9", 8)]  # fmt: skip
VARIABLE = [Fraction(23, 1000) + Fraction(n * n + 40 * n, 1200) for n in range(COUNT)]


@pytest.mark.parametrize(("name", "codec", "bits"), KINDS)
@pytest.mark.parametrize("times", [None, VARIABLE], ids=["steady", "variable"])
def test_segments_are_joined_into_what_one_run_makes(tmp_path, name, codec, bits, times):
    path, other = tmp_path / name, tmp_path / f"one.{name[2:]}"
    parts, coding, times = segmented(path, codec, times, bits=bits)
    assert fill(parts, coding, times) == list(range(COUNT))
    assert parts.to_do() == []
    assert not path.exists()
    assert parts.join() == []
    assert not parts.folder.exists()
    in_one_run(other, codec, times, bits)
    joined, one = VideoReader(path), VideoReader(other)
    assert list(joined.times) == list(one.times)
    assert len(joined) == COUNT
    assert joined.coding == one.coding
    assert joined.codec == one.codec
    for (n, a), (m, b) in zip(joined, one, strict=True):
        assert n == m
        apart = np.abs(a.planes[0].astype(int) - b.planes[0]).mean()
        assert apart < 3 << (a.coding.bits - 8)
    assert joined.missing == one.missing == set()
    with av.open(str(path)) as a, av.open(str(other)) as b:
        assert a.streams.video[0].codec_tag == b.streams.video[0].codec_tag


@pytest.mark.parametrize("stop", [0, 1, 14, 15, 16, 29, 30, 39])
def test_what_was_finished_before_a_kill_is_not_made_again(tmp_path, stop):
    path = tmp_path / "v.mp4"
    parts, coding, times = segmented(path)
    fill(parts, coding, times, stop)
    parts, coding, times = segmented(path)
    whole = stop // 15 * 15
    assert fill(parts, coding, times) == list(range(whole, COUNT))
    parts.join()
    assert [n for n, _ in VideoReader(path)] == list(range(COUNT))


def test_a_process_that_is_killed_leaves_nothing_in_the_way(tmp_path):
    """By SIGKILL, while it encodes the second segment."""
    path, here = tmp_path / "v.mp4", Path(__file__).parent
    script = (
        "import sys, time; sys.path.insert(0, sys.argv[1])\n"
        "import test_segments as t; from fractions import Fraction; from pathlib import Path\n"
        "t.segmenting.SECONDS = Fraction(1, 2)\n"
        "parts, coding, times = t.segmented(Path(sys.argv[2]))\n"
        "t.fill(parts, coding, times, 20); print('now', flush=True); time.sleep(60)\n"
    )
    paths = os.pathsep.join([str(here), *sys.path])
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(here), str(path)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"now\n"
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    parts, coding, times = segmented(path)
    left = {p.name for p in parts.folder.iterdir()}
    assert {"00000.mp4", "00000.json"} < left
    assert parts.to_do() == [range(15, 30), range(30, 40)]
    now = {p.name for p in parts.folder.iterdir()}
    own = {name for name in now if f"-{os.getpid()}-" in name}  # tells others that it is in use
    assert len(own) == 1 and now - own == {"00000.mp4", "00000.json"}
    fill(parts, coding, times)
    parts.join()
    assert list(VideoReader(path).times) == times
    assert [p.name for p in tmp_path.iterdir()] == ["v.mp4"]


def in_folder(parts) -> list[str]:
    return sorted(path.name for path in parts.folder.glob("0*.*"))


@pytest.mark.parametrize("is_recorded", [False, True])
def test_a_run_that_is_ended_keeps_segments_with_records_alone(tmp_path, monkeypatch, is_recorded):
    """A signal may end the run just before a segment has its record, and just after."""
    monkeypatch.setattr(leftovers, "_removals", {})
    monkeypatch.setattr(leftovers, "_is_over", [])
    parts, coding, times = segmented(tmp_path / "o.mkv")
    finished, seen = parts.finished, []

    def ended(index):
        if is_recorded:
            finished(index)
        seen.extend(in_folder(parts))
        leftovers.remove_all(5)  # as a signal does from a thread of its own
        seen.append(in_folder(parts))
        raise KeyboardInterrupt

    monkeypatch.setattr(parts, "finished", ended)
    with pytest.raises(KeyboardInterrupt):
        fill(parts, coding, times)
    both = ["00000.json", "00000.mkv"]
    assert seen == ([*both, both] if is_recorded else ["00000.mkv", []])


def test_a_segment_whose_record_cannot_be_written_is_removed(tmp_path, monkeypatch):
    parts, coding, times = segmented(tmp_path / "o.mkv")

    def full(index):
        assert in_folder(parts) == ["00000.mkv"]
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(parts, "finished", full)
    with pytest.raises(OSError, match="No space"):
        fill(parts, coding, times)
    assert in_folder(parts) == []


def test_segments_of_anything_else_are_made_again(tmp_path):
    path = tmp_path / "v.mp4"
    fill(*segmented(path))
    assert segmented(path)[0].to_do() == []
    assert len(segmented(path, made_of={"a": 2})[0].to_do()) == 3
    assert len(segmented(path, "h265")[0].to_do()) == 3
    facts = Facts(light_level=LightLevel(100, 10))
    assert len(segmented(path, facts=facts)[0].to_do()) == 3
    later = [(n + (n > 20)) / RATE for n in range(COUNT)]
    assert segmented(path, times=later)[0].to_do() == [range(15, 30), range(30, 40)]


@pytest.mark.parametrize("what", ["segment", "record"])
def test_a_damaged_segment_is_made_again(tmp_path, what):
    path = tmp_path / "v.mp4"
    parts, coding, times = segmented(path)
    fill(parts, coding, times)
    file = parts.folder / ("00001.mp4" if what == "segment" else "00001.json")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    assert parts.to_do() == [range(15, 30)]
    assert fill(parts, coding, times) == list(range(15, 30))
    parts.join()
    assert len(VideoReader(path)) == COUNT


def test_a_join_that_fails_leaves_the_segments(tmp_path):
    path = tmp_path / "v.mp4"
    parts, coding, times = segmented(path)
    fill(parts, coding, times)
    (parts.folder / "00001.mp4").rename(tmp_path / "away.mp4")
    with pytest.raises(InputError, match=r"00001\.mp4: no such file"):
        parts.join()
    assert not path.exists()
    (tmp_path / "away.mp4").rename(parts.folder / "00001.mp4")
    in_one_run(parts.folder / "00001.mp4", None, times[:7])
    with pytest.raises(InputError, match="holds 7 pictures of 15; please remove the file"):
        parts.join()
    assert [p.name for p in tmp_path.iterdir()] == ["v.mp4.segments"]


def test_what_others_put_there_stays(tmp_path):
    parts, coding, times = segmented(tmp_path / "v.mkv")
    parts.folder.mkdir()
    (parts.folder / "notes.txt").write_text("mine")
    fill(parts, coding, times)
    parts.join()
    assert [p.name for p in parts.folder.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("kind", ["mp4", "mkv"])
def test_sound_is_as_in_one_run(tmp_path, kind):
    source = tmp_path / "in.mp4"
    clips.write(source, tone=1.3, late=0.02)
    path, other = tmp_path / f"v.{kind}", tmp_path / f"one.{kind}"
    parts, coding, times = segmented(path)
    fill(parts, coding, times)
    parts.join(others=OtherStreams(source, 0))
    in_one_run(other, None, times, others=OtherStreams(source, 0))
    with av.open(str(path)) as a, av.open(str(other)) as b:
        heard = [[(p.pts, bytes(p)) for p in c.demux(audio=0) if p.size] for c in (a, b)]
    assert heard[0] == heard[1]
    assert len(heard[0]) > 50
    assert list(VideoReader(path).times) == list(VideoReader(other).times)


def test_hdr10_data_outlives_the_join(tmp_path):
    facts = Facts(light_level=LightLevel(993, 412), pixel_aspect=Fraction(4, 3))
    parts, coding, times = segmented(tmp_path / "v.mp4", "h265", bits=10, facts=facts)
    fill(parts, coding, times)
    parts.join()
    reader = VideoReader(tmp_path / "v.mp4")
    assert reader.light_level == LightLevel(993, 412)
    assert reader.pixel_aspect == Fraction(4, 3)


def test_a_gif_has_no_segments(tmp_path):
    with pytest.raises(InputError, match="a GIF cannot be resumed"):
        segmented(tmp_path / "v.gif")


def test_what_a_run_left_is_removed_and_what_is_not_its_own_stays(tmp_path):
    parts, coding, times = segmented(tmp_path / "a.mp4")
    other, *_ = segmented(tmp_path / "b.mp4")
    fill(parts, coding, times, stop=20)
    fill(other, coding, times, stop=20)
    parts.release(), other.release()
    own, dead = f"-{os.getpid()}-", subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    for path in parts.folder.glob(f".0*{own}*"):  # as if another process had been killed
        path.unlink()
        path.with_name(path.name.replace(own, f"-{dead.pid}-")).write_bytes(b"half")
    remove_left(tmp_path / "a.mp4")
    assert not parts.folder.exists() and (other.folder / "00000.mp4").is_file()
    parts.folder.mkdir()
    (parts.folder / "00000.mp4").write_bytes(b"segment")
    (parts.folder / "mine.txt").write_bytes(b"mine")
    remove_left(tmp_path / "a.mp4")
    assert [p.name for p in parts.folder.iterdir()] == ["mine.txt"]


def test_the_segments_of_a_run_that_is_alive_are_left_alone(tmp_path):
    """Also between two segments, when it writes none."""
    parts, coding, times = segmented(tmp_path / "a.mp4")
    first = parts.to_do()[0]
    segment = parts.begin(first)
    for n in first:
        segment.add(picture(n, coding), times[n])
    segment.close()
    code = (
        "import sys, pathlib; from wgmb.video.write.segments import remove_left\n"
        "remove_left(pathlib.Path(sys.argv[1]))"
    )
    again = [sys.executable, "-c", code, str(tmp_path / "a.mp4")]
    subprocess.run(again, check=True)
    assert (parts.folder / "00000.mp4").is_file() and parts.to_do()[0] != first
    parts.release()
    subprocess.run(again, check=True)
    assert not parts.folder.exists()


def test_another_run_that_ends_first_takes_no_segments_away(tmp_path):
    slow, coding, times = segmented(tmp_path / "a.mp4")
    fill(slow, coding, times)
    quick, *_ = segmented(tmp_path / "a.mp4")
    assert quick.to_do() == []
    quick.join()
    slow.join()
    assert len(VideoReader(tmp_path / "a.mp4")) == COUNT and not slow.folder.exists()
