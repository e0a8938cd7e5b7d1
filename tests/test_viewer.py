"""The viewer offscreen: events in, pictures out."""

import random
import tomllib
from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import make_frames as make
from wgmb import Blur, Clip, DeviceError, InputError, Render, color, gpu, observer
from wgmb.cli import app
from wgmb.color import srgb
from wgmb.cone import Cone
from wgmb.gpu.timing import TimestampClock
from wgmb.io import exr
from wgmb.methods import METHODS, default_method
from wgmb.scene import builtin
from wgmb.viewer import State, actions, controls, offscreen, renderer
from wgmb.viewer.adaptive import Pace
from wgmb.viewer.blurs import shutter_of
from wgmb.viewer.capabilities import Choices
from wgmb.viewer.screen import key_box
from wgmb.viewer.source import SceneSubject
from wgmb.viewer.state import LOOKS
from wgmb.viewer.window import frame

SIZE = 512, 1010  # tall enough for the whole panel; the picture is 256 x 144
BESIDE = 256, 144
BARE, SMALL = (320, 180), (160, 90)  # of the picture alone, for what needs no panel
PLAIN = State(method="tap", antialias=1, samples=4)
ALONE = replace(PLAIN, panel=False)
SAMPLE = str(Path(__file__).parent.parent / "sample" / "crossing.####.exr")


class Hand:
    """A viewer and somebody at its mouse and keys; the clock is theirs."""

    def __init__(self, state=PLAIN, size=SIZE, ratio=1.0):
        self.now = 100.0
        self.viewer = offscreen(state, size, ratio, clock=lambda: self.now)
        self.look()

    @property
    def state(self):
        return self.viewer.state

    def submit(self, kind, **event):
        self.viewer.canvas.submit_event({"event_type": kind, "modifiers": (), **event})

    def look(self, seconds=0.02):
        self.now += seconds
        return frame(self.viewer)[..., :3].astype(np.int16)

    def look_until(self, done):
        for _ in range(400):
            self.look(0.4)
            if done():
                return
        raise AssertionError("never done")

    def picture(self):
        """The picture when all is done, without the panel."""
        self.look_until(lambda: not self.viewer.stage.report.busy)
        return self.viewer.screen.picture()

    def drag(self, start, end, button=1, modifiers=()):
        press = {"button": button, "modifiers": modifiers}
        self.submit("pointer_move", x=start[0], y=start[1], button=0, buttons=())
        self.submit("pointer_down", x=start[0], y=start[1], buttons=(button,), **press)
        self.look()
        for share in (0.5, 1.0):
            x, y = (a + (b - a) * share for a, b in zip(start, end, strict=True))
            self.submit("pointer_move", x=x, y=y, button=0, buttons=(button,))
            self.look()
        self.submit("pointer_up", x=end[0], y=end[1], buttons=(), **press)
        self.look()

    def click(self, at):
        self.drag(at, at)

    def touch(self, name, share=0.5):
        """Put a finger on a widget, without having come over it before."""
        x, y, width, height = self.viewer.panel.places[name]
        at = x + share * width, y + height / 2
        for kind in ("pointer_down", "pointer_up"):
            self.submit("pointer_move", x=at[0], y=at[1], button=0, buttons=())
            self.submit(kind, x=at[0], y=at[1], button=1, buttons=(1,))
            self.look()
        self.look()

    def choose(self, name, item):
        self.touch(name)
        self.look()
        self.touch(f"{name}: {item}")
        self.look()

    def press(self, key):
        self.submit("key_down", key=key)
        self.submit("key_up", key=key)
        self.look()


@pytest.fixture(scope="module")
def shared():
    """One hand for the tests that begin by putting everything back."""
    return Hand()


@pytest.fixture
def hand(shared):
    shared.viewer.state = PLAIN
    shared.viewer.canvas.set_logical_size(*SIZE)
    shared.look()
    return shared


@pytest.fixture(scope="module")
def shared_bare():
    return Hand(ALONE, BARE)


@pytest.fixture
def bare(shared_bare):
    """As `hand`, without the panel: drawn in a tenth of the time."""
    shared_bare.viewer.state = ALONE
    shared_bare.viewer.canvas.set_logical_size(*BARE)
    shared_bare.look()
    return shared_bare


@pytest.fixture
def small(bare):
    """As `bare`, with a quarter of the pixels."""
    bare.viewer.canvas.set_logical_size(*SMALL)
    bare.look()
    return bare


# ---- the picture ----------------------------------------------------------------------------


def library(state, size=SMALL):
    """A Render of what the state is set to, and when."""
    shows = {} if state.look in LOOKS else {"show": state.look}
    blur = Blur(state.method, samples=state.samples, shutter=shutter_of(state), **shows)
    scene = builtin.make(state.source, **dict(state.settings))
    render = Render(scene, blur, size=size, antialias=state.antialias, fps=state.fps)
    return render, (state.frame / state.fps, int(state.frame))


@pytest.mark.parametrize("method", ["tap", "distributed"])
def test_the_picture_is_what_render_writes(bare, method):
    state = bare.viewer.state = replace(ALONE, method=method, frame=2.0)
    got = bare.picture()
    render, moment = library(state, BARE)
    assert got.shape == (180, 320, 3)
    assert np.abs(got - srgb(render(*moment)[..., :3])).max() < 2e-3


def test_the_window_shows_the_picture_in_its_place(hand):
    want = hand.picture()
    x, y, width, height = hand.viewer.stage.report.place
    shown = hand.look()[y : y + height, x : x + width]
    assert np.abs(shown / 255 - want).max() < 0.01


