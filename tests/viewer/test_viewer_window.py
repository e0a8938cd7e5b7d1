"""Sizes, pixel ratios and errors of the viewer, and its pace while something moves."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import make_clips as clips
import make_frames as make
from viewer_hand import BESIDE, PLAIN, SIZE, Hand, put
from wgmb import gpu
from wgmb.cli.exit_codes import NO_DEVICE
from wgmb.gpu.timing import TimestampClock
from wgmb.viewer import offscreen
from wgmb.viewer.draw.adaptive import Pace
from wgmb.viewer.window import frame

pytest_plugins = ["viewer_hand"]


@pytest.mark.parametrize("size, ratio", [((900, 500), 1.0), ((500, 300), 2.0), ((700, 333), 1.25)])
def test_sizes_and_hidpi(size, ratio):
    hand = Hand(put(PLAIN, look="velocity"), size, ratio)
    shown = hand.picture()
    whole = hand.look()
    assert whole.shape[:2] == (round(size[1] * ratio), round(size[0] * ratio))
    _, _, width, height = hand.viewer.stage.report.place
    assert shown.shape[:2] == (height, width) and abs(width / height - 16 / 9) < 0.02
    x, y, wide, high = hand.viewer.panel.places["method"]
    assert x + wide <= size[0] and y + high <= size[1]


def test_twice_the_pixels_show_the_same_twice_as_fine():
    state = put(PLAIN, look="velocity", compare="wipe", against="sharp", wipe=0.25)
    coarse, fine = Hand(state, (640, 400), 1.0), Hand(state, (640, 400), 2.0)
    for hand in (coarse, fine):
        hand.picture()
    a, b = coarse.look(), fine.look()
    assert b.shape == (800, 1280, 3)
    halved = b.reshape(400, 2, 640, 2, 3).mean(axis=(1, 3))
    assert np.abs(a - halved).mean() < 3  # the panel's letters are finer
    places = [[*hand.viewer.panel.places.values()] for hand in (coarse, fine)]
    np.testing.assert_allclose(*places, atol=2)  # letters have parts of pixels
    x = 80 * 2
    line = (b[250, x - 2 : x + 2] > 230).all(axis=1)
    assert line.all() and not (b[250, [x - 3, x + 2]] > 230).all(axis=1).any()  # as thick


def test_the_mouse_is_where_it_is_seen_at_any_ratio():
    state = put(PLAIN, compare="wipe", against="sharp")
    for ratio in (1.0, 1.5, 2.0):
        hand = Hand(state, (640, 440), ratio)
        hand.drag((160, 200), (80, 200))
        assert hand.state.wipe == pytest.approx(0.25, abs=0.01)
        hand.drag((200, 200), (220, 200))
        assert hand.state.scene.orbit[0] == pytest.approx(-20 / 320 * np.degrees(4.0))
        hand.touch("shutter", 0.5)
        assert hand.state.shutter.shutter == pytest.approx(360, abs=15)


def test_moving_to_a_screen_of_another_ratio_and_back():
    hand = Hand(PLAIN, (640, 400), 1.0)
    before, canvas = hand.picture(), hand.viewer.canvas
    whole, places = hand.look(), [*hand.viewer.panel.places.values()]
    canvas.set_pixel_ratio(2.0)  # and what a window does then:
    canvas.set_logical_size(640, 400)
    fine = hand.picture()
    assert hand.look().shape == (800, 1280, 3) and fine.shape[0] == 2 * before.shape[0]
    np.testing.assert_allclose([*hand.viewer.panel.places.values()], places, atol=2)
    canvas.set_pixel_ratio(1.0)
    canvas.set_logical_size(640, 400)
    assert np.array_equal(hand.picture(), before)
    assert np.abs(hand.look() - whole).max() <= 1


def test_resizing(hand):
    before = hand.picture()
    for size in ((900, 600), (60, 40), (3, 2), (1, 1), SIZE):
        hand.viewer.canvas.set_logical_size(*size)
        assert hand.look().shape[:2] == size[::-1]
    assert np.array_equal(hand.picture(), before)


def test_an_error_while_drawing_is_not_swallowed(monkeypatch):
    hand = Hand(size=(320, 180))

    def broken(*_):
        raise ZeroDivisionError("broken")

    monkeypatch.setattr(hand.viewer.screen, "show", broken)
    with pytest.raises(ZeroDivisionError):
        hand.look()
    assert hand.viewer.canvas.get_closed()


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """Words that name what the viewer shows."""
    folder = tmp_path_factory.mktemp("shown")
    video, pattern = clips.write(folder / "in.mp4"), make.write_sequence(folder, range(1, 4))
    return {"a scene": [], "frames": [pattern], "a video": [video, "--flow", "dis"]}


@pytest.mark.parametrize("kind", ["a scene", "frames", "a video"])
def test_a_lost_gpu_ends_the_viewer_in_one_line(shown, kind, capsys, monkeypatch):
    def window(state, **settings):
        device = gpu.second_device(gpu.open_device())
        viewer = offscreen(replace(state, panel=False), (320, 180), device=device)
        for number in range(60):
            if number == 3:
                device.destroy()
            frame(viewer)

    monkeypatch.setattr("wgmb.viewer.view", window)
    code, _, err = make.inside(capsys, "view", *shown[kind])
    assert code == NO_DEVICE, err
    assert "the GPU device was lost" in err and len(err.splitlines()) == 1


def test_times_of_the_gpu_are_told_by_pass(monkeypatch):
    monkeypatch.setattr(TimestampClock, "usable", staticmethod(lambda device: True))
    hand = Hand(put(PLAIN, method="reproject", samples=64))
    for _ in range(3):  # without a GPU, one by the quickest method comes first
        hand.look()
    made = {"scene/gbuffer.wgsl:main", "methods/reproject.wgsl:resolve"}
    assert made <= hand.viewer._info.passes.keys()


def test_moving_is_coarse_and_stillness_is_fine(hand):
    hand.viewer.stage.detail.pace = Pace(5)
    hand.submit("pointer_down", x=100, y=500, button=1, buttons=(1,))
    hand.submit("pointer_move", x=110, y=500, button=0, buttons=(1,))
    hand.look()
    assert hand.viewer.stage.report.size[0] < 256
    hand.submit("pointer_up", x=110, y=500, button=1, buttons=())
    hand.look()
    assert hand.viewer.stage.report.size == BESIDE


def test_pace_finds_what_keeps_to_its_target():
    for cost in (0.02, 0.3, 2.0):  # seconds of a full picture
        pace = Pace()

        def took(level, cost=cost, pace=pace):
            scale, rays = pace.quality(level, 2)
            return 0.02, cost * scale**2 * (rays**2 + 1) / 5

        for _ in range(120):
            rest, drawing = took(pace.level)
            pace.observe(rest + drawing, drawing, 2)
        assert sum(took(pace.level)) < 1.1 * pace.TARGET
        if pace.level:
            assert sum(took(pace.level - 1)) > 0.8 * pace.TARGET
        settled = pace.level
        for _ in range(50):
            rest, drawing = took(pace.level)
            pace.observe(rest + drawing, drawing, 2)
        assert pace.level == settled  # nothing jumps


def played(pace, unchanged, drawing, frames=200, busy=1.0):
    """The levels of frames that take `unchanged` and, at half the width, `drawing` seconds."""
    levels = []
    for number in range(frames):
        scale, _ = pace.quality(pace.level, 1)
        seconds = busy * (1 + 0.1 * (number % 3 - 1)) * (unchanged + drawing * scale**2 / 0.25)
        pace.observe(seconds, seconds, 1)  # nobody tells which part of it depends on the level
        levels.append(pace.level)
    return levels


def test_a_light_scene_is_played_at_half_the_width_and_again_once_the_machine_is_idle():
    pace = Pace(5, 1 / 24)
    assert played(pace, 0.012, 0.022)[-1] <= 5
    busy = played(pace, 0.012, 0.022, busy=8.0)
    assert pace.SCALES[busy[-1]] >= 0.3  # to draw fewer pixels would save little
    levels = played(pace, 0.012, 0.022, frames=600)
    assert levels[-1] <= 5
    assert len(set(levels[-100:])) == 1  # and it stays


def test_what_is_too_fine_is_tried_ever_later():
    pace = Pace(6, 1 / 24)
    levels = played(pace, 0.0, 0.045, frames=3000)
    changes = [sum(a != b for a, b in pairwise(part)) for part in (levels[:300], levels[-300:])]
    assert changes[1] <= 4 and changes[1] <= changes[0]


def test_one_slow_frame_changes_nothing():
    pace = Pace(3)
    for seconds in (0.07, 0.07, 1.0, 0.07, 0.07):
        pace.observe(seconds, seconds - 0.02, 2)
    assert pace.level == 3
