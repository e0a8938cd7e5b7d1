"""One line that helps: outputs before inputs, near names, and inputs of another kind."""

import subprocess

import pytest
from PIL import Image

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


FRAMES = ("blur", "shot.####.exr", "-o", "o.####.exr")
PICTURES = ("blur", "shot.####.exr", "-o", "o.####.png")
FILM = ("blur", "shot.####.exr", "-o", "o.mp4")
VIDEO = ("blur", "a.mp4", "-o", "o.mp4", "--flow", "none")
STILLS = ("blur", "a.mp4", "-o", "o.####.png", "--flow", "none")
PIPE = ("blur", "a.mp4", "-o", "-", "--flow", "none")
OF_VIDEOS = {
    "--begin": "0.1", "--end": "9", "--longest-pause": "3", "--speed": "0.5", "--pitch": "follow",
    "--streams": "video", "--duplicates": "fill", "--codec": "h265", "--quality": "20",
    "--encoder": "nvenc",
}  # fmt: skip
ENCODED = [(name, OF_VIDEOS[name]) for name in ("--codec", "--quality", "--encoder", "--streams")]
OF_EXR = [("--layers", "picture"), ("--compression", "piz"), ("--window", "keep")]
COMPARED = "compare", "--truth", "a.exr", "--inputs", "shot.####.exr", "-o", "o.html"
REFUSED = [
    *((FRAMES, option, "is for input videos") for option in OF_VIDEOS.items()),
    *((STILLS, option, "needs a video as output") for option in ENCODED),
    *((STILLS, option, "needs an .exr output") for option in OF_EXR),
    *((VIDEO, option, "needs an .exr output") for option in OF_EXR),
    *((PICTURES, option, "needs an .exr output") for option in OF_EXR),
    *((line, ("--bits", "16"), "needs a .png or .tif output") for line in (FRAMES, FILM, VIDEO)),
    (PIPE, ("--bits", "16"), "needs a .png or .tif output"),
    (PIPE, ("--streams", "video"), "a pipe carries pictures alone"),
    (FRAMES, ("--object-motion",), "needs --camera"),
    (FRAMES, ("--object-layer", "IndexOB"), "needs --camera"),
    (("info", "a.mp4"), ("--layer", "x"), "is for rendered frames"),
    (("info", "a.mp4"), ("--frames", "2"), "is for rendered frames"),
    (("perceive", "a.mp4", "-o", "o.mp4"), ("--nature", "60"), "is for scenes"),
    (("perceive", "a.mp4", "-o", "o.mp4"), ("--bits", "16"), "needs a .png or .tif output"),
    (("perceive", "shot.####.exr", "-o", "o.####.exr"), ("--size", "64x36"), "is for scenes"),
    (("perceive", "wheel", "-o", "o.exr"), ("--layer", "x"), "is for files, wheel is a scene"),
    (("perceive", "--report", "-o", "o.svg"), ("--frames", "2"), "is for files"),
    (("render", "wheel", "-o", "o.####.png", "--frames", "0-1"), ("--time", "1"),
     "is for a single image"),
    (("compare", "wheel", "-o", "o.html"), ("--peer", "x=b.exr"), "is not for scenes"),
    (("compare", "wheel", "-o", "o.html"), ("--frames", "2"), "is not for scenes"),
    (COMPARED, ("--size", "64x36"), "is not for rendered frames"),
    (COMPARED, ("--reference", "distributed:4"), "is not for rendered frames"),
    (("compare", "--experiment", "chen", "-o", "o.html"), ("--shutter", "90"),
     "is not for experiments"),
    (("compare", "--experiment", "chen", "-o", "o.html"), ("--methods", "tap"),
     "is not for experiments"),
]  # fmt: skip


@pytest.fixture
def inputs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make.write_sequence(tmp_path, [1, 2])
    clips.write(tmp_path / "a.mp4")
    return tmp_path


def test_an_option_without_a_use_is_refused(inputs, capsys):
    for line, option, why in REFUSED:
        code, _, err = make.inside(capsys, *line, *option)
        assert (code, err.count("\n")) == (2, 1), (line, option, err)
        assert option[0] in err and why in err, (line, option, err)
    assert not list(inputs.glob("o.*"))


UNREADABLE = [
    (("--holdout", "away.png"), "away.png: no such file"),
    (("--holdout", "away.txt"), "--holdout of a video must be"),
    (("--holdout", "small.png"), "small.png must be"),
    (("--cuts", "away.edl"), "away.edl: no such file"),
    (("--curve", "away.csv"), "away.csv"),
]


@pytest.mark.parametrize("source", [("a.mp4", "-o", "o.mp4"), ("a.mp4", "b.mp4", "-o", "o/")])
def test_the_file_of_an_option_is_refused_before_anything_is_told(inputs, capsys, source):
    Image.new("L", (4, 4)).save(inputs / "small.png")
    clips.write(inputs / "b.mp4")
    is_alone = source[-1] == "o.mp4"
    for option, why in UNREADABLE if is_alone else UNREADABLE[:2] + UNREADABLE[3:]:
        code, _, err = make.inside(capsys, "blur", *source, *option)
        assert (code, err.count("\n")) == (2, 1) and why in err, (option, err)


NAMED = [
    (FRAMES, ("--rolling-duration", "0.5"), "has no effect without --rolling"),
    (FRAMES, ("--flow-quality", "fast"), "motion of their own, so --flow-quality has no effect"),
    (("blur", "plain.####.exr", "-o", "o.####.exr", "--flow", "none", "--shutter", "720"),
     ("--vector-scale", "2"), "no vectors, so --vector-scale has no effect"),
    (VIDEO, ("--pitch", "follow"), "--pitch has no effect without --speed"),
    (VIDEO, ("--ocio", "FIFO"), "keep their own colours, so --ocio has no effect"),
    (VIDEO, ("--from", "acescg"), "keep their own colours, so --from has no effect"),
    (("info", "a.mp4"), ("--look", "x"), "keep their own colours, so --look has no effect"),
    (("render", "wheel", "-o", "o.png", "--size", "16x9"), ("--rolling-duration", "2"),
     "has no effect without --rolling"),
]  # fmt: skip


def test_an_option_that_changes_nothing_is_named(inputs, capsys):
    for n in (1, 2, 3):
        make.write_exr(inputs / f"plain.{n:04d}.exr", make.frame(n, None))
    for line, option, said in NAMED:
        more = () if line[0] == "info" else ("--overwrite",)
        code, _, err = make.inside(capsys, *line, *option, *more)
        assert code == 0 and said in err, (line, option, err)


def test_a_pipe_names_an_option_that_changes_nothing(inputs):
    words = [*make.COMMAND, *PIPE, "--rolling-duration", "0.5", "--ocio", "FIFO"]
    done = subprocess.run(words, capture_output=True, timeout=120, check=True)
    assert "has no effect without --rolling" in done.stderr.decode()
    assert "keep their own colours, so --ocio has no effect" in done.stderr.decode()
