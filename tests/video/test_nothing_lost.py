"""Videos that lose something say so, and an input is never written over."""

import av
import numpy as np
import pytest

import make_clips as clips
import make_frames as make
from wgmb.cli import app
from wgmb.run.video import VideoRequest
from wgmb.settings import OutputSettings
from wgmb.settings.video import VideoSettings
from wgmb.video.read.reader import VideoReader

PLAIN = "--flow", "none", "-q"


def run(capsys, *words, code=0):
    got = app.main([str(w) for w in ("blur", *words, *PLAIN)])
    text = capsys.readouterr().err
    assert got == code, text
    return text


@pytest.fixture
def cut(tmp_path):
    """Two seconds of video, 24 pictures a second, of which the file ends early."""
    pictures = [clips.frame(clips.planes(n), "yuv420p") for n in range(48)]
    path = clips.write(tmp_path / "a.mkv", pictures, rate=clips.Fraction(24))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return path


def test_a_cut_off_video_says_how_many_pictures_are_lost(tmp_path, capsys, cut):
    text = run(capsys, cut, "-o", tmp_path / "b.mkv", code=1)
    made = len(VideoReader(tmp_path / "b.mkv"))
    (count,) = [int(w) for w in text.split() if w.isdigit()]
    assert 10 < made < 40 and abs(made + count - 48) <= 2, text
    assert "cut off after" in text and text.count("\n") == 1


def test_a_part_before_the_cut_off_end_has_lost_nothing(tmp_path, capsys, cut):
    assert run(capsys, cut, "-o", tmp_path / "b.mkv", "--frames", "0-4") == ""


@pytest.mark.parametrize("more", [(), ("--overwrite",), ("--resume",)])
def test_the_input_through_a_folder_that_is_not_there_stays(tmp_path, capsys, more):
    source = clips.write(tmp_path / "a.mkv")
    before = source.read_bytes()
    text = run(capsys, source, "-o", tmp_path / "new" / ".." / "a.mkv", *more, code=2)
    assert "is the input" in text and text.count("\n") == 1
    assert source.read_bytes() == before and make.names_in(tmp_path) == ["a.mkv"]


def test_another_file_through_a_folder_that_is_not_there_stays(tmp_path, capsys):
    source = clips.write(tmp_path / "a.mkv")
    (tmp_path / "b.mkv").write_bytes(b"mine")
    text = run(capsys, source, "-o", tmp_path / "new" / ".." / "b.mkv", code=2)
    assert "exists" in text and text.count("\n") == 1
    assert (tmp_path / "b.mkv").read_bytes() == b"mine"


def test_a_time_as_colour_space_names_the_option_that_is_meant(tmp_path, capsys):
    source = clips.write(tmp_path / "a.mkv")
    text = run(capsys, source, "-o", tmp_path / "b.mkv", "--from", "0:05", code=2)
    assert "--begin" in text and text.count("\n") == 1
    assert make.names_in(tmp_path) == ["a.mkv"]


def rich(path):
    """A video with sound, subtitles, chapters, a text and a time code, of which most are lost."""

    def before(out):
        out.add_mux_stream("subrip").metadata["language"] = "fra"
        out.metadata.update({"title": "T", "custom": "mine", "timecode": "01:00:00:00"})
        part = {"id": 1, "start": 0, "end": 400, "time_base": clips.Fraction(1, 1000)}
        out.set_chapters([part | {"metadata": {"title": "one"}}])

    def also(out):
        (text,) = (s for s in out.streams if s.type == "subtitle")
        packet = av.Packet(b"Hello")
        packet.stream, packet.time_base = text, clips.Fraction(1, 1000)
        packet.pts, packet.dts, packet.duration = 0, 0, 300
        out.mux(packet)

    wave = np.zeros(24000)
    return clips.write(path, before=before, also=also, sound=("pcm_s16le", 48000, wave))


@pytest.mark.parametrize(
    ("to", "lost"),
    [("b.mp4", ["text CUSTOM is", "subtitles"]), ("b.mov", ["subtitles"]), ("b.mkv", []),
     ("b.webm", ["sound", "subtitles", "time code"]),
     ("b.gif", ["texts title, CUSTOM are", "sound", "subtitles", "time code", "chapter"]),
     ("b.####.png", ["sound, subtitles, chapters are"]),
     ("b.####.exr", ["sound, subtitles, chapters are"])],
)  # fmt: skip
@pytest.mark.parametrize("speed", [1, 0.5])
def test_every_loss_is_said_before_the_first_picture(tmp_path, to, lost, speed, device):
    run = VideoRequest(video=VideoSettings(flow="none", speed=speed)).open(device)
    plan = run.plan(rich(tmp_path / "a.mkv"), OutputSettings(output=str(tmp_path / to)))
    said = plan.losses
    assert make.names_in(tmp_path) == ["a.mkv"]
    assert set(said) == set(run(plan).left_out)
    text = "; ".join(said)
    assert all(word in text for word in lost) and (speed != 1 or bool(lost) == bool(said)), text


@pytest.mark.parametrize("is_ordered", [True, False])
def test_ordered_chapters_are_named(tmp_path, is_ordered):
    """FFmpeg plays such a file from its beginning to its end, and says nothing."""

    def chapters(out):
        tick = clips.Fraction(1, 1000)
        one = {"id": 1, "start": 0, "end": 250, "time_base": tick, "metadata": {"title": "one"}}
        parts = [one, one | {"id": 2, "start": 250, "end": 500}]
        out.set_chapters(parts)

    path = clips.write(tmp_path / "in.mkv", before=chapters)
    if is_ordered:  # in the place of another flag of the edition, which is 1
        data = path.read_bytes()
        assert data.count(b"\x45\xdb\x81\x01") == 1
        path.write_bytes(data.replace(b"\x45\xdb\x81\x01", b"\x45\xdd\x81\x01"))
    notes = VideoReader(path).notes
    assert any("its chapters are ordered" in note for note in notes) == is_ordered
