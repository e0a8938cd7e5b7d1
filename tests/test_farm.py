"""A farm: parts of a job on many workers. The driver alone first, then real workers."""

import collections
import contextlib
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import farm_stubs
import pytest

import make_frames as make
from wgmb import BatchReport, DeviceError, InputError, farm_driver
from wgmb import farm as farming
from wgmb.color_settings import ColorSettings
from wgmb.farm import Farm, as_farm_job
from wgmb.farm_crew import size_of_part
from wgmb.farm_driver import Driver
from wgmb.farm_worker import WorkerState
from wgmb.io.settled import numbers
from wgmb.job import Asked, settle
from wgmb.outcome import Outcome
from wgmb.settings import BlurSettings, InputSettings, OutputSettings, ShutterSettings
from wgmb.video_settings import VideoSettings

COUNT = 12


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, COUNT + 1))


def job_of(pattern, folder, **more):
    return settle(
        Asked(
            pattern=str(pattern),
            output=OutputSettings(output=str(folder / "o.####.exr"), **more),
            look=BlurSettings(method="tap", samples=4),
            when=ShutterSettings(),
            given=InputSettings(),
            color=ColorSettings(),
            video=VideoSettings(),
        )
    )


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in Path(folder).iterdir()}


# ---- the driver, with workers that are none -------------------------------------------------


class Future:
    def __init__(self, status, value):
        self.status, self._value, self.told = status, value, None

    def add_done_callback(self, tell):
        self.told = tell
        if self.status != "pending":
            tell(self)

    def result(self, timeout=None):
        return self._value

    exception = result

    def release(self):
        self.released = True


class LostResult(Future):
    def result(self, timeout=None):
        raise OSError("connection refused")


class Client:
    """Workers by name; `behave(name, numbers)` gives an Outcome, an error, or None: it dies."""

    def __init__(self, states: dict[str, WorkerState | BaseException], behave):
        self.states, self._behave, self.status = dict(states), behave, "running"
        self.given: list[tuple[str, list[int]]] = []
        self._born = collections.Counter()

    def subscribe_topic(self, topic, handler):
        pass

    def register_plugin(self, plugin, name):
        pass

    def run_on_scheduler(self, function):
        return list(self.states)

    def run(self, function, *_, workers=(), **__):
        return {address: self.states.get(address) for address in workers}

    def submit(self, function, run, ranges, *, key, workers, pure):
        (address,) = workers
        chosen = numbers(ranges)
        self.given.append((address, chosen))
        found = self._behave(address.partition("#")[0], chosen)
        if found is None:
            state = self.states.pop(address)
            name = address.partition("#")[0]
            self._born[name] += 1
            self.states[f"{name}#{self._born[name]}"] = state
            return Future("pending", None)
        if found == "died with its result":
            self.states[address] = OSError("connection refused")
            self.states[address + "#1"] = GOOD
            return LostResult("finished", None)
        if found == "gone":
            self.status = "connecting"
            return Future("cancelled", None)
        return Future("error" if isinstance(found, BaseException) else "finished", found)


def well(chosen, **more) -> Outcome:
    report = BatchReport(done=list(chosen), **more)
    return Outcome(len(chosen), (1, COUNT), "", False, [], report, sizes={(64, 48): list(chosen)})


GOOD = WorkerState("0", "here", 1)
NO_GPU = WorkerState("1", "there", 2, "no GPU adapter", lacks_gpu=True)


@pytest.fixture
def drive(shot, tmp_path, monkeypatch):
    """Runs a job on such workers; returns the outcome, the client, what was said and ticked."""
    monkeypatch.setattr(farm_driver, "_LOOK", 0.0)

    def run(states, behave, patience=0.3, cluster="tcp://x"):
        notes, ticks = [], []
        client = Client(states, behave)
        place = Farm(cluster, note=notes.append, patience=patience)
        job = job_of(shot, tmp_path)
        driver = Driver(place, client, job, "", lambda n, state: ticks.append((n, state)))
        return driver.run(), client, notes, ticks

    return run


