"""Runs that wait for what never comes: a signal ends them in time, and nothing is left."""

import contextlib
import os
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path
from unittest import mock

import pytest
from measured_farm import is_worker

import make_frames as make
from wgmb.cli import app

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")

MADE = Path(make.__file__).parent
COUNT = 40  # frames


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """Frames (of three pictures); the pattern that stands for them."""
    folder = tmp_path_factory.mktemp("shot")
    for n in range(1, 4):
        make.write_exr(folder / f"of.{n}.exr", make.frame(n))
    for n in range(1, COUNT + 1):
        (folder / f"shot.{n:04d}.exr").hardlink_to(folder / f"of.{(n - 1) % 3 + 1}.exr")
    return folder / "shot.####.exr"


WITHIN = 5.0  # seconds, for a run that waits for what never comes


def relatives(process) -> list[int]:
    """The processes of a run's session that have not ended."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            words = status.read_text().rpartition(")")[2].split()
            if int(words[3]) == process.pid and words[0] != "Z":
                found.append(int(status.parent.name))
    return found


class Place:
    """Folders of a run, and the flag that stops its disk."""

    def __init__(self, folder):
        self.out, self.flag = folder / "out", folder / "flag"
        self.out.mkdir()
        # Sockets of workers' processes lie in it, whose names must be short.
        self.temporary = Path(tempfile.mkdtemp(prefix="t", dir="/tmp"))

    def run(self, has_begun, *words, name="", **options):
        """Begin a run; the disk is asked for files with `name`."""
        line = ["-m", "hanging", self.flag, name] if name else ["-m", "wgmb"]
        env = os.environ | {"TMPDIR": str(self.temporary), "PYTHONPATH": str(MADE)}
        with mock.patch.object(make, "COMMAND", [sys.executable, "-P", *map(str, line)]):
            return make.begun(words, has_begun, env=env, start_new_session=True, **options)

    def begun(self) -> bool:
        """Return True once something is under way, and stop the disk."""
        if any(self.out.iterdir()):
            self.flag.touch()
            time.sleep(0.5)
            return True
        return False

    def check(self, process, *numbers, within=WITHIN, to_group=False):
        """Signals end it in time, with its exit code and one line, and nothing is left."""
        begun = time.monotonic()
        for number in numbers:
            (os.killpg if to_group else os.kill)(process.pid, number)
            time.sleep(0.3)
        try:
            _, err = process.communicate(timeout=60)
            took, ends = time.monotonic() - begun, time.monotonic() + 2
            while (left := relatives(process)) and time.monotonic() < ends:
                time.sleep(0.02)  # what ends with the run does so after it
        finally:
            for pid in relatives(process):
                os.kill(pid, signal.SIGKILL)
        assert (process.returncode, left) == (130, [])
        assert err.splitlines()[-1] == "wgmb: interrupted"
        assert (err.count("interrupted"), "Traceback" in err) == (1, False)
        assert took < within
        files = [*self.out.rglob("*"), *self.temporary.rglob("*")]
        assert [p for p in files if ".part" in p.name or self.temporary in p.parents] == []
        assert list(self.out.glob("*.segments")) == []


@pytest.fixture
def place(tmp_path):
    place = Place(tmp_path)
    yield place
    shutil.rmtree(place.temporary)


@pytest.fixture(scope="module")
def video(tmp_path_factory, shot):
    path = tmp_path_factory.mktemp("video") / "clip.mp4"
    line = ["blur", shot, "-o", path, "--vectors", "blender", "--method", "tap", "-q"]
    assert app.main(list(map(str, line))) == 0
    return path


FULL = pytest.mark.full
KINDS = {
    "blur": ("blur", "SHOT", "-o", "OUT/o.####.exr", "--vectors", "blender"),
    "video": ("blur", "VIDEO", "-o", "OUT/o.mkv", "--flow", "none"),
    "resumed": ("blur", "VIDEO", "-o", "OUT/o.mkv", "--flow", "none", "--resume"),
    "vectors": ("vectors", "SHOT", "-o", "OUT/o.####.exr", "--as", "nuke"),
    "render": ("render", "crossing", "-o", "OUT/o.####.exr", "--frames", "1-90", "--size", "64x36"),
    "perceive": ("perceive", "SHOT", "-o", "OUT/o.####.exr"),
}


@pytest.mark.parametrize(
    ("kind", "name", "number"),
    [("blur", "shot.", "SIGINT"), ("blur", ".part", "SIGHUP"), ("resumed", ".part", "SIGTERM"),
     *(pytest.param(kind, ".part", "SIGTERM", marks=FULL)
       for kind in ("vectors", "render", "perceive"))],
)  # fmt: skip
def test_a_disk_that_does_not_answer_holds_back_no_end(place, shot, video, kind, name, number):
    words = {"SHOT": str(shot), "VIDEO": str(video), "OUT": str(place.out)}
    line = [place_in(word, words) for word in KINDS[kind]]
    process = place.run(place.begun, *line, name=name)
    place.check(process, signal.Signals[number])


def place_in(word: str, words: dict[str, str]) -> str:
    for name, value in words.items():
        word = word.replace(name, value)
    return word


def test_a_second_ctrl_c_ends_a_run_at_once(place, shot):
    line = "blur", shot, "-o", place.out / "o.####.exr", "--vectors", "blender"
    process = place.run(place.begun, *line, name=".part")
    place.check(process, signal.SIGINT, signal.SIGINT, within=3)


@pytest.mark.parametrize("end", ["input", "output"])
def test_a_pipe_that_nobody_serves_holds_back_no_end(place, video, end):
    reads, writes = os.pipe()
    line, options = ["blur", "-", "-o", place.out / "o.mkv"], {"stdin": reads}
    if end == "output":
        line, options = ["blur", video, "-o", "-"], {"stdin": reads, "stdout": writes}
    started = time.monotonic()
    process = place.run(
        lambda: time.monotonic() > started + 3, *line, "--flow", "none", "-q", **options
    )
    place.check(process, signal.SIGTERM)
    os.close(reads), os.close(writes)


@pytest.mark.parametrize("number", [signal.SIGHUP, pytest.param(signal.SIGINT, marks=FULL)])
def test_a_named_pipe_that_nobody_opens_holds_back_no_end(place, number):
    os.mkfifo(place.out / "in.y4m")
    started = time.monotonic()
    line = "blur", place.out / "in.y4m", "-o", place.out / "o.mkv"
    process = place.run(lambda: time.monotonic() > started + 2, *line)
    place.check(process, number)


@pytest.mark.parametrize("to_all", [False, pytest.param(True, marks=FULL)], ids=["one", "all"])
def test_workers_that_are_stopped_hold_back_no_end(place, shot, to_all):
    line = "blur", shot, "-o", place.out / "o.####.exr", "--vectors", "blender", "--workers", 2
    process = place.run(lambda: any(place.out.glob("o.*")), *line)
    workers = [pid for pid in relatives(process) if is_worker(pid)]
    assert len(workers) == 2
    os.kill(workers[0], signal.SIGSTOP)
    if to_all:
        os.killpg(process.pid, signal.SIGHUP)
    place.check(process, signal.SIGTERM)


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=FULL)])
def test_workers_that_are_still_starting_hold_back_no_end(place, shot, number):
    """The process that they are forked from loads its modules, and hears nothing meanwhile."""
    line = "blur", shot, "-o", place.out / "o.####.exr", "--vectors", "blender", "--workers", 2
    process = place.run(lambda: has_forker(place), *line)
    place.check(process, number)


@pytest.mark.parametrize("number", ["SIGHUP", *(pytest.param(n, marks=FULL)
                                                 for n in ("SIGINT", "SIGTERM"))])  # fmt: skip
@pytest.mark.parametrize(
    "is_late", [False, pytest.param(True, marks=FULL)], ids=["starting", "blurring"]
)
def test_a_terminal_that_is_closed_ends_all_processes_in_one_line(place, shot, number, is_late):
    """It sends the signal to each of them."""
    line = "blur", shot, "-o", place.out / "o.####.exr", "--vectors", "blender", "--workers", 2
    is_first = any if is_late else lambda found: has_workers_begun(place)
    process = place.run(lambda: is_first(place.out.glob("o.*")), *line)
    place.check(process, signal.Signals[number], to_group=True)


def has_workers_begun(place) -> bool:
    """Return True a moment after the process that forks workers is there."""
    time.sleep(0.2)
    return has_forker(place)


def has_forker(place) -> bool:
    """Return True once the connection of the process that forks workers is there."""
    return any(place.temporary.glob("pymp-*/listener-*"))


def ignore_hangups():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does


def test_a_run_under_nohup_outlives_its_terminal(place, shot):
    line = "blur", shot, "-o", place.out / "o.####.exr", "--frames", "1-16"
    process = place.run(lambda: any(place.out.glob("o.*")), *line, preexec_fn=ignore_hangups)
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=60)
    assert (process.returncode, len(list(place.out.glob("o.*")))) == (0, 16)
