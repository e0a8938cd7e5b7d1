"""The mouse, the keys and the panel of the viewer."""

import numpy as np
import pytest

from viewer_hand import ALONE, BESIDE, PLAIN, Hand, put
from wgmb import Blur, Render
from wgmb.color.srgb import srgb
from wgmb.methods import METHODS
from wgmb.scene import builtin
from wgmb.viewer import State, actions, controls
from wgmb.viewer.state.groups import GROUP_OF

pytest_plugins = ["viewer_hand"]


def test_left_drag_orbits_and_r_puts_it_back(bare):
    before = bare.picture()
    bare.drag((100, 85), (180, 105))
    aside, up = bare.state.scene.orbit
    assert aside == pytest.approx(-80 / 320 * np.degrees(4.0))
    assert up == pytest.approx(20 / 180 * np.degrees(4.0))
    assert np.abs(bare.picture() - before).mean() > 0.02
    bare.press("r")
    assert bare.state.scene.orbit == (0, 0)
    assert np.array_equal(bare.picture(), before)


@pytest.mark.parametrize("button, modifiers", [(2, ()), (1, ("Shift",))])
def test_right_or_shift_drag_moves_the_picture_with_the_hand(bare, button, modifiers):
    bare.drag((100, 85), (132, 85), button, modifiers)
    assert bare.state.scene.orbit == (0, 0)
    assert bare.state.scene.pan == pytest.approx((-32 / 180 * 6.25, 0))


def test_wheel_comes_nearer_and_is_continuous(bare):
    bare.submit("wheel", x=100, y=85, dx=0, dy=-100, buttons=())
    bare.look()
    whole = bare.state.scene.dolly
    bare.viewer.state = ALONE
    for _ in range(10):
        bare.submit("wheel", x=100, y=85, dx=0, dy=-10, buttons=())
        bare.look()
    assert whole < 1
    assert bare.state.scene.dolly == pytest.approx(whole)


def test_elevation_and_distance_are_held(hand):
    layout = controls.WindowLayout((0, 0, 320, 1010), (0, 400, 320, 180))
    up = controls.drag(PLAIN, layout, "orbit", 0, 5000)
    down = controls.drag(PLAIN, layout, "orbit", 0, -5000)
    assert (down.scene.orbit[1], up.scene.orbit[1]) == controls.ELEVATION
    far = controls.wheel(PLAIN, layout, 5, 5, 0, 1e5)
    assert far.scene.dolly == 10
    assert controls.wheel(PLAIN, layout, 500, 5, 0, 100) == PLAIN  # not over the picture


@pytest.mark.full
def test_the_torusphere_asks_for_its_method_and_shutter_and_is_turned(hand):
    hand.viewer.state = put(PLAIN, method=State().method)
    hand.choose("scene", "torusphere")
    assert (hand.state.method, hand.state.shutter.curve) == ("volume", "cosine")
    before = hand.picture()
    want = Render(builtin.make("torusphere"), Blur(**blur_of(hand.state)), size=BESIDE)(0.0)
    assert np.abs(before - srgb(want[..., :3])).max() < 2e-3
    hand.drag((80, 500), (144, 500))
    assert float(hand.state.scene.parameters()["cam_x"]) == pytest.approx(-1.0)
    assert np.abs(hand.picture() - before).mean() > 0.005
    hand.choose("scene", "crossing")
    assert (hand.state.method, *angle(hand.state)) == ("gather", 180, "box")


def angle(state):
    return state.shutter.shutter, state.shutter.curve


def blur_of(state):
    return {"method": state.method, "shutter": state.shutter.make(), "samples": state.blur.samples}


def test_a_scene_with_a_camera_of_its_own_is_turned_by_it(monkeypatch):
    def own(cam_x: float = 0.0, cam_y: float = 0.0):
        return builtin.crossing()

    monkeypatch.setitem(builtin.SCENES, "own", own)
    state, layout = State(source="own"), controls.WindowLayout((0, 0, 400, 200), (0, 0, 400, 200))
    moved = controls.drag(state, layout, "orbit", 100, 20)
    assert moved.scene.set == ("cam_x=-1", "cam_y=0.4")
    assert moved.scene.orbit == (0, 0)
    held = controls.drag(moved, layout, "orbit", 0, -1000)
    assert held.scene.parameters()["cam_y"] == "-1"
    assert controls.key(held, layout, "r")[0].scene.set == ()


def test_keys(hand):
    for key, name, value in (
        ("2", "method", list(METHODS)[1]),
        ("1", "method", next(iter(METHODS))),
        ("ArrowRight", "frame", 1.0),
        ("ArrowUp", "frame", 1.1),
        ("ArrowDown", "frame", 1.0),
        ("ArrowLeft", "frame", 0.0),
        ("ArrowLeft", "frame", 11.0),  # round
        ("Home", "frame", 0.0),
        ("End", "frame", 11.0),
        ("h", "help", True),
        ("h", "help", False),
        ("Tab", "panel", False),
        ("Tab", "panel", True),
        ("c", "compare", "wipe"),
        ("l", "look", "sharp"),
        (" ", "playing", True),
        (" ", "playing", False),
    ):
        hand.press(key)
        assert getattr(hand.state, name) == pytest.approx(value), key


def test_an_arrow_that_is_held_down_repeats(hand):
    hand.submit("key_down", key="ArrowRight")
    hand.look(0.11)
    hand.look(0.11)
    assert hand.state.frame == 1
    for _ in range(6):
        hand.look(0.11)
    assert hand.state.frame == 5  # 0.4 s after it went down the first time, then at every look
    hand.submit("key_up", key="ArrowRight")
    hand.look(0.11)
    hand.look(1.0)
    assert hand.state.frame == 5


