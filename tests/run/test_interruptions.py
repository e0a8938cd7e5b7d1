"""Interrupted runs leave whole files only; killed ones are tried by the soak, in test_soak.py."""

import contextlib
import itertools
import os
import signal
import subprocess
import sys

import pytest

import make_frames as make
from wgmb import Blur
from wgmb.cli import app, terminal

LONG = 64  # frames: many more than a run makes before it is interrupted


@pytest.fixture(scope="module")
def long_shot(tmp_path_factory):
    """Frames (of three pictures) by the dozen, and what an unbroken run makes of them."""
    folder = tmp_path_factory.mktemp("long")
    for n in range(1, 4):
        make.write_exr(folder / f"of.{n}.exr", make.frame(n))
    for n in range(1, LONG + 1):
        (folder / f"shot.{n:04d}.exr").hardlink_to(folder / f"of.{(n - 1) % 3 + 1}.exr")
    pattern = str(folder / "shot.####.exr")
    assert app.main(list(map(str, arguments(pattern, folder / "whole", "-q")))) == 0
    whole = {p.name: p.read_bytes() for p in (folder / "whole").iterdir()}
    assert len(whole) == LONG
    return pattern, whole


def arguments(pattern, out, *more):
    # A constant convention: the frames do not follow each other.
    return ("blur", pattern, "-o", out / "o.####.exr", "--vectors", "blender", *more)


def made(out) -> int:
    return len(list(out.glob("o.*.exr")))


def ignore_ctrl_c():
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # as a shell does for what runs in the background


@pytest.mark.parametrize(
    ("number", "prepare"),
    [
        (signal.SIGINT, None),
        pytest.param(signal.SIGTERM, None, marks=pytest.mark.full),
        pytest.param(signal.SIGTERM, ignore_ctrl_c, marks=pytest.mark.full),
    ],
    ids=["Ctrl-C", "SIGTERM", "SIGTERM in the background"],
)
def test_an_interrupted_run_ends_with_130_one_line_and_whole_files(
    tmp_path, long_shot, number, prepare
):
    pattern, whole = long_shot
    out = tmp_path / "out"
    line = arguments(pattern, out, "--resume")
    process = make.begun(line, lambda: made(out) >= 5, preexec_fn=prepare)
    process.send_signal(number)
    said, err = process.communicate(timeout=20)
    assert (process.returncode, said) == (130, "")
    assert make.error_lines(err) == ["wgmb: interrupted"]
    got = {p.name: p.read_bytes() for p in out.iterdir()}
    assert 5 <= len(got) < LONG
    assert got.items() <= whole.items()


@pytest.mark.parametrize("suffix", ["mp4", pytest.param("gif", marks=pytest.mark.full)])
def test_an_interrupted_video_leaves_nothing(tmp_path, long_shot, suffix):
    pattern, _ = long_shot
    out, said = tmp_path / "out", tmp_path / "said.txt"
    line = ["blur", pattern, "-o", out / f"v.{suffix}", "--samples", "512", "--verbose"]
    with said.open("w") as file:
        process = make.begun(line, lambda: "settings: " in said.read_text(), stderr=file)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
    assert process.returncode == 130
    assert said.read_text().endswith("\nwgmb: interrupted\n")
    assert make.names_in(out) == []


def test_an_interruption_that_python_lost_is_heard_at_the_next_frame(
    tmp_path, long_shot, monkeypatch
):
    """Exceptions that a signal raises within a destructor are dropped."""
    calls = itertools.count()
    blur = Blur.__call__

    def blurred(*given):
        if next(calls) == 3:
            with contextlib.suppress(KeyboardInterrupt):
                terminal.interrupt()
        return blur(*given)

    monkeypatch.setattr(Blur, "__call__", blurred)
    code = app.main(list(map(str, arguments(long_shot[0], tmp_path / "out", "-q"))))
    assert code == 130
    assert 0 < len(list((tmp_path / "out").glob("o.*.exr"))) < 10


@pytest.mark.parametrize("kind", [AssertionError, ImportError])
def test_a_library_that_breaks_when_it_is_interrupted_is_an_interruption(capsys, monkeypatch, kind):
    def broken(*_):
        terminal.interrupted.set()
        raise kind("half done")

    monkeypatch.setattr(app, "make_app", broken)
    assert app.main(["devices"]) == 130
    assert capsys.readouterr().err == "wgmb: interrupted\n"


def test_a_library_that_breaks_by_itself_is_not(monkeypatch):
    monkeypatch.setattr(app, "make_app", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        app.main(["devices"])


@pytest.mark.covers(1)
@pytest.mark.parametrize(("words", "code"), [("--version", 0), ("nonsense", 2)])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_after_the_end_changes_no_exit_code(words, code, number):
    script = (  # as libraries do, which the command loads
        "import atexit, os, time\n"
        "from wgmb.cli import app\n"
        "main, end = app.main, lambda: (os.write(1, b'over'), time.sleep(60))\n"
        "app.main = lambda words: atexit.register(end) and main(words)\n"
        f"app.run([{words!r}])\n"
    )
    line = [sys.executable, "-c", script]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        while b"over" not in os.read(process.stdout.fileno(), 100):
            pass
        process.send_signal(number)
        assert process.wait(timeout=20) == code


def test_what_a_half_made_object_raises_after_an_interruption_is_not_printed(capsys, monkeypatch):
    class HalfMade:
        def __del__(self):
            raise AttributeError("no attribute")

    monkeypatch.setattr("sys.unraisablehook", terminal.hush)
    HalfMade()
    assert "AttributeError: no attribute" in capsys.readouterr().err
    monkeypatch.setattr(terminal.interrupted, "is_set", lambda: True)
    HalfMade()
    assert capsys.readouterr().err == ""


def test_what_an_interruption_makes_of_an_error_is_an_interruption(capsys, monkeypatch):
    """A terminal that is closed cannot be written to: OSError, for its progress bar."""

    def broken(*_):
        terminal.interrupted.set()
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(app, "make_app", broken)
    assert app.main(["devices"]) == 130