def test_every_method_and_scene_can_be_chosen(hand):
    methods = hand.viewer.stage.choices.methods(PLAIN)
    assert set(METHODS) - set(methods) == {"volume"}  # there is none in the scene
    for method in methods:
        hand.choose("method", method)
        assert hand.state == replace(PLAIN, method=method)
    for name in builtin.SCENES:
        before = hand.state
        if name != before.source:
            hand.choose("scene", name)
            possible = hand.viewer.stage.choices.possible
            assert hand.state == possible(before.opened(name))


@pytest.mark.parametrize("name", builtin.SCENES)
def test_every_scene_is_what_render_draws(small, name):
    opened = replace(ALONE, method=State().method).opened(name)
    method = "tap" if opened.method == State().method else opened.method
    state = small.viewer.state = replace(opened, method=method, frame=3.0)
    got = small.picture()
    render, moment = library(state)
    want = srgb(render(*moment)[..., :3])
    assert got.std() > 0.01
    assert np.abs(got - want).max() < 2e-3


@pytest.mark.parametrize("tone", ["clip", "soft"])
def test_exposure_and_tone(small, tone):
    state = small.viewer.state = replace(ALONE, exposure=1.5, tone=tone, look="sharp")
    want = library(state)[0].frame(0.0).color[..., :3] * 2**1.5
    want = want / (1 + want) if tone == "soft" else want
    assert np.abs(small.picture() - srgb(want)).max() < 2e-3


def test_velocity_has_the_colours_of_display(bare):
    state = bare.viewer.state = replace(ALONE, look="velocity")
    shown = bare.picture()
    render, _ = library(state, BARE)
    motion = render.blur.motion(render.frame(0.0))[..., 2:]
    want = srgb(color.motion_colors(motion, PLAIN.fastest * 180))
    apart = np.abs(shown - want).max(axis=2)
    wheel = slice(110, None), slice(240, None)
    assert apart[wheel].max() > 0.5  # the legend
    apart[wheel] = 0
    assert apart.max() < 5e-3


def test_depth_is_grey_and_nearer_is_brighter(bare):
    state = bare.viewer.state = replace(ALONE, look="depth")
    shown = bare.picture()
    depth = library(state, BARE)[0].frame(0.0).depth
    want = np.where(np.isfinite(depth), 5 / (5 + depth), 0)
    apart = np.abs(shown - want[..., None])
    apart[150:, :160] = 0  # the legend
    assert apart.max() < 2e-3


def test_what_a_method_shows_of_itself_can_be_looked_at(hand):
    hand.viewer.state = replace(PLAIN, method="reproject")
    result = hand.picture()
    assert "count" in hand.viewer.stage.choices.looks(hand.state)
    hand.choose("look at", "count")
    assert np.abs(hand.picture() - result).max() > 0.1


@pytest.mark.parametrize("method", [name for name in METHODS if name != "volume"])
def test_all_that_a_method_draws_is_what_render_draws(small, method):
    """Depth, velocity and error are those of all methods, and have tests of their own."""
    found = small.viewer.stage.choices.looks(replace(ALONE, method=method))
    drawn = [look for look in found if look not in ("depth", "velocity", "error")]
    assert drawn[:3] == ["result", "sharp", "perceived"]
    for look in drawn:
        state = small.viewer.state = replace(ALONE, method=method, look=look)
        render, moment = library(state)
        if look == "sharp":
            want = srgb(render.frame(*moment).color[..., :3])
        elif look == "perceived":
            numbers = range(1 - state.eye.frames_needed(state.fps), 1)
            want = seen([render(n / state.fps, n) for n in numbers], state.fps)
        else:
            want = srgb(render(*moment)[..., :3])
        assert np.abs(small.picture() - want).max() < 4e-3, look


def seen(frames, fps, after=0.0):
    """The frames as wgmb/observer.py perceives them; the first was always there."""
    eye = observer.Observer(fps)
    for picture in frames:
        eye.present(picture)
    return srgb(np.clip(eye.perceived(after)[..., :3], 0, 1))


def rendered(numbers, fps=24.0, antialias=1, speed=1.0, **blur):
    how = Blur(**{"method": "tap", "samples": 4, **blur})
    render = Render(
        builtin.make("crossing", speed=speed), how, size=SMALL, antialias=antialias, fps=fps
    )
    return [render(n / fps, n) for n in numbers]


@pytest.mark.parametrize("frame, newest, after", [(3.0, 3, 0.0), (3.4, 3, 0.4), (2.5, 3, -0.5)])
def test_what_is_perceived_is_what_the_library_says(small, frame, newest, after):
    small.viewer.state = replace(ALONE, look="perceived", frame=frame)
    got = small.picture()
    want = seen(rendered(range(newest - 12, newest + 1)), 24.0, after / 24)
    assert np.abs(got - want).max() < 4e-3  # the library keeps pictures as f16
    small.viewer.state = replace(small.state, look="result")
    assert np.abs(small.picture() - want).mean() > 0.005


@pytest.mark.parametrize("method", ["distributed", "gather"])
def test_what_stands_still_is_perceived_as_it_is(small, method):
    state = replace(ALONE, settings=(("speed", 0.0),), samples=16, method=method, frame=2.0)
    small.viewer.state = state
    result = small.picture()
    small.viewer.state = replace(state, look="perceived")
    got = small.picture()
    apart = np.abs(got - result)  # distributed has other noise in every frame
    assert apart.max() < 2e-3 if method == "gather" else apart.mean() < 0.03


