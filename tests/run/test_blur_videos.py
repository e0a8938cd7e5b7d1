"""`wgmb blur` of several videos: names of outputs, a line for each, what fails alone."""

import av
import numpy as np
import pytest

import make_clips as clips
import make_frames as make
from wgmb.cli import app
from wgmb.cli.names import outputs_of, videos_of
from wgmb.run.video import VideoRun
from wgmb.video.read.reader import VideoReader


def run(capsys, *words, code=0):
    got = app.main(["blur", *map(str, words), "--flow", "none"])
    text = capsys.readouterr().err
    assert got == code, text
    return text.splitlines()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    for name, count in (("a.mp4", 5), ("b.mkv", 7), ("c.avi", 6)):
        chroma = np.full((24, 32), 128, "u1")
        tones = [np.full((48, 64), 40 + 9 * n, "u1") for n in range(count)]
        grey = [clips.frame([tone, chroma, chroma], "yuv420p") for tone in tones]
        codec = "mpeg4" if name == "c.avi" else "libx264"
        clips.write(tmp_path / "in" / name, grey, codec=codec, tick=clips.Fraction(1, 24))
    return tmp_path


@pytest.mark.parametrize("given", [["in"], ["in/*"], ["in/a.mp4", "in/b.mkv", "in/c.avi"]],
                         ids=["folder", "pattern", "files"])  # fmt: skip
def test_every_video_gets_its_own_output_and_its_own_line(folder, capsys, given):
    lines = run(capsys, *given, "-o", "out/")
    assert make.names_in(folder / "out") == ["a.mp4", "b.mkv", "c.mkv"]
    assert [len(VideoReader(folder / "out" / n)) for n in ("a.mp4", "b.mkv", "c.mkv")] == [5, 7, 6]
    assert lines[0].startswith("motion: ") and lines[-1] == "3 of 3 videos done"
    ended = [line for line in lines if " -> " in line]
    for line, name, count in zip(ended, ("a.mp4", "b.mkv", "c.avi"), (5, 7, 6), strict=True):
        assert line.startswith(f"in/{name}: {count} frames in ") and " -> out/" in line


def test_losses_of_each_are_said_once_before_its_first_picture(folder, capsys, monkeypatch):
    """A batch said them at the end of each video, when the hours were spent."""
    said_before = []
    real = VideoRun.__call__

    def watched(self, plan, progress=None):
        said_before.append(capsys.readouterr().err.splitlines()[-1])
        return real(self, plan, progress)

    monkeypatch.setattr(VideoRun, "__call__", watched)
    rgb = [av.VideoFrame.from_ndarray(np.full((48, 64, 3), 9 * n, "u1"), "rgb24") for n in range(5)]
    clips.write(folder / "in" / "d.mkv", rgb, codec="libx264rgb", pixels="rgb24")
    after = run(capsys, "in/a.mp4", "in/d.mkv", "-o", "{name}_.mp4", "--codec", "h264")
    loss = "h264 holds one colour for 2 x 2 pixels"
    assert said_before[0].startswith("in/a.mp4: does not state its colours")
    assert said_before[1].startswith("in/d.mkv: ") and loss in said_before[1]
    assert [line for line in after if loss in line] == []


def test_a_name_may_stand_for_the_inputs(folder, capsys):
    run(capsys, "in/a.mp4", "in/b.mkv", "-o", "{name}_48.mkv", "--fps", "48", "-q")
    run(capsys, "in/a.mp4", "-o", "{name}/f.##.png", "-q")
    assert make.names_in(folder) == ["a", "a_48.mkv", "b_48.mkv", "in"]
    assert [len(VideoReader(folder / f"{n}_48.mkv")) for n in "ab"] == [10, 14]
    assert make.names_in(folder / "a") == [f"f.{k:02d}.png" for k in range(1, 6)]


