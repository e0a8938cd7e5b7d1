"""Composing beside the window: the same picture, in bands, and a window that does not wait."""

import subprocess
import sys
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from viewer_hand import ALONE
from wgmb import gpu
from wgmb.viewer.draw import composer
from wgmb.viewer.draw.composer import Composer, Image, View
from wgmb.viewer.draw.frame_status import FrameStatus
from wgmb.viewer.draw.place import fit
from wgmb.viewer.draw.screen import Screen, ScreenThread
from wgmb.viewer.state.state import TONES

SIZE = 90, 60
WINDOW = "bgra8unorm"  # as most windows have it
AREA = (0, 0, *SIZE)
RNG = np.random.default_rng(0)
FIRST, SECOND = (RNG.random((21, 30, 4)).astype(np.float16) for _ in range(2))
SETTINGS: list[dict[str, Any]] = [{}, {"compare": "wipe"}, {"tone": "soft"}]
LOWER = """
import os, sys, threading, time
from pathlib import Path
from wgmb import gpu
def priorities():
    of_python = {t.native_id for t in threading.enumerate()} - {threading.get_native_id()}
    tasks = (t for t in Path("/proc/self/task").iterdir() if int(t.name) not in of_python)
    return {int(t.name): ((t / "comm").read_text().strip(),
                          os.getpriority(os.PRIO_PROCESS, int(t.name))) for t in tasks}
own = os.getpriority(os.PRIO_PROCESS, 0)
start = priorities()
with gpu.yielding():
    first = gpu.open_device()
if first.adapter_info["adapter_type"] != gpu.SOFTWARE:
    sys.exit(7)
opened = {k: v for k, v in priorities().items() if k not in start}
low = {name for name, priority in opened.values() if priority >= min(own + 10, 19)}
high = {name for name, priority in opened.values() if priority == own}
assert high and all(name.startswith("llvmpipe-") for name in high), opened
assert len(opened) - len(high) >= 2 and not any(n.startswith("llvmpipe-") for n in low), opened
assert priorities()[threading.get_native_id()][1] == own
second = gpu.second_device(first)
later = {k: v for k, v in priorities().items() if k not in start and k not in opened}
assert later and all(priority == own for _, priority in later.values()), later
from wgmb.viewer.draw.draw_thread import DrawThread
from wgmb.viewer.draw.screen import ScreenThread
def of_threads():
    return {t.name: os.getpriority(os.PRIO_PROCESS, t.native_id) for t in threading.enumerate()}
drawing, screen = DrawThread(first), ScreenThread(second, "bgra8unorm", lambda: None)
until = time.monotonic() + 60
while not own < of_threads()["composing"] < of_threads()["drawing"]:
    assert time.monotonic() < until, of_threads()
    time.sleep(0.01)
assert of_threads()["MainThread"] == own
drawing.close()
screen.close()
"""


def view_of(first, second, **changes):
    state = replace(ALONE, **changes)
    images = (
        Image(None, "COLOR", (id(first),), first),
        Image(None, "COLOR", (id(second),), second),
    )
    return View(state, images, fit((30, 21), AREA, state), AREA, SIZE, 1.0, FrameStatus())


@pytest.fixture
def beside():
    made = ScreenThread(gpu.open_device(), WINDOW, lambda: None)
    yield made
    made.close()


@pytest.mark.parametrize("mode", ["off", "wipe", "split", "difference"])
def test_a_view_is_the_same_composed_beside_the_window_and_in_bands(beside, mode, monkeypatch):
    view = view_of(FIRST, SECOND, compare=mode, zoom=1.5)
    here = Screen(gpu.open_device(), "rgba8unorm")
    here.show(view)
    whole = here.picture()
    assert whole.std() > 0.1
    monkeypatch.setattr(composer, "_BAND", 7 * SIZE[0])
    beside.show(view)
    np.testing.assert_allclose(beside.picture(), whole, atol=0.75 / 255)
    there = here.values(40.5, 30.5)
    assert there is not None
    np.testing.assert_allclose(beside.values(40.5, 30.5), there, atol=0.75 / 255)
    assert beside.values(SIZE[0], 3) is None