def test_only_new_frames_are_drawn_while_it_plays(small, monkeypatch):
    drawn = []

    def draw(self, blur, *given):
        drawn.append(self._number)
        return plain(self, blur, *given)

    plain = SceneSubject.draw
    monkeypatch.setattr(SceneSubject, "draw", draw)
    small.viewer.state = replace(ALONE, look="perceived", frame=4.0)
    small.picture()
    held = Cone().frames_needed(24)
    assert sorted(drawn) == list(range(5 - held, 5))
    drawn.clear()
    for key, number in (("ArrowRight", [5]), ("ArrowUp", []), ("ArrowRight", [6]), ("h", []),
                        ("ArrowLeft", [6 - held]), ("ArrowLeft", [5 - held])):  # fmt: skip
        small.press(key)
        small.picture()
        assert drawn == number, key
        drawn.clear()
    small.viewer.state = replace(small.state, cone_peak=0.051, exposure=1.0)
    small.picture()
    assert drawn == []
    small.viewer.state = replace(small.state, shutter=90.0)
    small.picture()
    assert len(drawn) == held


def test_who_perceives_is_set_in_the_panel(hand):
    hand.viewer.state = replace(PLAIN, look="perceived", frame=4.0)
    before = hand.picture()
    hand.touch("cone_rate", 0.9)
    hand.touch("cone_peak", 0.05)
    assert hand.state.cone_rate > 100 and hand.state.cone_peak < 0.02
    quick = hand.picture()
    assert np.abs(quick - before).mean() > 0.005
    hand.viewer.state = State.of_toml(hand.state.toml())
    assert np.array_equal(hand.picture(), quick)


def test_the_reference_of_what_is_perceived_is_perceived_nature(small):
    """Nature is a video of very many frames."""
    state = replace(ALONE, look="perceived", compare="wipe", against="reference", wipe=0.0,
                    frame=4.0, settings=(("speed", 4.0),))  # fmt: skip
    small.viewer.state = state
    small.look_until(lambda: small.viewer.stage.report.reference[0] >= 200)
    nature = small.viewer.screen.picture()
    assert small.viewer.stage.report.labels == ("tap, perceived", "nature, perceived")
    assert small.viewer.stage.report.measured.psnr > 20
    sharp = {"antialias": 3, "shutter": 0, "speed": 4.0}
    want = seen(rendered(range(20 - 60, 21), 120.0, **sharp), 120.0)
    video = seen(rendered(range(-8, 5), 24.0, **sharp), 24.0)
    apart = [np.abs(a - want)[:, 3:].mean() for a in (nature, video)]
    assert apart[0] < 0.004 and apart[0] < 0.7 * apart[1], apart


def test_nature_is_exact_where_volumes_are(small):
    small.viewer.state = replace(
        ALONE.opened("disk"), frame=8.0, look="perceived", compare="difference",
        against="reference", gain=1.0,
    )  # fmt: skip
    boxes = small.picture().mean()
    assert small.viewer.stage.report.labels[1] == "nature, perceived"
    small.viewer.state = replace(small.state, shutter=0.0)
    assert small.picture().mean() > 1.2 * boxes > 0
    for name, choice in (("crossing", True), ("torusphere", False), ("cone", False)):
        state = replace(ALONE.opened(name), look="perceived")
        assert ("reference" in small.viewer.stage.choices.rivals(state)) is choice


# ---- mouse and keys -------------------------------------------------------------------------


def test_left_drag_orbits_and_r_puts_it_back(bare):
    before = bare.picture()
    bare.drag((100, 85), (180, 105))
    aside, up = bare.state.orbit
    assert aside == pytest.approx(-80 / 320 * np.degrees(4.0))
    assert up == pytest.approx(20 / 180 * np.degrees(4.0))
    assert np.abs(bare.picture() - before).mean() > 0.02
    bare.press("r")
    assert bare.state.orbit == (0, 0)
    assert np.array_equal(bare.picture(), before)


@pytest.mark.parametrize("button, modifiers", [(2, ()), (1, ("Shift",))])
def test_right_or_shift_drag_moves_the_picture_with_the_hand(bare, button, modifiers):
    bare.drag((100, 85), (132, 85), button, modifiers)
    assert bare.state.orbit == (0, 0)
    assert bare.state.pan == pytest.approx((-32 / 180 * 6.25, 0))


def test_wheel_comes_nearer_and_is_continuous(bare):
    bare.submit("wheel", x=100, y=85, dx=0, dy=-100, buttons=())
    bare.look()
    whole = bare.state.dolly
    bare.viewer.state = ALONE
    for _ in range(10):
        bare.submit("wheel", x=100, y=85, dx=0, dy=-10, buttons=())
        bare.look()
    assert whole < 1
    assert bare.state.dolly == pytest.approx(whole)


def test_elevation_and_distance_are_held(hand):
    layout = controls.Layout((0, 0, 320, 1010), (0, 400, 320, 180))
    up = controls.drag(PLAIN, layout, "orbit", 0, 5000)
    down = controls.drag(PLAIN, layout, "orbit", 0, -5000)
    assert (down.orbit[1], up.orbit[1]) == controls.ELEVATION
    far = controls.wheel(PLAIN, layout, 5, 5, 0, 1e5)
    assert far.dolly == 10
    assert controls.wheel(PLAIN, layout, 500, 5, 0, 100) == PLAIN  # not over the picture


