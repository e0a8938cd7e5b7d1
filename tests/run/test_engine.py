"""The engine by itself: which thread does what, how many frames there are, and how a run ends."""

import threading
import time
import weakref
from dataclasses import dataclass, field

import pytest

from wgmb import InputError
from wgmb.run import engine
from wgmb.run.engine import RunOptions

pytestmark = pytest.mark.fast

COUNT = 9


@dataclass(eq=False)
class Frame:
    number: int
    failed: str = ""
    bad: dict = field(default_factory=dict)


class Numbers:
    """Frames that are nothing but a number; `fails` has what is raised at a number."""

    ahead = 1

    def __init__(self, count=COUNT, **fails):
        self.numbers, self.total = range(1, count + 1), count
        self.fails, self.threads, self.alive = fails, {}, weakref.WeakSet()
        self.begun = []

    def at(self, stage, number):
        self.threads.setdefault(stage, set()).add(threading.current_thread().name)
        if error := self.fails.get(stage, {}).get(number):
            raise error

    def read(self, is_done):
        for number in self.numbers:
            if not is_done(number, {"of": number}):
                self.begun.append(number)
                self.at("read", number)
                yield self.frame(number)

    def frame(self, number):
        frame = Frame(number)
        self.alive.add(frame)
        return frame

    def blur(self, read):
        return map(self.one, read)

    def one(self, frame):
        self.at("blur", frame.number)
        return frame


class Kept:
    """A sink that keeps the numbers; `after` is called with each."""

    is_whole = False

    def __init__(self, *there, after=lambda number: None, errors=None):
        self.there, self.numbers, self.end = there, [], []
        self.after, self.errors = after, errors or {}

    def done(self, number, made_of):
        assert made_of == {"of": number}
        return number in self.there

    def put(self, made):
        self.after(made.number)
        if made.number in self.errors:
            raise self.errors[made.number]
        self.numbers.append(made.number)

    def why_hopeless(self, error):
        return str(error) if isinstance(error, OSError) else ""

    def close(self):
        self.end.append("closed")

    def abandon(self):
        self.end.append("abandoned")


class Whole(Kept):
    is_whole = True


def left():
    return {t.name for t in threading.enumerate()} & {"read", "blur", "write"}


def states():
    told = []
    return told, lambda number, state: told.append((number, state))


def test_three_threads_share_the_work_and_every_frame_arrives_in_its_order():
    made, told = Numbers(), []
    sink = Kept(after=lambda n: told.append(threading.current_thread().name))
    report = engine.run(made, sink)
    assert sink.numbers == report.done == list(made.numbers)
    assert made.threads == {"read": {"read"}, "blur": {threading.current_thread().name}}
    assert set(told) == {"write"}
    assert sink.end == ["closed"] and not left()


@pytest.mark.parametrize("slow", ["read", "blur", "write"])
def test_at_most_three_frames_are_in_memory(slow):
    """None is held by a thread that has handed it on, whichever stage is the slowest."""
    most = []

    class Slow(Numbers):
        def at(self, stage, number):
            time.sleep(0.02 * (stage == slow))
            most.append(len(self.alive))

    made = Slow()
    engine.run(made, Kept(after=lambda n: made.at("write", n)))
    assert max(most) <= 3
    assert slow != "write" or max(most) == 3


def test_the_caller_takes_frames_as_a_sink_does():
    made, most = Numbers(), []
    frames = engine.frames(made)
    for number in made.numbers:
        assert next(frames).number == number
        time.sleep(0.01)
        most.append(len(made.alive))
    assert next(frames, None) is None
    assert max(most) <= 3 and not left()
    assert made.threads == {"read": {"read"}, "blur": {"blur"}}


def test_what_is_done_is_skipped_where_that_is_wished():
    told, tell = states()
    report = engine.run(made := Numbers(4), Kept(1, 3), RunOptions(resume=True, progress=tell))
    assert (report.skipped, report.done, made.begun) == ([1, 3], [2, 4], [2, 4])
    assert sorted(told) == [(1, "skipped"), (2, "done"), (3, "skipped"), (4, "done")]
    assert engine.run(Numbers(4), Kept(1, 3)).skipped == []


ERRORS = InputError("bad"), KeyboardInterrupt(), ZeroDivisionError()