def test_the_window_does_not_wait_for_composing_and_shows_the_last_view(beside, monkeypatch):
    opened, compose = threading.Event(), Composer.compose
    first, second = view_of(FIRST, SECOND), view_of(SECOND, FIRST)
    beside.show(first)
    was = beside.picture()

    def held(self, view):
        opened.wait(60)
        compose(self, view)

    monkeypatch.setattr(Composer, "compose", held)
    canvas = gpu.open_device().create_texture(
        size=(*SIZE, 1), format=WINDOW, usage=0x10 | 0x4 | 0x2 | 0x1
    )
    beside.show(replace(first, state=replace(first.state, exposure=1.0)))
    beside.show(second)  # the one before is not composed any more
    beside.paint(canvas)
    np.testing.assert_array_equal(painted(canvas)[:, 2:88], np.round(255 * was))
    assert beside.painted is first
    opened.set()
    now = beside.picture()
    assert np.abs(now - was).mean() > 0.1
    beside.paint(canvas)
    np.testing.assert_array_equal(painted(canvas)[:, 2:88], np.round(255 * now))
    assert beside.painted is second

    opened.clear()
    named = replace(second, report=FrameStatus(labels=("tap", "tap")))
    beside.show(named)  # the same picture, of which more is said
    beside.paint(canvas)
    assert beside.painted is named

    # The window is larger now: what the picture leaves free is black.
    beside.show(replace(second, size=(200, 120)))
    larger = gpu.open_device().create_texture(
        size=(200, 120, 1), format=WINDOW, usage=0x10 | 0x4 | 0x2 | 0x1
    )
    beside.paint(larger)
    assert not painted(larger)[SIZE[1] :].any() and not painted(larger)[:, SIZE[0] :].any()
    np.testing.assert_array_equal(painted(larger)[: SIZE[1], 2:88], np.round(255 * now))
    opened.set()


@pytest.mark.parametrize("mode", ["wipe", "split", "difference"])
def test_a_comparison_waits_for_its_second_image(mode):
    screen = Screen(gpu.open_device(), "rgba8unorm")
    view = view_of(FIRST, SECOND)
    screen.show(view)
    alone = screen.picture()
    compared = replace(view, state=replace(view.state, compare=mode))
    screen.show(replace(compared, images=(view.images[0], composer.NOTHING)))
    np.testing.assert_array_equal(screen.picture(), alone)
    screen.show(compared)
    assert np.abs(screen.picture() - alone).max() > 0.1


def test_only_the_last_pipelines_are_kept_and_none_that_makes_no_difference(monkeypatch):
    monkeypatch.setattr(composer, "_KEPT", 2)
    made, pipeline = [], composer.pipeline
    monkeypatch.setattr(composer, "pipeline", lambda *a: made.append(a) or pipeline(*a))
    one = Composer(gpu.open_device(), "rgba8unorm")
    clip, wipe, soft = (view_of(FIRST, SECOND, **c) for c in SETTINGS)
    pictures = [composed(one, view) for view in (clip, wipe, soft)]
    assert len(made) == 3 and len(one._pipelines) == 2
    for view, picture in zip((soft, wipe, clip), pictures[::-1], strict=True):
        np.testing.assert_array_equal(composed(one, view), picture)
    assert len(made) == 4  # the one that was used longest ago is made anew

    motion = replace(clip, images=(replace(clip.images[0], kind="MOTION"), composer.NOTHING))
    for tone in TONES:
        one.compose(replace(motion, state=replace(motion.state, tone=tone)))
    one.compose(replace(motion, images=(motion.images[0], replace(soft.images[1], kind="DEPTH"))))
    assert len(made) == 5  # motion has no tone, and alone it is seen without a second image


def composed(one, view):
    one.compose(view)
    return one.picture()


def painted(canvas):
    """(height, width, 3), red first, of what is on a canvas."""
    device = gpu.open_device()
    width, height, _ = canvas.size
    layout = {"bytes_per_row": 4 * width, "rows_per_image": height}
    texels: Any = device.queue.read_texture({"texture": canvas}, layout, (width, height, 1))
    return np.frombuffer(texels, np.uint8).reshape(height, width, 4)[..., 2::-1]


def test_what_goes_wrong_in_composing_is_raised_in_the_window(beside, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("broken")

    monkeypatch.setattr(Composer, "compose", broken)
    beside.show(view_of(FIRST, SECOND))
    with pytest.raises(ZeroDivisionError):
        beside.picture()
    with pytest.raises(ZeroDivisionError):
        beside.show(view_of(FIRST, SECOND))


@pytest.mark.skipif(sys.platform != "linux", reason="priorities of threads are Linux's")
def test_threads_that_compute_yield_to_those_of_the_window():
    done = subprocess.run([sys.executable, "-c", LOWER], capture_output=True, text=True)
    if done.returncode == 7:
        pytest.skip("the adapter is no software")
    assert done.returncode == 0, done.stderr