def test_the_torusphere_asks_for_its_method_and_shutter_and_is_turned(hand):
    hand.viewer.state = replace(PLAIN, method=State().method)
    hand.choose("scene", "torusphere")
    assert (hand.state.method, hand.state.curve) == ("volume", "cosine")
    before = hand.picture()
    want = Render(builtin.make("torusphere"), Blur(**blur_of(hand.state)), size=BESIDE)(0.0)
    assert np.abs(before - srgb(want[..., :3])).max() < 2e-3
    hand.drag((80, 500), (144, 500))
    assert dict(hand.state.settings)["cam_x"] == pytest.approx(-1.0)
    assert np.abs(hand.picture() - before).mean() > 0.005
    hand.choose("scene", "crossing")
    assert (hand.state.method, hand.state.shutter, hand.state.curve) == ("gather", 180, "box")


def blur_of(state):
    return {"method": state.method, "shutter": shutter_of(state), "samples": state.samples}


def test_a_scene_with_a_camera_of_its_own_is_turned_by_it(monkeypatch):
    def own(cam_x: float = 0.0, cam_y: float = 0.0):
        return builtin.crossing()

    monkeypatch.setitem(builtin.SCENES, "own", own)
    state, layout = State(source="own"), controls.Layout((0, 0, 400, 200), (0, 0, 400, 200))
    moved = controls.drag(state, layout, "orbit", 100, 20)
    assert dict(moved.settings) == pytest.approx({"cam_x": -1.0, "cam_y": 0.4})
    assert moved.orbit == (0, 0)
    held = controls.drag(moved, layout, "orbit", 0, -1000)
    assert dict(held.settings)["cam_y"] == -1.0
    assert controls.key(held, layout, "r")[0].settings == ()


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
    layout = controls.Layout((0, 0, 9, 9), (0, 0, 9, 9), tuple(METHODS), ("result", "sharp"),
                             ("off", "wipe"), ("left", "pair"))  # fmt: skip
    names = {"space": " ", "left, right": "ArrowLeft", "home, end": "End", "up, down": "ArrowUp",
             "1 - 9": "2", "Esc": "Escape", "r": "R"}  # fmt: skip
    moved = replace(PLAIN, orbit=(5.0, 5.0))
    for name in controls.KEYS:
        state, action = controls.key(moved, layout, names.get(name, name))
        assert state != moved or action, name


def test_escape_closes(hand):
    own = Hand(size=(320, 180))
    own.submit("key_down", key="Escape")
    own.viewer.canvas._process_events()
    assert own.viewer.canvas.get_closed()


def test_playing_goes_on_with_the_clock(hand):
    hand.viewer.state = replace(PLAIN, playing=True, speed=0.5)
    hand.look(0.0)
    hand.look(0.25)
    assert hand.state.frame == pytest.approx(0.25 * 24 * 0.5)
    hand.look(0.5)
    hand.look(0.5)
    assert hand.state.frame == pytest.approx(1.25 * 24 * 0.5 - 12)  # of 12 frames


# ---- the panel ------------------------------------------------------------------------------

SLIDERS = ("frame", "samples", "jitter", "shutter", "exposure", "fps", "speed")


@pytest.mark.parametrize("name", SLIDERS)
def test_a_slider_sets_its_value_and_never_moves_the_camera(hand, name):
    before = getattr(hand.state, name)
    x, y, width, height = hand.viewer.panel.places[name]
    hand.touch(name, 0.15)
    low = getattr(hand.state, name)
    hand.drag((x + 0.15 * width, y + height / 2), (x - 150, y - 80))  # off, over the picture
    hand.touch(name, 0.9)
    high = getattr(hand.state, name)
    assert low < high
    assert before in (low, high) or low != before
    assert (hand.state.orbit, hand.state.pan, hand.state.dolly) == ((0, 0), (0, 0), 1)


def test_shutter_phase_curve_rolling_and_longest(hand):
    hand.choose("phase", "end")
    hand.choose("curve", "gaussian")
    hand.choose("rolling", "down")
    hand.touch("limited")
    state = hand.state
    assert (state.phase, state.curve, state.rolling) == ("end", "gaussian", "down")
    assert state.max_blur == 40
    hand.touch("max_blur", 0.9)
    assert hand.state.max_blur > 100
    hand.touch("rolling_duration", 0.9)
    assert hand.state.rolling_duration > 1.5
    hand.choose("phase", "at")
    hand.touch("phase at", 0.9)
    assert float(hand.state.phase) > 0.5


def test_options_of_the_method(hand):
    hand.choose("path", "straight")
    assert dict(hand.state.options) == {"path": "straight"}
    hand.choose("path", "curved")
    assert hand.state.options == ()


def test_a_parameter_of_the_scene(hand):
    before = hand.picture()
    x, y, _, _ = hand.viewer.panel.places["set speed"]
    hand.drag((x + 20, y + 8), (x + 120, y + 8))
    assert dict(hand.state.settings)["speed"] > 1.2
    assert np.abs(hand.picture() - before).mean() > 1e-3


@pytest.mark.parametrize("name", list(builtin.SCENES))
def test_the_panel_changes_nothing_by_itself(hand, name):
    opened = PLAIN.opened(name)
    for method in hand.viewer.stage.choices.methods(opened):
        odd = {"fastest": 0.0431, "max_blur": 33.3, "phase": "0.123", "shutter": 123.4}
        state = hand.viewer.stage.choices.possible(replace(opened, method=method, **odd))
        hand.viewer.state = state
        hand.look()
        assert hand.state == state
        if "velocity" in hand.viewer.stage.choices.looks(state):
            hand.viewer.state = replace(state, look="velocity")
            hand.look()
            assert hand.state == replace(state, look="velocity")