def test_every_frame_is_given_once_and_counted_once(drive):
    states = {"a": GOOD, "b": GOOD}
    outcome, client, notes, ticks = drive(states, lambda name, chosen: well(chosen))
    assert outcome.report.done == list(range(1, COUNT + 1))
    assert sorted(n for n, _ in ticks) == outcome.report.done
    assert {name for name, _ in client.given} == {"a", "b"}
    assert [len(chosen) for _, chosen in client.given] == [4, 4, 4]
    assert not notes


def test_a_worker_without_a_gpu_is_given_nothing_and_named_once(drive):
    outcome, client, notes, _ = drive({"a": GOOD, "b": NO_GPU}, lambda name, chosen: well(chosen))
    assert len(outcome.report.done) == COUNT
    assert {name for name, _ in client.given} == {"a"}
    assert notes == ["worker 1 on there does nothing: no GPU adapter"]


def test_a_worker_without_wgmb_is_named(drive):
    states = {"a": GOOD, "b": ModuleNotFoundError("No module named 'wgmb'")}
    outcome, _, notes, _ = drive(states, lambda name, chosen: well(chosen))
    assert len(outcome.report.done) == COUNT
    assert notes == ["worker b does nothing: ModuleNotFoundError: No module named 'wgmb'"]


@pytest.mark.parametrize(
    ("state", "error"),
    [(NO_GPU, DeviceError), (WorkerState("1", "x", 1, "in/a.exr is gone"), InputError)],
    ids=["no GPU", "no files"],
)
def test_where_no_worker_can_do_it_the_reason_is_an_error(drive, state, error):
    with pytest.raises(error, match=state.why_not):
        drive({"b": state}, None)


def test_a_cluster_without_workers_is_an_error_after_a_while(drive):
    with pytest.raises(InputError, match="no worker can do this: no worker in"):
        drive({}, None)


def test_a_frame_that_kills_its_worker_twice_is_named_and_the_others_are_done(drive):
    deaths = collections.Counter()

    def behave(name, chosen):
        if 6 in chosen:
            deaths[len(chosen)] += 1
            return None
        return well(chosen)

    outcome, _, _, ticks = drive({"a": GOOD, "b": GOOD}, behave)
    assert outcome.report.failed == {6: "its worker died twice"}
    assert outcome.report.done == [n for n in range(1, COUNT + 1) if n != 6]
    assert deaths == {4: 2, 1: 2}
    assert (6, "failed") in ticks


def test_a_worker_that_dies_once_costs_nothing(drive):
    died = []

    def behave(name, chosen):
        if 6 in chosen and not died:
            died.append(name)
            return None
        return well(chosen)

    outcome, client, *_ = drive({"a": GOOD}, behave)
    assert (len(outcome.report.done), outcome.report.failed) == (COUNT, {})
    assert len(client.given) == 4


def test_a_worker_that_dies_with_its_result_is_given_nothing_else(drive):
    """The scheduler may still list it for a moment."""
    died = []

    def behave(name, chosen):
        if not died:
            died.append(chosen)
            return "died with its result"
        return well(chosen)

    outcome, client, *_ = drive({"a": GOOD}, behave)
    assert (len(outcome.report.done), outcome.report.failed) == (COUNT, {})
    assert [address for address, _ in client.given] == ["a", "a#1", "a#1", "a#1"]


def test_a_part_that_cannot_be_begun_is_tried_again_and_a_worker_that_never_can_is_left_out(drive):
    def behave(name, chosen):
        return well(chosen) if name == "a" else InputError("no such folder")

    outcome, client, notes, _ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert len(outcome.report.done) == COUNT
    assert sum(name == "b" for name, _ in client.given) <= 2
    assert notes in ([], ["worker 1 on there does nothing: no such folder"])


