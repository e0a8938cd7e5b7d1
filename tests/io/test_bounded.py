"""Pipes, devices and links to them are refused, wherever a file of a stranger is read."""

import os
import signal

import pytest

import make_frames as make
from wgmb import InputError
from wgmb.files import bounded
from wgmb.io import atomic, exr, stills
from wgmb.run.job_file import read_job
from wgmb.settings.toml import text_of


@pytest.fixture(autouse=True)
def ends():
    """A read that waits fails instead."""

    def fail(*_):
        raise AssertionError("waited for a pipe")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def spoiled(path, what: str):
    if what == "pipe":
        os.mkfifo(path)
    elif what == "folder":
        path.mkdir()
    elif what == "large":
        path.touch()
        os.truncate(path, 4 << 30)
    else:
        path.symlink_to("/dev/zero")
    return path


@pytest.mark.fast
@pytest.mark.parametrize(
    ("what", "message"),
    [("pipe", "is a pipe or a device, expected a curve"), ("folder", "is a folder"),
     ("link", "is a pipe or a device"), ("large", "over 1 MiB, too large for a curve")],
)  # fmt: skip
def test_what_is_no_regular_file_of_a_bounded_size_is_refused(tmp_path, what, message):
    path = spoiled(tmp_path / "a.csv", what)
    with pytest.raises(InputError, match=rf"a\.csv: {message}"):
        bounded.read(path, 1 << 20, "a curve")


@pytest.mark.fast
@pytest.mark.parametrize(
    ("what", "message"),
    [("pipe", "is a pipe or a device"), ("folder", "is a folder, not a file"),
     ("link", "is a pipe or a device"), ("none", "no such file")],
)  # fmt: skip
@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.toml", "a.json"])
def test_what_is_there_instead_of_a_file_is_named(tmp_path, what, message, name):
    path = tmp_path / name if what == "none" else spoiled(tmp_path / name, what)
    readers = {".exr": exr.read, ".png": stills.read, ".toml": text_of, ".json": read_job}
    with pytest.raises(InputError, match=rf"{name}: {message}"):
        readers[path.suffix](path)


@pytest.mark.fast
@pytest.mark.parametrize("what", ["pipe", "folder", "link"])
def test_what_is_no_file_is_not_replaced(tmp_path, what):
    path = spoiled(tmp_path / "a.png", what)
    with pytest.raises(OSError, match="exists and is not a file"):
        atomic.write_file(path, b"picture")
    assert not path.is_file()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.fast
def test_a_file_is_read_whole_up_to_the_limit(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(bytes(99))
    assert bounded.read(path, 99, "a curve") == bytes(99)
    with pytest.raises(InputError, match="too large for a curve"):
        bounded.read(path, 98, "a curve")
    with pytest.raises(FileNotFoundError):
        bounded.read(tmp_path / "b.csv", 99, "a curve")


@pytest.mark.parametrize("what", ["pipe", "link", "large"])
@pytest.mark.parametrize(
    ("option", "name"),
    [("--camera", "a.json"), ("--curve", "a.csv"), ("--cuts", "a.edl"), ("--cuts", "a.otio"),
     ("--config", "a.toml"), ("--job", "a.json"), ("--ocio", "a.ocio")],
)  # fmt: skip
def test_a_command_refuses_such_a_file_in_one_line(tmp_path, capsys, option, name, what):
    pattern = make.write_sequence(tmp_path, (1, 2))
    path = spoiled(tmp_path / name, what)
    words = ["blur", option, path]
    if option != "--job":
        words[1:1] = [pattern, "-o", tmp_path / "o.####.png", "--method", "tap"]
    code, out, err = make.inside(capsys, *words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and name in err


@pytest.mark.parametrize("what", ["pipe", "link"])
@pytest.mark.parametrize("name", ["a.0001.exr", "a.0001.png", "a.0001.tif", "a.0001.jpg"])
def test_neither_a_frame_nor_a_mask_is_a_pipe(tmp_path, capsys, name, what):
    path = spoiled(tmp_path / name, what)
    code, out, err = make.inside(capsys, "info", path)
    assert (code, out, err.count("\n")) == (2, "", 1) and name in err
    pattern = make.write_sequence(tmp_path, (1, 2))
    blur = "blur", pattern, "-o", tmp_path / "o.####.exr", "--method", "tap", "--holdout", path
    code, out, err = make.inside(capsys, *blur)
    assert (code, err.count("\n")) == (2, 1) and name in err


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ("clip.mp", "clip.mp4"),
        ("Clip.MP4", "clip.mp4"),
        ("clip.mov", "clip.mp4"),  # the video, not the note on it
        ("cilp.mp4", "clip.mp4"),
        ("take3.mp4", "take2.mp4"),
        ("shot.0009.exr", "shot.0003.exr"),
        ("shot.0002.png", "shot.0002.exr"),
        ("sot.0002.exr", "shot.0002.exr"),
        ("0007.png", ""),
        ("clip.txt.bak", ""),
        ("other.mp4", ""),
    ],
)
def test_a_file_that_is_not_there_has_a_near_name(tmp_path, asked, meant):
    for name in ("clip.mp4", "take1.mp4", "take2.mp4", *(f"shot.000{n}.exr" for n in (1, 2, 3))):
        (tmp_path / name).write_bytes(bytes(500))
    (tmp_path / "clip.txt").write_bytes(b"note")
    if (tmp_path / asked).exists():
        pytest.skip("capitals do not count on this disk")
    end = f"; did you mean '{tmp_path / meant}'?" if meant else ""
    assert str(bounded.missing(tmp_path / asked)) == f"{tmp_path / asked}: no such file{end}"


def test_a_folder_that_is_not_there_is_named(tmp_path):
    text = str(bounded.missing(tmp_path / "no" / "clip.mp4"))
    assert text.endswith(f"no such file; there is no folder {tmp_path / 'no'}")
