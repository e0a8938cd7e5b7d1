"""One line that helps: outputs before inputs, near names, and inputs of another kind."""

import pytest

import make_clips as clips
import make_frames as make
from wgmb import Clip, InputError

KINDS = "the name must end in one of .exr, .png"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-o", "x.avi"), KINDS),
        (("-o", "a.mp4"), "output a.mp4 is the input a.mp4"),
        (("-o", "x.gif", "--fps", "60"), "to 50 frames per second, got 60; --fps 30 fits"),
        (("-o", "x.gif", "--fps", "120"), "got 120; --fps 40 fits"),
        (("-o", "x.mp4", "--codec", "prores"), "prores goes into .mov, .mkv"),
    ],
)
@pytest.mark.parametrize("broken", [False, True])
def test_the_output_is_checked_before_the_video_is_opened(
    tmp_path, capsys, monkeypatch, words, said, broken
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.mp4").write_bytes(b"no video") if broken else clips.write(tmp_path / "a.mp4")
    code, _, err = make.inside(capsys, "blur", "a.mp4", *words)
    assert (code, err.count("\n")) == (2, 1)
    assert said in err


def test_the_output_is_checked_before_frames_are_opened(tmp_path, capsys):
    code, _, err = make.inside(capsys, "blur", tmp_path / "no.####.exr", "-o", "x.bmp")
    assert (code, err.count("\n")) == (2, 1)
    assert KINDS in err


def test_a_file_that_is_no_exr_is_told_as_such(tmp_path, capsys):
    (tmp_path / "fake.exr").write_text("hello")
    _, _, err = make.inside(capsys, "blur", tmp_path / "fake.exr", "-o", tmp_path / "o.exr")
    assert "fake.exr: not an EXR file, whatever its name" in err


def test_frames_that_are_not_there_name_those_that_are(tmp_path):
    make.write_sequence(tmp_path, [1, 2])
    with pytest.raises(InputError, match=r"no such frames; did you mean .*shot\.####\.exr"):
        Clip(tmp_path / "shto.####.exr")
    with pytest.raises(InputError, match=r"no such frames$"):
        Clip(tmp_path / "entirely_else.####.png")


def test_a_clip_of_a_video_or_a_folder_names_what_takes_it(tmp_path):
    make.write_sequence(tmp_path, [1, 2])
    with pytest.raises(InputError, match=r"a folder; its frames are .*shot.####.exr$"):
        Clip(tmp_path)
    (tmp_path / "none").mkdir()
    with pytest.raises(InputError, match="a folder; it holds no frames"):
        Clip(tmp_path / "none")
    with pytest.raises(InputError, match=r"a video; wgmb\.blur_video takes it"):
        Clip(clips.write(tmp_path / "holiday.mp4"))


def test_a_wildcard_of_frames_is_answered_with_its_pattern(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make.write_sequence(tmp_path, [1, 2])
    code, _, err = make.inside(capsys, "blur", "shot.*.exr", "-o", "o.####.exr")
    assert (code, "frames need one pattern such as 'shot.####.exr', in quotes" in err) == (2, True)


def test_a_folder_of_outputs_ends_in_a_slash(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clips").mkdir()
    clips.write(tmp_path / "clips" / "a.mp4")
    code, _, err = make.inside(capsys, "blur", "clips", "-o", "out")
    assert (code, "or a folder, whose name ends in /" in err) == (2, True)