def test_a_value_that_is_refused_is_said_and_undone(hand):
    before = hand.state
    hand.viewer.state = replace(PLAIN, source="fence", settings=(("posts", 900),))
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


# ---- comparing ------------------------------------------------------------------------------


def pictures(bare):
    """The result, and the sharp picture."""
    bare.viewer.state = ALONE
    first = bare.picture()
    bare.viewer.state = replace(ALONE, look="sharp")
    return first, bare.picture()


def test_wipe_shows_either_side_and_its_line_is_dragged(bare):
    first, second = pictures(bare)
    bare.viewer.state = replace(ALONE, compare="wipe", against="sharp", wipe=0.5)
    shown = bare.picture()
    assert np.array_equal(shown[:, :158], first[:, :158])
    assert np.array_equal(shown[:, 162:], second[:, 162:])
    bare.drag((160, 85), (80, 125))
    assert bare.state.wipe == pytest.approx(0.25)
    assert bare.state.orbit == (0, 0)
    shown = bare.picture()
    assert np.array_equal(shown[:, 82:], second[:, 82:])


def test_split_shows_both_whole(bare):
    bare.viewer.state = replace(ALONE, compare="split", against=ALONE.method)
    bare.picture()
    whole = bare.look()
    left, right = whole[45:135, 5:155], whole[45:135, 165:315]
    assert np.abs(left - right).max() <= 2
    assert left.std() > 10


def test_difference_of_the_same_is_black_and_of_others_is_not(bare):
    bare.viewer.state = replace(ALONE, compare="difference", against=ALONE.method)
    assert bare.picture().max() == 0
    bare.viewer.state = replace(ALONE, compare="difference", against="sharp", gain=2.0)
    got, (first, second) = bare.picture(), pictures(bare)
    assert np.abs(got - np.clip(2 * np.abs(first - second), 0, 1)).max() < 5e-3


def test_flicker_changes_with_the_clock(bare):
    first, second = pictures(bare)
    bare.viewer.state = replace(ALONE, compare="flicker", against="sharp")
    bare.picture()
    seen = []
    for _ in range(4):
        bare.look(0.5)
        seen.append(bare.viewer.screen.picture())
    assert np.array_equal(seen[0], seen[2]) and np.array_equal(seen[1], seen[3])
    assert {a.tobytes() for a in seen} == {first.tobytes(), second.tobytes()}


def test_the_error_is_shown_however_others_are_compared(bare):
    shown = []
    for compare in ("off", "wipe", "split", "difference", "flicker"):
        bare.viewer.state = replace(ALONE, look="error", compare=compare)
        bare.look(1.0)
        for _ in range(2):
            bare.look(0.5)
            shown.append(bare.viewer.screen.picture())
        assert key_box(bare.state, "COLOR", (0, 0, 9, 9), (0, 0, 9, 9), 1.0)
        layout = controls.Layout((0, 0, 320, 1010), (0, 400, 320, 180))
        assert controls.grip(bare.state, layout, 160, 500, 1, ()) == "orbit"
    assert all(picture.max() > 0.3 for picture in shown)  # flicker would show black in between


def test_the_reference_converges_and_is_measured(small, monkeypatch):
    monkeypatch.setattr(renderer, "_STEP", 0.0)  # a sample a frame, however fast the machine is
    at = 7 / 24  # a moment that no other test has measured
    small.viewer.state = replace(ALONE, look="error", gain=1.0, frame=7.0)
    rays = []
    for _ in range(600):
        small.look(0.4)
        rays.append(small.viewer.stage.report.reference[0])
        if (found := small.viewer.stage.report.measured) and found.samples >= 128:
            break
    assert rays == sorted(rays) and len(set(rays)) > 3
    render = Render(builtin.make("crossing"), Blur("tap", samples=4), size=SMALL, antialias=1)
    truth = Render(
        render.scene, Blur("distributed", samples=found.samples), size=SMALL, antialias=1
    )(at, 7)  # fmt: skip
    apart = srgb(render(at, 7)[..., :3]) - srgb(truth[..., :3])
    assert found.psnr == pytest.approx(-10 * np.log10(np.mean(apart.astype("f8") ** 2)), abs=0.01)
    if found.flip:
        assert 0 < found.flip.result(60) < 1
    small.submit("pointer_move", x=10, y=10, button=0, buttons=())
    small.viewer.state = replace(small.state, frame=1.0)
    small.look()
    assert small.viewer.stage.report.reference[0] < rays[-1]  # begun anew


def test_what_is_shown_never_has_less_in_it_than_before(small, monkeypatch):
    monkeypatch.setattr(renderer, "_STEP", 0.0)  # a few samples at a time
    small.viewer.state = replace(ALONE, method="accumulate", samples=32)
    want, shown = small.picture(), small.viewer.stage._shown
    small.submit("pointer_down", x=50, y=40, button=1, buttons=(1,))
    for _ in range(3):
        small.look()
        assert np.array_equal(small.viewer.screen.picture(), want)  # nothing has moved yet
    small.submit("pointer_move", x=60, y=40, button=0, buttons=(1,))
    small.look()
    assert shown["first"].done == 4
    small.submit("pointer_up", x=60, y=40, button=1, buttons=())
    done = []

    def all_done():
        done.append(shown["first"].done)
        return not small.viewer.stage.report.busy

    small.look_until(all_done)
    assert done == sorted(done) and done[0] == 4 and done[-1] == 32 and len(set(done)) > 3


# ---- the window -----------------------------------------------------------------------------


