"""Reading, blurring and taking frames apart: `blurred`, and runs that are asked to stop."""

import threading

import numpy as np
import pytest

import make_frames as make
from wgmb import (
    Blur,
    Clip,
    InputError,
    Output,
    Passes,
    blur_sequence,
    blurred,
    vectors_sequence,
)
from wgmb.output.vectors import VectorOutput
from wgmb.run.engine import ON_REQUEST

COUNT = 8


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, COUNT + 1))


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def damaged(path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


def threads() -> set[str]:
    return {t.name for t in threading.enumerate()} & {"read", "blur", "write"}


def output(folder, clip) -> Output:
    return Output(folder / "o.####.exr", numbers=clip.numbers)


@pytest.mark.parametrize("method", ["tap", "gather", "reproject"])
def test_what_is_yielded_and_written_is_what_a_run_writes(tmp_path, shot, method):
    blur_sequence(clip := Clip(shot), blur := Blur(method, samples=4), output(tmp_path / "a", clip))
    clip = Clip(shot)
    files, numbers = output(tmp_path / "b", clip), []
    for frame in blurred(clip, blur):
        files.write_views(frame.views, frame.made_of)
        numbers.append(frame.number)
    assert numbers == clip.numbers
    assert contents(tmp_path / "b") == contents(tmp_path / "a")
    assert not threads()


def test_frames_are_blurred_in_a_thread_and_at_most_three_are_in_flight(shot, monkeypatch):
    """The caller holds each frame until nothing goes on any more."""
    clip, blur = Clip(shot), Blur("tap", samples=2)
    read, ran = [], set()
    sources, call = clip.sources, Blur.__call__
    monkeypatch.setattr(clip, "sources", lambda n: read.append(n) or sources(n))
    monkeypatch.setattr(
        Blur, "__call__", lambda *a: ran.add(threading.current_thread().name) or call(*a)
    )
    ahead = []
    for frame in blurred(clip, blur):
        before = -1
        while before != len(read) and len(read) < COUNT:
            before = len(read)
            threading.Event().wait(0.1)
        ahead.append(len(read) - frame.number)
    assert ran == {"blur"}
    assert max(ahead) == ahead[0] == 2


def test_a_frame_that_fails_has_the_reason_and_its_place(tmp_path):
    pattern = make.write_sequence(tmp_path, range(1, 6))
    damaged(tmp_path / "shot.0003.exr")
    frames = list(blurred(Clip(pattern), Blur("tap", samples=2)))
    assert [f.number for f in frames] == [1, 2, 3, 4, 5]
    assert [bool(f.views) for f in frames] == [True, True, False, True, True]
    assert "shot.0003.exr" in frames[2].failed
    frames = list(blurred(Clip(pattern, passes=Passes(depth="nope")), Blur("tap", samples=2)))
    assert not any(f.views for f in frames)
    assert ["nope" in f.failed for f in frames] == [True, True, False, True, True]


def test_confidence_and_bad_pixels_come_with_a_frame(tmp_path):
    channels = make.frame(2)
    channels["ViewLayer.Combined.R"][3, 4] = np.nan
    path = make.write_exr(tmp_path / "a.exr", channels)
    (frame,) = blurred(Clip(path), blur := Blur("gather", samples=2), confidence=True)
    assert set(frame.views[0].confidence) == set(blur.confidence)
    assert frame.bad == {"color": 1}


def test_a_name_that_is_nowhere_is_told_before_the_first_frame(tmp_path):
    pattern = make.write_sequence(tmp_path, (1, 2))
    clip = Clip(pattern)
    clip.masks.check = lambda: (_ for _ in ()).throw(InputError("no such name"))
    with pytest.raises(InputError, match="no such name"):
        blurred(clip, Blur("tap"))


def test_a_fault_of_a_thread_is_raised_where_frames_are_taken(shot, monkeypatch):
    clip = Clip(shot)

    def broken(number):
        raise ZeroDivisionError("a fault of ours")

    monkeypatch.setattr(clip, "sources", broken)
    with pytest.raises(ZeroDivisionError, match="of ours"):
        list(blurred(clip, Blur("tap")))
    assert not threads()


@pytest.mark.parametrize("way", ["close", "stop"])
def test_a_generator_that_is_left_early_ends_its_threads(shot, way):
    stop = threading.Event()
    frames = blurred(Clip(shot), Blur("tap", samples=2), stop=stop)
    assert next(frames).number == 1
    if way == "close":
        frames.close()
    else:
        stop.set()
        assert len(list(frames)) <= 2  # those that were blurred, or begun
    assert not threads()
    assert next(frames, None) is None


@pytest.mark.parametrize("kind", ["blur", "vectors"])
def test_a_run_that_is_asked_to_stop_begins_no_other_frame(tmp_path, shot, kind):
    clip, blur, stop, seen = Clip(shot), Blur("tap", samples=2), threading.Event(), []

    def tick(number, state):
        seen.append(number)
        if number == 3:
            stop.set()

    if kind == "blur":
        files = output(tmp_path, clip)
        report = blur_sequence(clip, blur, files, progress=tick, stop=stop)
    else:
        files = VectorOutput(tmp_path / "o.####.exr", "plain", numbers=clip.numbers)
        report = vectors_sequence(clip, files, blur=blur, progress=tick, stop=stop)
    assert report.done == seen
    assert seen[:3] == [1, 2, 3]
    assert len(seen) <= 5  # one was on the GPU, another waited to be written
    assert (report.stopped, report.failed, report.absent) == (ON_REQUEST, {}, [])
    assert make.names_in(tmp_path) == [f"o.{n:04d}.exr" for n in seen]
    if kind == "blur":
        again = Output(tmp_path / "o.####.exr", numbers=clip.numbers, resume=True)
        report = blur_sequence(clip, blur, again, resume=True)
        assert (report.skipped, report.stopped) == (seen, "")
        assert report.done == [n for n in clip.numbers if n not in seen]


def test_a_stop_that_comes_after_the_last_frame_stopped_nothing(tmp_path, shot):
    clip, stop = Clip(shot, frames="1-2"), threading.Event()

    def tick(number, state):
        if number == 2:
            stop.set()

    report = blur_sequence(clip, Blur("tap"), output(tmp_path, clip), progress=tick, stop=stop)
    assert (report.done, report.stopped) == ([1, 2], "")


def test_a_stopped_video_is_not_there(tmp_path, shot):
    clip, stop = Clip(shot), threading.Event()
    files = Output(tmp_path / "o.mp4", numbers=clip.numbers)
    report = blur_sequence(
        clip, Blur("tap"), files, progress=lambda n, state: stop.set(), stop=stop
    )
    assert (report.done, report.stopped) == ([], ON_REQUEST)
    assert make.names_in(tmp_path) == []