def test_a_part_that_nobody_can_begin_fails_with_the_reason(drive):
    def behave(name, chosen):
        return ZeroDivisionError("a fault") if 5 in chosen else well(chosen)

    outcome, *_ = drive({"a": GOOD, "b": GOOD}, behave)
    assert set(outcome.report.failed) == {5, 6, 7, 8}
    assert set(outcome.report.failed.values()) == {"ZeroDivisionError: a fault"}
    assert len(outcome.report.done) == COUNT - 4


def test_a_worker_that_cannot_write_is_left_out_and_others_write_its_frames(drive):
    def behave(name, chosen):
        if name == "b":
            failed = dict.fromkeys(chosen[1:], "full")
            made = well(chosen[:1], failed=failed, stopped="out: no space left")
            made.sizes = {(64, 48): chosen[:1]}
            return made
        return well(chosen)

    outcome, _, notes, _ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert outcome.report.done == list(range(1, COUNT + 1))
    assert (outcome.report.failed, outcome.report.stopped) == ({}, "")
    assert notes == ["worker 1 on there does nothing: out: no space left"]


def test_where_nobody_can_write_the_run_stops_and_says_why(drive):
    def behave(name, chosen):
        return well([], failed=dict.fromkeys(chosen[:3], "full"), stopped="out: no space left")

    outcome, *_ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert outcome.report.stopped == "no worker is left: out: no space left"
    assert outcome.report.done == []
    assert outcome.rest == COUNT - len(outcome.report.failed)


def test_a_scheduler_that_is_gone_is_one_reason(drive):
    def behave(name, chosen):
        return "gone" if 6 in chosen else well(chosen)

    outcome, *_ = drive({"a": GOOD}, behave)
    assert outcome.report.stopped.startswith("the scheduler is gone")
    assert outcome.report.done == [1, 2, 3, 4]
    assert outcome.rest == 8


@pytest.mark.fast
def test_parts_are_neither_tiny_nor_huge_and_many_for_each_worker():
    assert [size_of_part(*n) for n in ((8, 2), (64, 2), (1000, 2), (100_000, 64))] == [4, 8, 64, 64]


@pytest.mark.fast
def test_outcomes_of_parts_are_those_of_the_whole():
    """Masks that no part has are absent; those that one part has are not."""
    whole = Outcome(4, (1, 4), "", False, [])
    for numbers_, absent, cuts in (
        ([3, 4], ["a=1", "b=2"], {3}),
        ([1], ["b=2"], set()),
        ([2], ["b=2"], {2}),
    ):
        part = Outcome(len(numbers_), (1, 4), "", False, [], BatchReport(done=numbers_))
        part.absent, part.unseen, part.cuts = list(absent), [], cuts
        part.notes = {"deep": numbers_[:1]}
        whole.add(part)
    whole.end()
    assert (whole.report.done, whole.report.absent, whole.cuts) == ([1, 2, 3, 4], ["b=2"], {2, 3})
    assert (whole.notes, whole.rest) == ({"deep": [1, 2, 3]}, 0)


@pytest.mark.fast
def test_numbers_of_another_process_take_no_memory_of_their_own():
    mine = list(range(1000, 1004))
    sent = Outcome(4, (1000, 1003), "", False, [], BatchReport(done=list(mine)))
    sent.notes, sent.sizes = {"deep": [1002]}, {(64, 48): list(mine), (8, 8): [5000]}
    whole = pickle.loads(pickle.dumps(sent))
    assert whole.report.done[0] is not mine[0]
    whole.share(mine)
    assert whole == sent
    for got in (whole.report.done, whole.sizes[64, 48]):
        assert all(a is b for a, b in zip(got, mine, strict=True))
    assert whole.notes["deep"][0] is mine[2]


# ---- workers that are real ------------------------------------------------------------------


DASK_LEAVES_SOCKETS = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)


def words(pattern, out, *more) -> list[str]:
    line = ("blur", pattern, "-o", out / "o.####.exr", "--method", "tap", "--samples", 4, *more)
    return list(map(str, line))


