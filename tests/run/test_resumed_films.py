"""`resume` of videos of rendered frames: the same rule as of videos of videos."""

import os

import imageio.v3 as iio
import numpy as np
import pytest

import make_frames as make
from wgmb.io import record

VIDEOS = ["mp4", "mov", "mkv", "webm", "gif"]


@pytest.fixture
def shot(tmp_path):
    (tmp_path / "in").mkdir()
    make.write_sequence(tmp_path / "in", range(1, 5))
    return tmp_path / "in" / "shot.####.exr"


def blur(capsys, shot, to, *options):
    words = ("--method", "tap", "--resume", *options)
    code, _, err = make.inside(capsys, "blur", shot, "-o", to, *words)
    return code, err


def state(path):
    return path.read_bytes(), path.stat().st_mtime_ns


@pytest.mark.parametrize("suffix", VIDEOS)
def test_a_whole_video_is_done_and_a_damaged_one_is_made_again(tmp_path, capsys, shot, suffix):
    to = tmp_path / f"v.{suffix}"
    code, err = blur(capsys, shot, to)
    assert code == 0 and "4 frames in" in err
    before = state(to)
    code, err = blur(capsys, shot, to)
    assert code == 0 and "4 already done" in err and state(to) == before
    data = bytearray(to.read_bytes())
    data[data.find(b'{"seal": "') - 5] ^= 1
    to.write_bytes(data)
    code, err = blur(capsys, shot, to)
    assert code == 0 and "4 frames in" in err and record.read_file(to)[1]
    assert make.names_in(tmp_path) == sorted(["in", to.name])


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    "other", [["--shutter", "90"], ["--fps", "25"], ["--frames", "1-3"], ["--samples", "4"]]
)
def test_another_setting_is_no_finished_video(tmp_path, capsys, shot, other):
    to = tmp_path / "v.mp4"
    blur(capsys, shot, to)
    before = state(to)
    code, err = blur(capsys, shot, to, *other)
    assert code == 2 and "v.mp4 exists and was made otherwise; --overwrite replaces it" in err
    assert state(to) == before
    assert blur(capsys, shot, to, *other, "--overwrite")[0] == 0
    assert "already done" in blur(capsys, shot, to, *other)[1]


def test_a_changed_frame_is_noticed_also_through_a_rate_conversion(tmp_path, capsys, shot):
    to, also = tmp_path / "v.mkv", ("--fps-in", "24", "--fps", "12")
    for more in ((), also):
        to.unlink(missing_ok=True)
        blur(capsys, shot, to, *more)
        assert "already done" in blur(capsys, shot, to, *more)[1]
        os.utime(tmp_path / "in" / "shot.0004.exr", ns=(1, 1 + len(more)))
        code, err = blur(capsys, shot, to, *more)
        assert code == 2 and "was made otherwise" in err


def test_output_frames_of_a_higher_rate_are_named_and_stay(tmp_path, capsys, shot):
    to = tmp_path / "o.####.png"
    code, err = blur(capsys, shot, to, "--fps-in", "24", "--fps", "24")
    assert code == 0 and "remain" not in err
    code, err = blur(capsys, shot, to, "--fps-in", "24", "--fps", "12")
    assert code == 0 and "o.####.png: frames 3-4 of a longer run remain" in err
    assert len(list(tmp_path.glob("o.*.png"))) == 4


def test_what_lacks_frames_is_not_done(tmp_path, capsys, shot):
    broken = tmp_path / "in" / "shot.0002.exr"
    whole = broken.read_bytes()
    broken.write_bytes(whole[:300])
    os.utime(broken, ns=(7, 7))
    to = tmp_path / "v.mp4"
    code, err = blur(capsys, shot, to)
    assert code == 1 and "1 of 4 frames failed" in err
    content, is_whole = record.read_file(to)
    assert content is not None and not is_whole
    code, err = blur(capsys, shot, to)
    assert code == 1 and "already done" not in err


def test_a_strangers_video_is_not_replaced(tmp_path, capsys, shot):
    to = tmp_path / "v.mp4"
    to.write_bytes(b"mine")
    code, err = blur(capsys, shot, to)
    assert code == 2 and "holds no record of a run" in err and to.read_bytes() == b"mine"


def test_a_video_of_a_scene_is_done_too(tmp_path, capsys):
    words = ("torusphere", "--size", "32x18", "--resume", "-o", tmp_path / "v.mp4")
    for frames, said in (("0-2", "frames in"), ("0-2", "already done"), ("0-3", "otherwise")):
        _, _, err = make.inside(capsys, "render", *words, "--frames", frames)
        assert said in err


def test_frames_are_written_in_the_order_that_is_asked_for(tmp_path, capsys, shot):
    for name, frames in (("up.mkv", "2-4"), ("down.mkv", "4-2")):
        code, err = blur(capsys, shot, tmp_path / name, "--frames", frames)
        assert code == 0, err
    up, down = (iio.imread(tmp_path / name, plugin="pyav") for name in ("up.mkv", "down.mkv"))
    apart = np.abs(up.astype(int)[:, None] - down[None]).mean(axis=(2, 3, 4))
    assert apart.argmin(axis=1).tolist() == [2, 1, 0]


@pytest.mark.parametrize("frames", ["1-0", "0-2x2", "1,0"])
def test_frames_of_a_video_are_an_ascending_range(tmp_path, capsys, shot, frames):
    blur(capsys, shot, tmp_path / "v.mkv", "--frames", "1-3")
    words = ("blur", tmp_path / "v.mkv", "-o", tmp_path / "o.mp4", "--flow", "none")
    code, _, err = make.inside(capsys, *words, "--frames", frames)
    assert code == 2 and not (tmp_path / "o.mp4").exists()
    assert f"must be one ascending range such as 1-3, got {frames}" in err