def test_the_same_video_comes_out_alone_and_among_others(folder, capsys):
    run(capsys, "in/b.mkv", "-o", "alone.mkv", "--codec", "ffv1", "-q")
    run(capsys, "in/a.mp4", "in/b.mkv", "-o", "{name}_.mkv", "--codec", "ffv1", "-q")
    one, other = VideoReader(folder / "alone.mkv"), VideoReader(folder / "b_.mkv")
    for (_, a), (_, b) in zip(one, other, strict=True):
        assert all(np.array_equal(p, q) for p, q in zip(a.planes, b.planes, strict=True))


def test_one_that_fails_does_not_stop_the_others(folder, capsys):
    (folder / "in" / "b.mkv").write_bytes(b"no video")
    lines = run(capsys, "in", "gone.mp4", "-o", "out/", code=1)
    assert make.names_in(folder / "out") == ["a.mp4", "c.mkv"]
    failed = [line for line in lines if line.startswith("wgmb: ")]
    assert [line.split(": ")[1] for line in failed] == ["in/b.mkv", "gone.mp4"]
    assert lines[-1] == "2 of 4 videos done"
    again = run(capsys, "in/a.mp4", "in/c.avi", "-o", "out/", "--resume", "--frames", "0-5", code=1)
    assert "pictures 0 to 4" in again[1] and any("made otherwise" in line for line in again[2:])


def test_finished_videos_are_kept_with_resume(folder, capsys):
    run(capsys, "in/a.mp4", "-o", "out/", "-q")
    before = (folder / "out" / "a.mp4").stat().st_mtime_ns
    lines = run(capsys, "in/a.mp4", "in/b.mkv", "-o", "out/", "--resume")
    one, other = (line for line in lines if " -> " in line)
    assert "is already done" in one and "7 frames" in other
    assert (folder / "out" / "a.mp4").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["in", "-o", "in/"], "is the input in/a.mp4"),
        (["in/a.mp4", "in/b.mkv", "-o", "in/../in/"], "is the input in/a.mp4"),
        (["in", "-o", "out.mp4"], "3 videos need a folder that is there or ends in /, or {name}"),
        (["in/a.mp4", "other/a.mp4", "-o", "o/"], "would both be written to o/a.mp4"),
        (["in/a.mp4", "in/a.mp4", "-o", "o/"], "would both be written to o/a.mp4"),
        (["in", "-o", "{name}.avi"], "must be a video .mp4"),
        (["in", "-o", "o/", "--codec", "prores"], "prores"),
        (["in/a.mp4", "a.exr", "-o", "o/"], "a.exr: several inputs must be videos"),
        (["a.1.exr", "a.2.exr", "-o", "b.#.exr"], "frames need one pattern such as"),
        (["s.####.exr", "t.####.exr", "-o", "o/"], "several inputs must be videos"),
        (["in/*.mpg", "-o", "o/"], "in/*.mpg: no such files"),
        (["other", "-o", "o/"], "other: a folder without"),
        (["in", "-o", "there/"], "there/b.mkv exists; --overwrite"),
        (["-o", "o/"], "no input"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_before_any_work(folder, capsys, words, said):
    (folder / "other").mkdir()
    (folder / "there").mkdir()
    (folder / "there" / "b.mkv").write_bytes(b"mine")
    (line,) = run(capsys, *words, "-q", code=2)
    assert said in line
    assert make.names_in(folder) == ["in", "other", "there"]
    assert make.names_in(folder / "there") == ["b.mkv"]


def test_wildcards_of_names_that_are_there_are_literal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a[1].mp4", "a1.mp4", "x#2.mp4"):
        (tmp_path / name).touch()
    assert list(map(str, videos_of(["a[1].mp4", "x#2.mp4"]))) == ["a[1].mp4", "x#2.mp4"]
    assert list(map(str, videos_of(["a[1-3].mp4"]))) == ["a1.mp4"]
    assert outputs_of(videos_of(["a1.mp4"]), "b/{name}-{name}.mkv") == ["b/a1-a1.mkv"]