@pytest.mark.parametrize("size, ratio", [((900, 500), 1.0), ((500, 300), 2.0), ((700, 333), 1.25)])
def test_sizes_and_hidpi(size, ratio):
    hand = Hand(replace(PLAIN, look="velocity"), size, ratio)
    shown = hand.picture()
    whole = hand.look()
    assert whole.shape[:2] == (round(size[1] * ratio), round(size[0] * ratio))
    _, _, width, height = hand.viewer.stage.report.place
    assert shown.shape[:2] == (height, width) and abs(width / height - 16 / 9) < 0.02
    x, y, wide, high = hand.viewer.panel.places["method"]
    assert x + wide <= size[0] and y + high <= size[1]


def test_twice_the_pixels_show_the_same_twice_as_fine():
    state = replace(PLAIN, look="velocity", compare="wipe", against="sharp", wipe=0.25)
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
    state = replace(PLAIN, compare="wipe", against="sharp")
    for ratio in (1.0, 1.5, 2.0):
        hand = Hand(state, (640, 400), ratio)
        hand.drag((160, 200), (80, 200))
        assert hand.state.wipe == pytest.approx(0.25, abs=0.01)
        hand.drag((200, 200), (220, 200))
        assert hand.state.orbit[0] == pytest.approx(-20 / 320 * np.degrees(4.0))
        hand.touch("shutter", 0.5)
        assert hand.state.shutter == pytest.approx(360, abs=15)


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

    monkeypatch.setattr(hand.viewer.screen, "compose", broken)
    with pytest.raises(ZeroDivisionError):
        hand.look()
    assert hand.viewer.canvas.get_closed()


def test_a_lost_gpu_is_told():
    wanted = ["float32-filterable"]
    device = gpu.choose_adapter().request_device_sync(required_features=wanted)
    viewer = offscreen(PLAIN, (320, 180), device=device)
    frame(viewer)
    device.destroy()
    with pytest.raises(DeviceError, match="lost"):
        frame(viewer)


def test_times_of_the_gpu_are_told_by_pass(monkeypatch):
    monkeypatch.setattr(TimestampClock, "usable", staticmethod(lambda device: True))
    hand = Hand(replace(PLAIN, method="reproject", samples=64))
    passes = hand.viewer.stage.report.passes
    assert {"scene/gbuffer.wgsl:main", "methods/reproject.wgsl:resolve"} <= passes.keys()
    hand.look()
    assert passes.keys() <= hand.viewer._info.passes.keys()


# ---- quick while moving ---------------------------------------------------------------------


def test_moving_is_coarse_and_stillness_is_fine(hand):
    hand.viewer.stage.pace = Pace(5)
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


def test_one_slow_frame_changes_nothing():
    pace = Pace(3)
    for seconds in (0.07, 0.07, 1.0, 0.07, 0.07):
        pace.observe(seconds, seconds - 0.02, 2)
    assert pace.level == 3


# ---- files ----------------------------------------------------------------------------------

MANY = State(
    source="fence",
    settings=(("speed", 4.5), ("posts", 11.0)),
    orbit=(10.5, -3.0),
    pan=(0.25, -0.5),
    dolly=0.8,
    frame=3.5,
    size="256x144",
    antialias=1,
    fps=30.0,
    method="reproject",
    samples=5,
    jitter=0.5,
    max_blur=33.0,
    options=(("variant", "slices"),),
    shutter=270.0,
    phase="0.1",
    curve="cosine",
    compare="split",
    against="tap",
    exposure=-0.5,
    tone="soft",
    cone_rate=80.0,
    cone_peak=0.02,
    playing=True,
    speed=0.5,
)


@pytest.mark.parametrize("state", [State(), MANY, State().opened(SAMPLE)])
def test_settings_come_back_as_they_were_saved(state):
    assert State.of_toml(state.toml()) == state


@pytest.mark.parametrize(
    "text, said",
    [
        ("[render", "settings"),
        ("", r"\[render\]"),
        ("[render]\nscene = 3", "scene"),
        ('[render]\nscene = "nowhere"', "nowhere"),
        ('[render]\nscene = "crossing"\nsamples = "many"', "samples"),
        ('[render]\nscene = "crossing"\nmethod = "magic"', "magic"),
        ('[render]\nscene = "crossing"\norbit = [1]', "orbit"),
        ('[render]\nscene = "crossing"\nset = ["speed"]', "speed"),
        ('[render]\nscene = "crossing"\nsamples = nan', "samples"),
        ('[render]\nscene = "crossing"\ncolour = 1', "colour"),
        ('[render]\nscene = "crossing"\n[view]\ncompare = "both"', "both"),
        ('[render]\nscene = "crossing"\n[view]\nzoo = 1', "zoo"),
        ('[render]\nscene = "crossing"\n[view]\ncone_rate = 0', "rate"),
        ('[render]\nscene = "crossing"\n[view]\nframes = "x-y"', "x-y"),
        ('[render]\nscene = "crossing"\nset = 3', "set"),
        ('[render]\nscene = "crossing"\nset = [3]', "set"),
        ('view = 3\n[render]\nscene = "crossing"', "view"),
        ("render = 3", "render"),
        ("a = " + 5000 * "[", "lists"),
        ("a = " + 5000 * "9", "digits"),
        (f'[render]\nscene = "crossing"\nantialias = 0x{5000 * "f"}', "antialias"),
        ('[render]\nscene = "crossing"\nmax_blur = "far"', "max_blur"),
        ('[render]\nscene = "crossing"\nrolling = 3', "rolling"),
        ('[render]\nscene = "crossing"\npath = [1]', "path"),
        ('[render]\nscene = "crossing"\nsource = "fence"', "source"),
        ('[render]\nscene = "crossing"\nfps = 0', "fps"),
        ('[render]\nscene = "crossing"\n[view]\nframes = "0-9999999"', "1000000"),
        ('[blur]\npattern = "a.####.exr"\nalso = "b.####.exr"', "also"),
        ('[blur]\npattern = "a.####.exr"\nvector_scale = "2"', "vector_scale"),
    ],
)
def test_settings_that_make_no_sense_are_told(text, said):
    with pytest.raises(InputError, match=said):
        State.of_toml(text)


