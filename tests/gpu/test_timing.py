"""The clocks: which passes they tell apart. How long a pass takes is nobody's business here."""

import numpy as np
import pytest

from wgmb import (
    METHODS,
    Blur,
    Frame,
    Render,
    gpu,
)
from wgmb.gpu import timing
from wgmb.gpu.textures import TexturePool
from wgmb.gpu.timing import TimestampClock, WallClock
from wgmb.scene import builtin

SIZE = (64, 36)
CLOCKS = pytest.mark.parametrize("clock", [TimestampClock, WallClock])
FRAME = Frame(
    np.random.default_rng(2).random((36, 64, 4), np.float32),
    np.full((36, 64, 2), (5.0, 2.0), np.float32),
    depth=np.ones((36, 64), np.float32),
    number=1,
)


def drawn(blur, clock):
    """One frame of every kind that the method takes, with or without a clock."""
    output = TexturePool(blur.device).texture("output", SIZE, blur.output)
    encoder = blur.device.create_command_encoder()
    if "scene" in blur.method.needs:
        name = "torusphere" if blur.method.name == "volume" else "crossing"
        render = Render(builtin.make(name), blur, size=SIZE, antialias=1)
        render.draw(output.create_view(), 0.0, timing=clock)
    else:
        frame = Frame(**{**vars_of(FRAME), "prev": FRAME, "next": FRAME})
        blur.encode(encoder, output=output.create_view(), timing=clock, **blur.upload(frame))
    return TexturePool(blur.device).download(encoder, output)


def vars_of(frame):
    return {"color": frame.color, "to_next": frame.to_next, "depth": frame.depth}


def dispatched(monkeypatch, blur):
    """The passes that really run: names and counts."""
    names, run = [], gpu.Kernel.run

    def noted(kernel, encoder, entry, *given, **own):
        run(kernel, encoder, entry, *given, **own)
        names.append(f"{kernel.source.name}:{entry}")

    with monkeypatch.context() as patch:
        patch.setattr(gpu.Kernel, "run", noted)
        drawn(blur, None)
    return {name: names.count(name) for name in names}


@CLOCKS
@pytest.mark.parametrize("method", METHODS)
def test_every_pass_that_runs_is_told(method, clock, device, monkeypatch):
    blur = Blur(method, samples=3, device=device)
    watch = clock(device)
    picture = drawn(blur, watch)
    seconds = watch.read()
    wanted = dispatched(monkeypatch, blur)
    if "progress" in blur.method.uses:  # how many there are depends on how long they take
        assert watch.counts.keys() == wanted.keys()
    else:
        assert watch.counts == wanted
    assert list(seconds) == list(wanted)
    if clock is WallClock:
        assert all(s >= 0 for s in seconds.values())
    np.testing.assert_allclose(picture, drawn(blur, None), rtol=0, atol=1e-5)


@CLOCKS
def test_a_clock_begins_anew(clock, device):
    blur, watch = Blur("tiles", samples=3, device=device), clock(device)
    drawn(blur, watch)
    assert watch.read()
    assert watch.read() == {} == watch.counts


def test_what_is_cleared_between_passes_is_cleared(device):
    """The published form of reproject clears its lists for every frame."""
    blur = Blur("reproject", variant="published", samples=3, device=device)
    want = drawn(blur, None)
    for _ in range(2):
        np.testing.assert_array_equal(drawn(blur, WallClock(device)), want)


def test_the_least_empty_submission_is_taken_off(device, monkeypatch):
    clock = WallClock(device)
    assert clock.empty > 0
    clock.empty = 0.4
    took = iter([0.3, 0.8, 0.2, 0.7, 0.5, 0.6])  # by turns of none and of a pass
    monkeypatch.setattr(clock, "_run", lambda encoder: next(took))
    for label in ("a", "b", "a"):
        clock.take(label, device.create_command_encoder())
    assert clock.read() == {"a": pytest.approx(1.0), "b": pytest.approx(0.5)}
    assert clock.counts == {"a": 2, "b": 1}
    assert clock.empty == 0.2


def test_the_clock_is_one_that_can_be_believed(device, monkeypatch):
    for usable, kind in ((True, TimestampClock), (False, WallClock)):
        monkeypatch.setattr(TimestampClock, "usable", staticmethod(lambda device, it=usable: it))
        assert isinstance(timing.clock(device), kind)


def test_medians_are_by_name():
    runs = [{"a": 1.0, "b": 5.0}, {"a": 9.0, "b": 4.0}, {"a": 2.0, "b": 6.0}]
    assert timing.medians(runs) == {"a": 2.0, "b": 5.0}
