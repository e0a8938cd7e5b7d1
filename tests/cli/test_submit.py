"""Jobs for programs that give work to machines: OpenJD templates, SLURM scripts."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import make_frames as make
from wgmb import InputError
from wgmb.cli.submit import (
    MOST_TASKS,
    openjd,
    openjd_ranges,
    slurm,
)
from wgmb.io.frame_numbers import frame_numbers
from wgmb.sequence.findings import ranges

OPENJD = [sys.executable, "-c", "from openjd.cli import main; main()"]
NUMBERS = [-6, -4, -2, 0, 1, 2]
FRAMES = "--frames=-6-0x2,1-2"
FOLDERS = ["plain", "with spaces", 'it\'s "quoted" $HOME; x', "Büro 東京"]
# In place of the program: its arguments are kept, for the test to run them.
RECORDER = """#!/bin/sh
{ for word in "$@"; do printf '%s\\n' "$word"; done; echo; } >>"$CALLS"
"""


@pytest.fixture(params=FOLDERS)
def desk(request, tmp_path, monkeypatch):
    """A folder with frames, and a recorder in place of the program."""
    folder = tmp_path / request.param
    (folder / "in").mkdir(parents=True)
    program = tmp_path / "bin" / "wgmb"
    program.parent.mkdir()
    program.write_text(RECORDER)
    program.chmod(0o755)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("CALLS", str(tmp_path / "calls"))
    make.write_sequence(folder / "in", range(-6, 4))
    return folder


def written(capsys, *more) -> None:
    words = ("in/shot.####.exr", "-o", "out/o.####.exr", "-j", "shot.json", "--method", "tap")
    code, _, err = make.inside(capsys, "job", *words, FRAMES, *more)
    assert code == 0, err


def ran(line, **env) -> str:
    environ = os.environ | {name: str(value) for name, value in env.items()}
    done = subprocess.run(line, capture_output=True, text=True, timeout=240, env=environ)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def check_calls(capsys, count: int) -> None:
    """The program's calls together make the results of one run."""
    calls = Path(os.environ["CALLS"]).read_text().split("\n\n")[:-1]
    assert len(calls) == count
    os.chdir("..")  # the machines do not run in this folder
    for call in calls:
        code, _, err = make.inside(capsys, *call.split("\n"))
        assert code == 0, err
    os.chdir(next(p for p in Path.cwd().iterdir() if p.name in FOLDERS))
    words = ("in/shot.####.exr", "-o", "whole/o.####.exr", "--method", "tap", FRAMES)
    assert make.inside(capsys, "blur", *words)[0] == 0
    parts, whole = ({p.name: p.read_bytes() for p in Path(f).iterdir()} for f in ("out", "whole"))
    assert len(whole) == len(NUMBERS)
    assert parts == whole


@pytest.mark.covers(0)
@pytest.mark.parametrize("desk", FOLDERS[2:], indirect=True)
def test_an_openjd_template_is_checked_and_run(desk, capsys):
    written(capsys, "--chunk", 4, "--openjd", "shot.yaml")
    assert "passes validation" in ran([*OPENJD, "check", "shot.yaml"])
    ran([*OPENJD, "run", "shot.yaml"])
    check_calls(capsys, 2)


def test_a_slurm_script_is_run_for_every_task(desk, capsys):
    written(capsys, "--chunk", 4, "--slurm", "shot.sh")
    assert "--array=0-1\n" in Path("shot.sh").read_text()
    for task in (0, 1):
        ran(["bash", "shot.sh"], SLURM_ARRAY_TASK_ID=task)
    check_calls(capsys, 2)


@pytest.mark.parametrize("desk", FOLDERS[:1], indirect=True)
def test_files_of_others_are_not_replaced_and_own_ones_are(desk, capsys):
    words = ("in/shot.####.exr", "-o", "out/o.####.exr", "-j", "shot.json", FRAMES)
    for option, name, text in (
        ("--openjd", "a.yaml", "exists and was not written by wgmb job"),
        ("--slurm", "a.sh", "exists and was not written by wgmb job"),
        ("--openjd", "b.txt", "must end in .yaml"),
        ("--slurm", "b.txt", "must end in .sh"),
        ("--openjd", "in/b.yaml", "must lie in the folder of shot.json"),
    ):
        if name.startswith("a"):
            Path(name).write_text("mine")
        code, _, err = make.inside(capsys, "job", *words, option, name)
        assert (code, err.count("\n")) == (2, 1)
        assert text in err
        assert not Path("shot.json").exists()
    assert Path("a.sh").read_text() == "mine"
    for _ in range(2):
        written(capsys, "--openjd", "shot.yaml", "--slurm", "shot.sh")


@pytest.mark.fast
@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ([1, 2, 3], "1-3"),
        ([1, 3, 5], "1-5:2"),
        ([7], "7"),
        (NUMBERS, "-6-0:2,1-2"),
        ([-3, -2, -1], "-3--1"),
        ([1, 4, 5, 6, 90], "1,4-6,90"),
    ],
)
def test_frames_are_written_in_the_ranges_of_openjd_which_wgmb_reads_too(numbers, text):
    from openjd.model import IntRangeExpr

    assert openjd_ranges(ranges(numbers)) == text
    assert list(IntRangeExpr.from_str(text)) == numbers
    assert frame_numbers(text) == numbers
    part = str(IntRangeExpr.from_list(numbers))  # what a task is given
    assert sorted(frame_numbers(part)) == numbers


@pytest.mark.fast
def test_frames_with_too_many_gaps_for_a_template_are_one_line(tmp_path):
    with pytest.raises(InputError, match="an OpenJD template takes 1024; write jobs of fewer"):
        openjd(tmp_path / "a.yaml", tmp_path / "a.json", [n * n for n in range(300)], 16)


@pytest.mark.fast
def test_an_array_has_no_more_tasks_than_slurm_takes(tmp_path):
    text = slurm(tmp_path / "a.sh", tmp_path / "a.json", range(1, 100_001), 16)
    assert f"--array=0-{MOST_TASKS - 1}\n" in text
    assert "    1-100\n" in text
    assert "    99901-100000\n" in text


@pytest.mark.fast
@pytest.mark.parametrize("name", ["s\ntouch pwned #.sh", "y\r#SBATCH --wrap=x.sh", "\x1b[2J.sh"])
def test_the_name_of_a_script_is_no_command_in_it(tmp_path, name):
    with pytest.raises(InputError, match="its name has control characters"):
        slurm(tmp_path / name, tmp_path / "a.json", [1, 2], 16)
