"""The driver of a farm, with workers that are none: what it gives to which of them."""

import collections
import pickle
import threading
import time

import pytest
from make_job import job_of

import make_frames as make
from wgmb import BatchReport, DeviceError, InputError
from wgmb.farm import driver as farm_driver
from wgmb.farm import merge
from wgmb.farm.driver import Driver
from wgmb.farm.farm import Farm
from wgmb.farm.plugin import WorkerState
from wgmb.farm.workers import size_of_part
from wgmb.io.frame_numbers import frame_list
from wgmb.sequence.findings import numbers

COUNT = 12


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, COUNT + 1))


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

    def end(self):
        self.status = "finished"
        self.told(self)

    def cancel(self):
        pass

    def release(self):
        self.released = True


class LostResult(Future):
    def result(self, timeout=None):
        raise OSError("connection refused")


class Client:
    """Workers by name; `behave(name, numbers)` gives a BatchReport, an error, or None: it dies."""

    def __init__(self, states: dict[str, WorkerState | BaseException], behave):
        self.states, self._behave, self.status = dict(states), behave, "running"
        self.signs: dict[str, float] = {}  # of workers that are silent, the last one
        self.given: list[tuple[str, list[int]]] = []
        self._born = collections.Counter()

    def subscribe_topic(self, topic, handler):
        pass

    def register_plugin(self, plugin, name):
        pass

    def run_on_scheduler(self, function):
        now = time.monotonic()
        return {address: self.signs.get(address, now) for address in self.states}

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
        if found == "silent":
            self.signs[address] = time.monotonic()
            return Future("pending", None)
        if found == "waits":
            return Future("pending", None)
        if found == "slow":
            future = Future("pending", well(chosen))
            threading.Timer(0.3, future.end).start()
            return future
        if found == "gone":
            self.status = "connecting"
            return Future("cancelled", None)
        return Future("error" if isinstance(found, BaseException) else "finished", found)


def well(chosen, **more) -> BatchReport:
    sizes = {(64, 48): list(chosen)}
    return BatchReport(done=list(chosen), total=len(chosen), sizes=sizes, **more)


GOOD = WorkerState("0", "here", 1)
NO_GPU = WorkerState("1", "there", 2, "no GPU adapter", lacks_gpu=True)


@pytest.fixture
def drive(shot, tmp_path, monkeypatch):
    """Runs a job on such workers; returns the report, the client, what was said and ticked."""
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
    report, client, notes, ticks = drive(states, lambda name, chosen: well(chosen))
    assert report.done == list(range(1, COUNT + 1))
    assert sorted(n for n, _ in ticks) == report.done
    assert {name for name, _ in client.given} == {"a", "b"}
    assert [len(chosen) for _, chosen in client.given] == [4, 4, 4]
    assert not notes


def test_a_worker_without_a_gpu_is_given_nothing_and_named_once(drive):
    report, client, notes, _ = drive({"a": GOOD, "b": NO_GPU}, lambda name, chosen: well(chosen))
    assert len(report.done) == COUNT
    assert {name for name, _ in client.given} == {"a"}
    assert notes == ["worker 1 on there does nothing: no GPU adapter"]


def test_a_worker_without_wgmb_is_named(drive):
    states = {"a": GOOD, "b": ModuleNotFoundError("No module named 'wgmb'")}
    report, _, notes, _ = drive(states, lambda name, chosen: well(chosen))
    assert len(report.done) == COUNT
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


def test_an_interruption_that_python_lost_ends_a_run_whose_workers_are_gone(shot, tmp_path):
    """Ctrl-C reaches workers too, which end; no frame is told of any more."""
    looks = []

    def check():
        looks.append(1)
        if len(looks) == 3:
            raise KeyboardInterrupt

    place = Farm("tcp://x", check=check)
    with pytest.raises(KeyboardInterrupt):
        Driver(place, Client({}, None), job_of(shot, tmp_path), "", lambda n, state: None).run()


def test_a_frame_that_kills_its_worker_twice_is_named_and_the_others_are_done(drive):
    deaths = collections.Counter()

    def behave(name, chosen):
        if 6 in chosen:
            deaths[len(chosen)] += 1
            return None
        return well(chosen)

    report, _, _, ticks = drive({"a": GOOD, "b": GOOD}, behave)
    assert report.failed == {6: "its worker died twice"}
    assert report.done == [n for n in range(1, COUNT + 1) if n != 6]
    assert deaths == {4: 2, 1: 2}
    assert (6, "failed") in ticks