ON_DISK = State(
    source="a.####.exr",
    given=(("also", ("b.####.exr", "c\x7f.exr")), ("camera", Path("cam.json")), ("far", 50.0)),
)


def test_what_files_hold_comes_back_as_it_was_saved():
    assert State.of_toml(ON_DISK.toml()) == ON_DISK


def test_changed_settings_are_read_or_refused_and_nothing_else():
    """A thousand small changes of sound files; the message is one line."""
    rng = random.Random(1)
    values = ["3", "-1", "[[1]]", "{a = 1}", "nan", "1e400", "true", '""', "[]", "1979-05-27",
              "0x" + 5000 * "f", 5000 * "9", '"\\u0000"']  # fmt: skip
    read = 0
    for _ in range(1000):
        lines = rng.choice((MANY, ON_DISK, State())).toml().splitlines()
        at = rng.randrange(len(lines))
        if rng.random() < 0.7:
            lines[at] = lines[at].partition(" = ")[0] + f" = {rng.choice(values)}"
        else:
            place = rng.randrange(len(lines[at]) + 1)
            lines[at] = lines[at][:place] + chr(rng.randrange(128)) + lines[at][place + 1 :]
        try:
            state = State.of_toml("\n".join(lines))
        except InputError as error:
            assert len(str(error)) < 400
        else:
            read += 1
            assert State.of_toml(state.toml()) == state
    assert 50 < read < 950


@pytest.mark.parametrize(
    "data, said",
    [(b"\xff[render]", "UTF-8"), (b"[render", "settings"), (b"[render]\nscene = 3", "scene")],
)
def test_a_settings_file_that_makes_no_sense_is_named(hand, tmp_path, data, said):
    (tmp_path / "bad.toml").write_bytes(data)
    with pytest.raises(InputError, match=rf"bad\.toml: .*{said}") as error:
        State.read(tmp_path / "bad.toml")
    assert str(error.value).count("bad.toml") == 1
    state = hand.state
    hand.viewer.do("load", str(tmp_path / "bad.toml"))
    assert said in hand.viewer.message[0]
    assert hand.state == state