@pytest.fixture(scope="module")
def whole(shot, tmp_path_factory):
    out = tmp_path_factory.mktemp("whole")
    assert make.command(*words(shot, out)).returncode == 0
    return contents(out)


@DASK_LEAVES_SOCKETS
def test_two_workers_make_the_same_bytes_and_a_frame_that_cannot_be_read_fails_alone(
    tmp_path, capsys
):
    pattern = make.write_sequence(tmp_path, range(1, 10))
    damaged = tmp_path / "shot.0003.exr"
    damaged.write_bytes(damaged.read_bytes()[:-300])
    code, _, err = make.inside(capsys, *words(pattern, tmp_path / "whole"))
    assert code == 1
    more = ("--workers", 2, "--verbose")
    code, out, err = make.inside(capsys, *words(pattern, tmp_path / "out", *more))
    assert (code, out) == (1, "")
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")
    assert err.count("frame 3 failed") == 1
    assert "1 of 9 frames failed" in err
    assert "8 frames in" in err
    assert "worker 0: frames" in err


@DASK_LEAVES_SOCKETS
def test_workers_that_die_leave_nothing_but_whole_files(shot, whole, tmp_path):
    out, said = tmp_path / "out", []
    job = as_farm_job(job_of(shot, out))
    ticks = []
    farm = Farm(workers=2, details=said.append, plugin=farm_stubs.Killing)
    outcome = farm.blur(job, lambda n, state: ticks.append(n))
    assert outcome.report.failed == {5: "its worker died twice"}
    assert outcome.report.stopped == ""
    assert sorted(ticks) == list(range(1, COUNT + 1))
    names = {name: data for name, data in whole.items() if name != "o.0005.exr"}
    assert contents(out) == names
    assert sum("died" in text for text in said) == 5


@DASK_LEAVES_SOCKETS
def test_a_real_worker_without_a_gpu_is_named_once(shot, whole, tmp_path):
    notes = []
    farm = Farm(workers=2, note=notes.append, plugin=farm_stubs.WithoutGpu)
    outcome = farm.blur(as_farm_job(job_of(shot, tmp_path)))
    assert (outcome.report.failed, outcome.report.absent) == ({}, [])
    assert contents(tmp_path) == whole
    assert len(notes) == 1
    assert "does nothing: no GPU adapter" in notes[0]


@DASK_LEAVES_SOCKETS
def test_workers_have_the_environment_of_today(shot, whole, tmp_path, monkeypatch):
    """Though the process that they are forked from may have begun with another one."""
    job = as_farm_job(job_of(shot, tmp_path / "out"))
    monkeypatch.setenv("WGMB_ADAPTER", "nonsense")
    with pytest.raises(DeviceError, match="no adapter matches 'nonsense'; found"):
        Farm(workers=1).blur(job)
    monkeypatch.setenv("WGMB_ADAPTER", "")
    assert not Farm(workers=1).blur(job).report.failed
    assert contents(tmp_path / "out") == whole


@DASK_LEAVES_SOCKETS
def test_a_worker_that_is_named_is_so_in_the_words_of_the_command_line(
    shot, tmp_path, capsys, monkeypatch
):
    monkeypatch.setenv("VK_ICD_FILENAMES", os.devnull)
    code, _, err = make.inside(capsys, *words(shot, tmp_path / "out", "--workers", 1))
    assert code == 3
    assert "worker 0 on" in err
    assert "`device=" not in err


@pytest.fixture(scope="module")
def long_shot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("long")
    for n in range(1, 4):
        make.write_exr(folder / f"of.{n}.exr", make.frame(n))
    for n in range(1, 401):
        (folder / f"shot.{n:04d}.exr").hardlink_to(folder / f"of.{(n - 1) % 3 + 1}.exr")
    return str(folder / "shot.####.exr")