def test_a_worker_that_dies_once_costs_nothing(drive):
    died = []

    def behave(name, chosen):
        if 6 in chosen and not died:
            died.append(name)
            return None
        return well(chosen)

    report, client, *_ = drive({"a": GOOD}, behave)
    assert (len(report.done), report.failed) == (COUNT, {})
    assert len(client.given) == 4


def test_a_worker_that_dies_with_its_result_is_given_nothing_else(drive):
    """The scheduler may still list it for a moment."""
    died = []

    def behave(name, chosen):
        if not died:
            died.append(chosen)
            return "died with its result"
        return well(chosen)

    report, client, *_ = drive({"a": GOOD}, behave)
    assert (len(report.done), report.failed) == (COUNT, {})
    assert [address for address, _ in client.given] == ["a", "a#1", "a#1", "a#1"]


def test_a_part_that_cannot_be_begun_is_tried_again_and_a_worker_that_never_can_is_left_out(drive):
    def behave(name, chosen):
        return well(chosen) if name == "a" else InputError("no such folder")

    report, client, notes, _ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert len(report.done) == COUNT
    assert sum(name == "b" for name, _ in client.given) <= 2
    assert notes in ([], ["worker 1 on there does nothing: no such folder"])


def test_frames_of_a_worker_whose_gpu_is_lost_are_done_by_others(drive):
    def behave(name, chosen):
        return well(chosen) if name == "a" else DeviceError("the GPU device was lost")

    report, client, notes, _ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert sorted(report.done) == list(range(1, COUNT + 1)) and not report.failed
    assert sum(name == "b" for name, _ in client.given) == 1
    assert notes == ["worker 1 on there does nothing: the GPU device was lost"]


def test_a_run_whose_workers_have_all_lost_their_gpu_is_an_error(drive):
    with pytest.raises(DeviceError, match="no worker is left: the GPU device was lost"):
        drive({"a": GOOD, "b": GOOD}, lambda name, chosen: DeviceError("the GPU device was lost"))


def test_a_part_that_nobody_can_begin_fails_with_the_reason(drive):
    def behave(name, chosen):
        return ZeroDivisionError("a fault") if 5 in chosen else well(chosen)

    report, *_ = drive({"a": GOOD, "b": GOOD}, behave)
    assert set(report.failed) == {5, 6, 7, 8}
    assert set(report.failed.values()) == {"ZeroDivisionError: a fault"}
    assert len(report.done) == COUNT - 4


def test_a_worker_that_cannot_write_is_left_out_and_others_write_its_frames(drive):
    def behave(name, chosen):
        if name == "b":
            failed = dict.fromkeys(chosen[1:], "full")
            made = well(chosen[:1], failed=failed, stopped="out: no space left")
            made.sizes = {(64, 48): chosen[:1]}
            return made
        return well(chosen)

    report, _, notes, _ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert report.done == list(range(1, COUNT + 1))
    assert (report.failed, report.stopped) == ({}, "")
    assert notes == ["worker 1 on there does nothing: out: no space left"]


def test_where_nobody_can_write_the_run_stops_and_says_why(drive):
    def behave(name, chosen):
        return well([], failed=dict.fromkeys(chosen[:3], "full"), stopped="out: no space left")

    report, *_ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert report.stopped == "no worker is left: out: no space left"
    assert report.done == []
    assert report.rest == COUNT - len(report.failed)


def test_a_scheduler_that_is_gone_is_one_reason(drive):
    def behave(name, chosen):
        return "gone" if 6 in chosen else well(chosen)

    report, *_ = drive({"a": GOOD}, behave)
    assert report.stopped.startswith("the scheduler is gone")
    assert report.done == [1, 2, 3, 4]
    assert report.rest == 8


def test_a_worker_that_is_silent_is_lost_and_its_frames_are_done_by_others(drive):
    """As one is that was stopped: its process says nothing, and ends nothing."""

    def behave(name, chosen):
        return "silent" if name == "b" else well(chosen)

    report, client, notes, _ = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert (report.done, report.failed) == (list(range(1, COUNT + 1)), {})
    assert [name for name, _ in client.given].count("b") == 1
    assert not notes