def test_render_takes_the_saved_settings(hand, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plain = {"compare": "off", "exposure": 0.0, "tone": "clip"}
    hand.viewer.state = replace(MANY, playing=False, jitter=0.0, **plain)
    shown = hand.picture()
    hand.viewer.do("save", "wgmb.toml")
    assert tomllib.loads(Path("wgmb.toml").read_text())["render"]["samples"] == 5
    assert app.main(["render", "--config", "wgmb.toml", "-o", "still.png", "--quiet"]) == 0
    written = iio.imread("still.png")[..., :3] / 255
    assert np.abs(written - shown).max() < 0.02
    hand.viewer.state = PLAIN
    hand.viewer.do("load", "wgmb.toml")
    assert hand.state.source == "fence"
    hand.viewer.do("load", "nowhere.toml")
    assert "nowhere" in hand.viewer.message[0]


@pytest.mark.parametrize("state", [MANY, replace(PLAIN.opened(SAMPLE), shutter=90.0)])
def test_the_command_line_is_one(state, tmp_path):
    state = replace(state, frames="9-10") if not state.is_scene else replace(state, frames="0-1")
    out = tmp_path / "out.####.png"
    assert app.main([*state.command(str(out)), "--quiet"]) == 0
    assert len(list(tmp_path.glob("out.*.png"))) == 2


def test_screenshot_and_recording(hand, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = hand.picture()
    hand.press("s")
    assert np.abs(iio.imread("wgmb-001.png") / 255 - shown).max() < 0.01
    whole = exr.read(Path("wgmb-001.exr")).parts[0]
    want = Render(builtin.make("crossing"), Blur("tap", samples=4), size=BESIDE, antialias=1)(0.0)
    assert np.abs(whole.channels["R"].astype("f4") - want[..., 0]).max() < 2e-3
    hand.press("v")
    for _ in range(3):
        hand.look()
    hand.press("v")
    frames = iio.imread("wgmb-001.mp4", plugin="pyav")
    assert frames.shape[1:] == (144, 256, 3) and len(frames) >= 3
    assert np.abs(frames[0].astype(int) - frames[-1]).mean() > 0.5  # it moves
    assert not list(tmp_path.glob(".*"))


def test_export_runs_the_command_line(hand, tmp_path, monkeypatch):
    hand.viewer.state = replace(PLAIN, size="64x36", frames="0-1")
    hand.look()
    hand.viewer.do("export", str(tmp_path / "out.####.png"))
    child = hand.viewer.actions.export[0]
    assert child.wait(60) == 0
    hand.look()
    assert "exported" in hand.viewer.actions.export_said
    assert len(list(tmp_path.glob("*.png"))) == 2


# ---- frames on disk -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def reel():
    return Hand(replace(PLAIN, antialias=1).opened(SAMPLE))


def test_frames_on_disk_are_blurred_as_the_library_does(reel):
    want = Blur("tap", samples=4)(next(iter(Clip(SAMPLE))))
    reel.viewer.state = replace(reel.state, frame=9.0)
    reel.picture()
    got = reel.viewer.stage.download()[..., :3]
    assert np.abs(got - want[..., :3]).max() < 1e-5


def test_frames_on_disk_are_perceived_too(reel):
    state = reel.state
    reel.viewer.state = replace(state, look="perceived", frame=11.0)
    reel.picture()
    got = srgb(np.clip(reel.viewer.stage.download()[..., :3], 0, 1))
    blur = Blur("tap", samples=4)
    assert np.abs(got - seen([blur(frame)[..., :3] for frame in Clip(SAMPLE)], 24.0)).max() < 4e-3
    reel.viewer.state = state


def test_scrubbing_shutter_zoom_and_pan(reel):
    first = reel.picture()
    reel.press("ArrowRight")
    assert reel.state.frame == 10
    second = reel.picture()
    assert np.abs(first - second).mean() > 0.005
    reel.touch("shutter", 0.9)
    assert np.abs(reel.picture() - second).mean() > 0.005
    reel.submit("wheel", x=100, y=500, dx=0, dy=-300, buttons=())
    reel.look()
    assert reel.state.zoom > 1.2
    across = reel.state.center[0]
    reel.drag((80, 500), (50, 500))
    assert reel.state.center[0] > across
    reel.press("r")
    assert (reel.state.zoom, reel.state.center) == (1, (0.5, 0.5))


def test_frames_on_disk_have_no_reference(reel):
    choices, state = reel.viewer.stage.choices, reel.state
    assert "error" not in choices.looks(state)
    assert set(choices.methods(state)) == {n for n, m in METHODS.items() if "scene" not in m.needs}
    assert "reference" not in choices.rivals(state)
    for look in choices.looks(state):
        reel.viewer.state = replace(state, look=look)
        assert np.isfinite(reel.picture()).all()


def test_a_picture_without_passes_is_shown_as_it_is(tmp_path, hand):
    image = np.random.default_rng(0).integers(0, 256, (36, 64, 3), np.uint8)
    iio.imwrite(tmp_path / "plain.png", image)
    hand.viewer.state = PLAIN.opened(str(tmp_path / "plain.png"))
    hand.look()
    assert hand.state.look == "sharp"
    choices = hand.viewer.stage.choices
    assert choices.looks(hand.state) == ["sharp"]
    assert "`wgmb blur` finds the motion" in choices.subject(hand.state).finding
    assert np.abs(srgb(hand.viewer.stage.download()[..., :3]) - image / 255).max() < 0.01


def test_a_method_that_needs_a_scene_gives_way_to_one_that_does_not(reel):
    reel.viewer.state = replace(PLAIN.opened(SAMPLE), method="distributed", look="error")
    reel.look()
    assert (reel.state.method, reel.state.look) == (next(iter(METHODS)), "result")
    assert "distributed" in reel.viewer.message[0]


def test_what_cannot_be_opened_is_told(tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        State().opened("nowhere")
    assert app.main(["view", str(tmp_path / "nowhere.####.exr")]) == 2


def test_options_of_the_command_line_reach_the_state():
    state = State().told(
        {"method": "reproject", "samples": 8, "variant": "published", "shutter": 90.0}
    )
    assert (state.method, state.samples, state.shutter) == ("reproject", 8, 90)
    assert dict(state.options) == {"variant": "published"}


def test_a_scene_that_loops_is_there_for_its_whole_loop():
    state = PLAIN.opened("torusphere")
    assert (state.frames, state.speed) == ("0-1199", 1.0)
    assert state.opened("fence").frames == PLAIN.frames


@pytest.mark.parametrize("look", ["result", "perceived"])
def test_between_frames_on_disk_no_stale_picture_is_seen(reel, look):
    first = float(reel.state.span[0])
    pictures = []
    for frames in ([first, first + 0.7], [first + 1.0, first + 0.7]):
        for at in frames:
            reel.viewer.state = replace(reel.state, look=look, frame=at)
            picture = reel.picture()
        pictures.append(picture)
    assert np.array_equal(*pictures)


def opened_by(monkeypatch, *words):
    """The state with which `wgmb view` opens its window."""
    from wgmb import viewer

    opened = []
    monkeypatch.setattr(viewer, "view", lambda state, **_: opened.append(state))
    assert app.main(["view", *map(str, words)]) == 0
    return opened[0]


def test_the_viewer_opens_playing(monkeypatch, tmp_path):
    assert opened_by(monkeypatch, "wheel").playing
    (tmp_path / "still.toml").write_text(State(playing=False).toml())
    assert not opened_by(monkeypatch, "--config", tmp_path / "still.toml").playing


@pytest.mark.parametrize("with_depth", [True, False])
def test_frames_on_disk_open_with_the_method_that_wgmb_blur_takes(
    monkeypatch, tmp_path, device, with_depth
):
    for n in range(1, 4):
        channels = make.frame(n, "blender")
        if not with_depth:
            channels = {name: c for name, c in channels.items() if "Depth" not in name}
        make.write_exr(tmp_path / f"s.{n}.exr", channels)
    pattern = tmp_path / "s.#.exr"
    shown = Choices(device).possible(opened_by(monkeypatch, pattern)).method
    assert shown == default_method(Clip(pattern).has)
    assert shown == ("gather" if with_depth else "tap")
