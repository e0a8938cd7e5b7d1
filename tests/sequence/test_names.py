"""Names of files and numbers of frames: what stands for a number, what is literal, how many."""

import contextlib
import os
import resource
import sys
from pathlib import Path

import pytest

import make_frames as make
from wgmb import (
    Blur,
    Clip,
    InputError,
    Shutter,
    Vectors,
    scene,
)
from wgmb.cli import app
from wgmb.io import exr
from wgmb.io import frame_numbers as numbering
from wgmb.io.frame_numbers import frame_numbers, frame_path
from wgmb.viewer.state.state import State


@contextlib.contextmanager
def little_memory(more: int = 256 << 20):
    """MemoryError for whoever takes `more` bytes than there are now."""
    now = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (now + more, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def touched(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).touch()


# ---- which part of a name is the number -----------------------------------------------------


@pytest.mark.parametrize(
    ("pattern", "third"),
    [
        ("shot.####.exr", "shot.0003.exr"),
        ("a#b.####.exr", "a#b.0003.exr"),
        ("a@.####.exr", "a@.0003.exr"),
        ("shot.##.##.exr", "shot.##.03.exr"),
        ("1-5#.exr", "1-53.exr"),
        ("shot1-3#.exr", "shot1-33.exr"),
        ("shot.1-10####.exr", "shot.1-100003.exr"),
        ("a.<UDIM>.####.exr", "a.<UDIM>.0003.exr"),
        ("s<b>.####.exr", "s<b>.0003.exr"),
        ("9####.exr", "90003.exr"),
        ("1,3####.exr", "1,30003.exr"),
        ("a%02d.$F3.exr", "a%02d.003.exr"),
        ("a(b)[c]*.####.exr", "a(b)[c]*.0003.exr"),
        ("####", "0003"),
        ("-o.####.exr", "-o.0003.exr"),
        ("a.%d.exr", "a.3.exr"),
        ("a.$F.exr", "a.3.exr"),
    ],
)
def test_the_last_run_is_the_number_and_all_else_is_literal(tmp_path, pattern, third):
    assert frame_path(tmp_path / pattern, 3) == tmp_path / third
    touched(tmp_path, third)
    assert Clip(tmp_path / pattern).numbers == [3]


def test_numbers_must_be_padded_as_the_pattern_says(tmp_path):
    touched(
        tmp_path, "s.0001.exr", "s.2.exr", "s.00003.exr", "s.12345.exr", "s.-001.exr", "s.٤٤٤٤.exr"
    )
    assert numbering.numbers_on_disk(tmp_path / "s.####.exr") == [-1, 1, 12345]


@pytest.mark.parametrize("pattern", ["s.####.exr", "s.%04d.exr", "s.#.exr", "s.$F2.exr"])
def test_frames_before_0_are_found_under_the_names_they_are_written_to(tmp_path, pattern):
    numbers = [-12, -2, -1, 0, 1]
    touched(tmp_path, *(frame_path(pattern, n).name for n in numbers))
    assert Clip(tmp_path / pattern, skip_missing=True).numbers == numbers


@pytest.mark.parametrize("first", ["s.-0009.exr", "s.-009.exr"])
def test_the_sign_of_a_frame_may_stand_before_all_its_digits(tmp_path, first):
    touched(tmp_path, first, "s.0000.exr")
    pattern = tmp_path / "s.####.exr"
    assert Clip(pattern, skip_missing=True).numbers == [-9, 0]
    assert frame_path(pattern, -9) == tmp_path / first
    assert frame_path(pattern, -8) == tmp_path / "s.-008.exr"


def test_the_name_of_a_frame_is_made_without_reading_the_pattern_again(tmp_path):
    """A run of 100,000 frames asks for each of its names several times."""
    pattern, calls = tmp_path / "shot.####.exr", []
    frame_path(pattern, 0)
    sys.setprofile(lambda frame, event, _: calls.append(event == "call"))
    try:
        for n in range(100):
            frame_path(pattern, n)
    finally:
        sys.setprofile(None)
    assert sum(calls) / 100 < 20  # functions written in Python


# ---- how many -------------------------------------------------------------------------------


def test_frames_far_apart_are_counted_and_not_listed(tmp_path):
    touched(tmp_path, "s.0001.exr", "s.3000000000.exr")
    pattern = tmp_path / "s.####.exr"
    with little_memory():
        with pytest.raises(InputError, match="2 of the frames 1 to 3000000000") as error:
            Clip(pattern)
        assert Clip(pattern, skip_missing=True).numbers == [1, 3000000000]
        assert Clip(pattern, frames="3000000000").numbers == [3000000000]
    assert "`skip_missing=True` accepts gaps, `frames` selects" in str(error.value)


@pytest.mark.parametrize("text", ["0-9999999", "0-3000000000x2", "5-1,1-999999,7-99", "-9-9999999"])
def test_more_frames_than_a_run_takes_are_refused_before_they_are_listed(text):
    with little_memory(), pytest.raises(InputError, match="frames, but one run takes 1000000"):
        frame_numbers(text)


def test_as_many_frames_as_a_run_takes_are_taken():
    assert len(frame_numbers("0-999999")) == numbering.MOST_FRAMES
    assert frame_numbers("0-3000000000x1000000000") == [0, 10**9, 2 * 10**9, 3 * 10**9]


@pytest.mark.parametrize("text", ["1-2x0.5", "1.5", "0-1x0.0000001"])
def test_parts_of_frames_are_refused(text):
    with pytest.raises(InputError, match="whole"):
        frame_numbers(text)


def test_very_many_gaps_are_one_short_line(tmp_path):
    numbers = [n * n for n in range(200)]
    touched(tmp_path, *(f"s.{n:05d}.exr" for n in numbers))
    with pytest.raises(InputError, match=r"missing frames 2-3,5-8,.*\.\.\.") as error:
        Clip(tmp_path / "s.#####.exr")
    assert len(str(error.value)) < len(str(tmp_path)) + 300
    assert f"({199 * 199 + 1 - 200} frames)" in str(error.value)


# ---- names that the command line may misread ------------------------------------------------


@pytest.mark.parametrize("name", ["-o.####.exr", "--config=x.####.exr"])
def test_the_viewers_command_line_takes_names_that_begin_with_a_hyphen(tmp_path, monkeypatch, name):
    make.write_sequence(tmp_path, [1, 2])
    for n in (1, 2):
        (tmp_path / f"shot.{n:04d}.exr").rename(tmp_path / name.replace("####", f"{n:04d}"))
    monkeypatch.chdir(tmp_path)
    state = State().opened(name).with_options({"holdout": ("-layer",), "method": "tap"})
    assert "--holdout=-layer" in state.command("x.png")
    words = State().opened(name).command("-x.####.png")
    assert app.main([*words, "--quiet"]) == 0
    assert {"-x.0001.png", "-x.0002.png"} <= set(make.names_in(tmp_path))


def test_a_name_taken_for_an_option_is_told_how_to_write_it(tmp_path, capsys):
    code, out, err = make.inside(capsys, "blur", "x.exr", "-o", "-x.png")
    assert (code, out) == (2, "")
    assert "./-x.png" in err
    assert err.count("\n") == 1


def test_a_name_that_is_no_text_is_one_line(capsys):
    name = os.fsdecode(b"\xff\xfe.####.exr")
    code, out, err = make.inside(capsys, "blur", name, "-o", "o.####.exr")
    assert (code, out) == (2, "")
    assert err == "wgmb: \\xff\\xfe.####.exr: not UTF-8; please rename the file or folder\n"


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        (lambda: Blur("gahter"), "gather"),
        (lambda: scene.make("cros"), "crossing"),
        (lambda: scene.make("wheel", sped=2), "speed"),
        (lambda: Blur("tap", path="curvd"), "curved"),
        (lambda: Shutter(curve="cosin"), "cosine"),
        (lambda: Vectors("nuk"), "nuke"),
        (lambda: exr.check_compression("zipp"), "zip"),
    ],
)
def test_a_word_that_is_nearly_right_is_recognised(wrong, meant):
    with pytest.raises(InputError, match=f"; did you mean '{meant}'\\?$"):
        wrong()


def test_a_word_that_is_like_none_is_given_no_other():
    with pytest.raises(InputError, match=r"'xyz'; available: [a-z, ]+$"):
        Blur("xyz")