def test_a_worker_that_speaks_again_is_asked_again(shot, tmp_path, monkeypatch):
    driver = Driver(Farm("tcp://x"), Client({}, None), job_of(shot, tmp_path), "", print)
    now = [0.0]
    monkeypatch.setattr(farm_driver.time, "monotonic", lambda: now[0])
    for seconds, sign, is_there in ((1, 5.0, True), (59, 5.0, True), (62, 5.0, False),
                                    (63, 5.0, False), (64, 6.0, True)):  # fmt: skip
        now[0] = seconds
        driver._hear("b", sign)
        assert ("b" in driver._workers) == is_there
    assert driver._workers["b"].why_not is None


def test_a_part_that_never_ends_is_given_to_another_worker_and_the_first_result_counts(
    drive, monkeypatch
):
    """Its process speaks: it waits for a disk, say."""
    monkeypatch.setattr(farm_driver, "LATE", 0.1)

    def behave(name, chosen):
        return "waits" if name == "b" else well(chosen)

    report, client, notes, ticks = drive({"a": GOOD, "b": WorkerState("1", "there", 2)}, behave)
    assert (report.done, report.failed) == (list(range(1, COUNT + 1)), {})
    assert sorted(n for n, _ in ticks) == report.done
    (part,) = [chosen for name, chosen in client.given if name == "b"]
    assert ("a", part) in client.given
    assert notes == [
        f"worker 1 on there does nothing: it does not finish frames {frame_list(part)}"
    ]


def test_a_part_that_takes_long_is_left_to_its_worker_while_none_has_ended(drive, monkeypatch):
    monkeypatch.setattr(farm_driver, "LATE", 0.0)
    monkeypatch.setattr(farm_driver, "TIMES_LATE", 100)
    states = {"a": GOOD, "b": WorkerState("1", "there", 2)}
    report, client, notes, _ = drive(states, lambda name, chosen: "slow", patience=5)
    assert report.done == list(range(1, COUNT + 1))
    assert len(client.given) == 3
    assert not notes


@pytest.mark.parametrize("silent", ["run_on_scheduler", "run"])
def test_an_interruption_does_not_wait_for_workers(shot, tmp_path, monkeypatch, silent):
    """Those of a cluster are told to stop; one that does not answer is left behind."""
    monkeypatch.setattr(farm_driver, "_END", 0.2)

    def check():
        if client.given:
            setattr(client, silent, lambda *_, **__: time.sleep(60))
            raise KeyboardInterrupt

    client = Client({"a": GOOD}, lambda name, chosen: "waits")
    place = Farm("tcp://x", check=check)
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        Driver(place, client, job_of(shot, tmp_path), "", lambda n, state: None).run()
    assert time.monotonic() < begun + 5


@pytest.mark.fast
def test_parts_are_neither_tiny_nor_huge_and_many_for_each_worker():
    assert [size_of_part(*n) for n in ((8, 2), (64, 2), (1000, 2), (100_000, 64))] == [4, 8, 64, 64]


@pytest.mark.fast
def test_reports_on_parts_are_those_of_the_whole():
    """Masks that no part has are absent; those that one part has are not."""
    whole = BatchReport(total=4)
    for numbers_, absent, cuts in (
        ([3, 4], ["a=1", "b=2"], {3}),
        ([1], ["b=2"], set()),
        ([2], ["b=2"], {2}),
    ):
        part = BatchReport(done=numbers_, total=len(numbers_))
        part.lacking, part.unseen, part.cuts = list(absent), [], cuts
        part.notes = {"deep": numbers_[:1]}
        merge.add(whole, part)
    merge.sort(whole)
    assert (whole.done, whole.absent, whole.cuts) == ([1, 2, 3, 4], ["b=2"], {2, 3})
    assert (whole.notes, whole.rest) == ({"deep": [1, 2, 3]}, 0)


@pytest.mark.fast
def test_numbers_of_another_process_take_no_memory_of_their_own():
    mine = list(range(1000, 1004))
    sent = BatchReport(done=list(mine), total=4)
    sent.notes, sent.sizes = {"deep": [1002]}, {(64, 48): list(mine), (8, 8): [5000]}
    whole = pickle.loads(pickle.dumps(sent))
    assert whole.done[0] is not mine[0]
    merge.share(whole, mine)
    assert whole == sent
    for got in (whole.done, whole.sizes[64, 48]):
        assert all(a is b for a, b in zip(got, mine, strict=True))
    assert whole.notes["deep"][0] is mine[2]