def test_every_key_of_the_help_does_something():
    layout = controls.WindowLayout((0, 0, 9, 9), (0, 0, 9, 9), tuple(METHODS), ("result", "sharp"),
                             ("off", "wipe"), ("left", "pair"))  # fmt: skip
    names = {"space": " ", "left, right": "ArrowLeft", "home, end": "End", "up, down": "ArrowUp",
             "1 - 9": "2", "Esc": "Escape", "r": "R", "[ ] 0": "[", "+ -": "+"}  # fmt: skip
    moved = put(put(PLAIN, orbit=(5.0, 5.0)).keeping(), samples=9)
    for name in controls.KEYS:
        state, action = controls.key(moved, layout, names.get(name, name))
        assert state != moved or action, name


def test_escape_closes(hand):
    own = Hand(size=(320, 180))
    own.submit("key_down", key="Escape")
    own.viewer.canvas._process_events()
    assert own.viewer.canvas.get_closed()


def test_playing_goes_on_with_the_clock(hand):
    hand.viewer.state = put(PLAIN, playing=True, speed=0.5)
    hand.look(0.0)
    hand.look(0.25)
    assert hand.state.frame == pytest.approx(0.25 * 24 * 0.5)
    hand.look(0.5)
    hand.look(0.5)
    assert hand.state.frame == pytest.approx(1.25 * 24 * 0.5 - 12)  # of 12 frames


# ---- the panel ------------------------------------------------------------------------------

SLIDERS = ("frame", "samples", "jitter", "shutter", "exposure", "fps", "speed")


def now(state, name):
    own = name == "speed" or name not in GROUP_OF  # of the playing, not of the output
    return getattr(state, name) if own else state.setting(name)


@pytest.mark.parametrize("name", SLIDERS)
def test_a_slider_sets_its_value_and_never_moves_the_camera(hand, name):
    before = now(hand.state, name)
    x, y, width, height = hand.viewer.panel.places[name]
    hand.touch(name, 0.15)
    low = now(hand.state, name)
    hand.drag((x + 0.15 * width, y + height / 2), (x - 150, y - 80))  # off, over the picture
    hand.touch(name, 0.9)
    high = now(hand.state, name)
    assert low < high
    assert before in (low, high) or low != before
    assert hand.state.scene == PLAIN.scene


def test_shutter_phase_curve_rolling_and_longest(hand):
    hand.choose("phase", "end")
    hand.choose("curve", "gaussian")
    hand.choose("rolling", "down")
    hand.touch("limited")
    when = hand.state.shutter
    assert (when.phase, when.curve, when.rolling) == ("end", "gaussian", "down")
    assert hand.state.blur.max_blur == 40
    hand.touch("max_blur", 0.9)
    assert hand.state.blur.max_blur > 100
    hand.touch("rolling_duration", 0.9)
    assert hand.state.shutter.rolling_duration > 1.5
    hand.choose("phase", "at")
    hand.touch("phase at", 0.9)
    assert float(hand.state.shutter.phase) > 0.5


def test_options_of_the_method(hand):
    hand.choose("path", "straight")
    assert hand.state.setting("path") == "straight"
    hand.choose("path", "curved")
    assert hand.state.setting("path") is None


def test_a_parameter_of_the_scene(hand):
    before = hand.picture()
    x, y, _, _ = hand.viewer.panel.places["set speed"]
    hand.drag((x + 20, y + 8), (x + 120, y + 8))
    assert float(hand.state.scene.parameters()["speed"]) > 1.2
    assert np.abs(hand.picture() - before).mean() > 1e-3


USUAL = ("crossing",)  # whose panel the default tier looks at


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[] if n in USUAL else pytest.mark.full) for n in builtin.SCENES],
)
def test_the_panel_changes_nothing_by_itself(hand, name):
    opened = PLAIN.opened(name)
    for method in hand.viewer.stage.choices.methods(opened):
        odd = {"fastest": 0.0431, "max_blur": 33.3, "phase": "0.123", "shutter": 123.4}
        state = hand.viewer.stage.choices.possible(put(opened, method=method, **odd))
        hand.viewer.state = state
        hand.look()
        assert hand.state == state
        if "velocity" in hand.viewer.stage.choices.looks(state):
            hand.viewer.state = put(state, look="velocity")
            hand.look()
            assert hand.state == put(state, look="velocity")


def test_a_value_that_is_refused_is_said_and_undone(hand):
    before = hand.state
    hand.viewer.state = put(PLAIN, source="fence", set=("posts=900",))
    hand.look()
    assert hand.state == before
    assert "posts" in hand.viewer.message[0]


def test_the_full_screen_is_that_of_the_monitor_the_window_is_on(monkeypatch):
    areas = {"left": (0, 0, 1920, 1080), "right": (1920, 0, 2560, 1440)}
    monkeypatch.setattr(actions.glfw, "get_monitors", lambda: list(areas))
    monkeypatch.setattr(actions.glfw, "get_monitor_workarea", areas.get)
    assert actions._monitor_of((1500, 100, 800, 600)) == "left"  # most of it
    assert actions._monitor_of((1600, 100, 800, 600)) == "right"
    assert actions._monitor_of((-5000, 0, 10, 10)) == "left"  # nowhere to be seen


def test_nothing_is_drawn_when_nothing_changes(bare):
    bare.picture()
    bare.look()
    assert bare.viewer.stage.report.seconds.keys() == {"draw"}
    assert not bare.viewer.stage.report.changed