def long_words(pattern, out, *more):
    return words(pattern, out, "--vectors", "blender", "--resume", *more)


def made(out) -> int:
    return len(list(out.glob("o.*.exr")))


def test_an_interrupted_farm_ends_its_frames_and_goes_on_later(long_shot, tmp_path, capsys):
    out = tmp_path / "out"
    line = long_words(long_shot, out, "--workers", 2)
    process = make.begun(line, lambda: made(out) >= 8)
    process.send_signal(signal.SIGINT)
    said, err = process.communicate(timeout=60)
    assert (process.returncode, said, err) == (130, "", "wgmb: interrupted\n")
    count = made(out)
    assert 8 <= count < 400
    assert len(contents(out)) == count  # nothing half written
    time.sleep(1)
    assert made(out) == count  # nobody goes on
    some = ("--frames", f"1-{count + 4}")
    code, _, err = make.inside(capsys, *long_words(long_shot, out, *some))
    assert code == 0
    assert "already done" in err


@contextlib.contextmanager
def scheduler_and_worker(folder):
    """Processes of dask.distributed as a farm has them; the address."""
    folder.mkdir()
    file = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    env = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, sys.path))}
    line = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, *line, "--scheduler-file", file], env=env, **quiet)
    line = ["worker", "--no-dashboard", "--nthreads", "1", "--no-nanny", "--death-timeout", "20"]
    worker = subprocess.Popen([*dask, *line, "--scheduler-file", file], env=env, **quiet)
    try:
        ends = time.monotonic() + 60
        while not (file.exists() and file.read_text().endswith("}")):
            assert time.monotonic() < ends
            time.sleep(0.05)
        yield scheduler, file.read_text().split('"address": "')[1].split('"')[0]
    finally:
        for process in (worker, scheduler):
            process.kill()
            process.wait()


def test_a_scheduler_that_is_lost_is_one_line_and_resume_goes_on(long_shot, tmp_path):
    out = tmp_path / "out"
    with scheduler_and_worker(tmp_path / "first") as (scheduler, address):
        process = make.begun(
            long_words(long_shot, out, "--cluster", address), lambda: made(out) >= 8
        )
        scheduler.kill()
        said, err = process.communicate(timeout=60)
    assert (process.returncode, said) == (1, "")
    lines = err.splitlines()
    assert lines[0].startswith("wgmb: stopped: the scheduler is gone")
    assert "--resume" in lines[0]
    assert not [name for name in contents(out) if not name.startswith("o.")]
    last = f"1-{made(out) + 6}"
    with scheduler_and_worker(tmp_path / "second") as (_, address):
        done = make.command(*long_words(long_shot, out, "--cluster", address, "--frames", last))
    assert done.returncode == 0, done.stderr
    assert "already done" in done.stderr


# ---- words ----------------------------------------------------------------------------------


@DASK_LEAVES_SOCKETS
@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("--workers 0", "--workers must be 1 to 256 or auto"),
        ("--workers 2 --cluster tcp://a:1", "choose either --workers, on this machine, or"),
        ("--workers 2 -o o.mp4", "a video is written by one process; write frames"),
        ("--cluster tcp://127.0.0.1:1", "no scheduler at tcp://127.0.0.1:1"),
        ("--cluster nonsense://x", "no scheduler at nonsense://x"),
    ],
)
def test_senseless_words_are_one_line(shot, tmp_path, capsys, monkeypatch, more, says):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(farming, "_CONNECT", 1)
    line = [*([] if "-o" in more else ["-o", "o.####.exr"]), *more.split()]
    code, out, err = make.inside(capsys, "blur", shot, *line)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err


def test_without_distributed_one_line_says_what_to_install(shot, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    code, _, err = make.inside(capsys, *words(shot, tmp_path, "--workers", 2))
    assert code == 2
    assert err == (
        "wgmb: --workers and --cluster: dask.distributed is not installed: "
        "pip install 'wgmb[cluster]'\n"
    )