@pytest.mark.parametrize(
    ("stage", "error", "way"),
    [(stage, error, "stop") for stage in ("read", "blur", "put") for error in ERRORS]
    + [(stage, error, "go on") for stage in ("read", "blur") for error in ERRORS]
    + [("put", error, "go on") for error in ERRORS[1:]],
)
def test_a_fault_is_raised_and_the_sink_abandoned(stage, error, way):
    """Errors of reading and blurring are the input's own to report; others end any run."""
    sink = Kept(errors={4: error}) if stage == "put" else Kept()
    made = Numbers(**({} if stage == "put" else {stage: {4: error}}))
    with pytest.raises(type(error)):
        engine.run(made, sink, RunOptions(on_error=way))
    assert sink.end == ["abandoned"] and not left()
    assert sink.numbers == [1, 2, 3][: len(sink.numbers)]
    if isinstance(error, Exception):  # what was made before an error is kept
        assert sink.numbers == [1, 2, 3]


def test_frames_that_fail_are_reported_and_the_others_made():
    class Some(Numbers):
        def one(self, frame):
            frame.failed = "torn" if frame.number == 2 else ""
            frame.bad = {"depth": 7} if frame.number == 3 else {}
            return frame

    told, tell = states()
    sink = Kept(errors={5: InputError("no room\nat all")})
    report = engine.run(Some(6), sink, RunOptions(progress=tell, on_error="go on"))
    assert report.failed == {2: "torn", 5: "no room at all"}
    assert (report.done, report.bad) == ([1, 3, 4, 6], {3: {"depth": 7}})
    assert [state for _, state in told] == ["done", "failed", "done", "done", "failed", "done"]
    assert (report.stopped, sink.end) == ("", ["closed"])


def test_a_full_disk_ends_the_run_after_three_frames():
    full = OSError("disk full")
    sink = Kept(errors=dict.fromkeys((2, 4, 5, 6, 7), full))
    report = engine.run(made := Numbers(30), sink, RunOptions(on_error="go on"))
    assert report.stopped == "disk full"
    assert (report.done, sorted(report.failed)) == ([1, 3], [2, 4, 5, 6])
    assert len(made.begun) <= 9


def test_a_whole_sink_ends_with_its_first_error_and_is_not_there():
    sink = Whole(errors={3: OSError("disk full")})
    report = engine.run(Numbers(), sink, RunOptions(on_error="go on"))
    assert (report.stopped, report.done, sorted(report.failed)) == ("disk full", [], [3])
    assert sink.end == ["abandoned"]


@pytest.mark.parametrize("way", ["stop", "go on"])
@pytest.mark.parametrize("kind", [Kept, Whole])
def test_a_run_that_is_asked_to_stop_begins_no_other_frame(way, kind):
    stop = threading.Event()
    sink = kind(after=lambda n: n == 3 and stop.set())
    report = engine.run(made := Numbers(), sink, RunOptions(stop=stop, on_error=way))
    assert report.stopped == engine.ON_REQUEST
    assert sink.numbers[:3] == [1, 2, 3] and len(made.begun) <= 5
    whole = kind is Whole
    assert report.done == ([] if whole else sink.numbers)
    assert sink.end == ["abandoned" if whole else "closed"]


def test_a_stop_after_the_last_frame_stopped_nothing():
    stop = threading.Event()
    sink = Kept(after=lambda n: n == COUNT and stop.set())
    assert engine.run(Numbers(), sink, RunOptions(stop=stop)).stopped == ""


def test_a_sink_that_cannot_be_closed():
    class Torn(Whole):
        def close(self):
            raise OSError("torn")

    report = engine.run(Numbers(), sink := Torn(), RunOptions(on_error="go on"))
    assert (report.stopped, report.done) == ("torn", [])
    with pytest.raises(OSError, match="torn"):
        engine.run(Numbers(), sink := Torn())
    assert sink.end == ["abandoned"]


def test_an_error_of_the_progress_ends_the_run():
    def tell(number, state):
        if number == 2:
            raise KeyboardInterrupt

    sink = Kept()
    with pytest.raises(KeyboardInterrupt):
        engine.run(Numbers(), sink, RunOptions(progress=tell, on_error="go on"))
    assert sink.end == ["abandoned"] and len(sink.numbers) <= 3


def test_a_generator_that_is_left_ends_its_threads():
    frames = engine.frames(Numbers(1000))
    assert next(frames).number == 1
    frames.close()
    assert not left()
