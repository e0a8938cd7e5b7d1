"""The viewer shows what the library draws: every method, scene and look."""

import numpy as np
import pytest

from viewer_hand import ALONE, BARE, PLAIN, library, put, seen
from wgmb.color import srgb as color
from wgmb.color.srgb import srgb
from wgmb.methods import METHODS
from wgmb.scene import builtin
from wgmb.viewer import State
from wgmb.viewer.draw.place import key_box
from wgmb.viewer.panel import scopes

pytest_plugins = ["viewer_hand"]


@pytest.mark.parametrize("method", ["tap", "distributed"])
def test_the_picture_is_what_render_writes(bare, method):
    state = bare.viewer.state = put(ALONE, method=method, frame=2.0)
    got = bare.picture()
    render, moment = library(state, BARE)
    assert got.shape == (180, 320, 3)
    assert np.abs(got - srgb(render(*moment)[..., :3])).max() < 2e-3


def test_the_window_shows_the_picture_in_its_place(hand):
    want = hand.picture()
    x, y, width, height = hand.viewer.stage.report.place
    shown = hand.look()[y : y + height, x : x + width]
    assert np.abs(shown / 255 - want).max() < 0.01


@pytest.mark.full
def test_every_method_and_scene_can_be_chosen(hand):
    methods = hand.viewer.stage.choices.methods(PLAIN)
    assert set(METHODS) - set(methods) == {"volume"}  # there is none in the scene
    for method in methods:
        hand.choose("method", method)
        assert hand.state == put(PLAIN, method=method)
    for name in builtin.SCENES:
        before = hand.state
        if name != before.source:
            hand.choose("scene", name)
            possible = hand.viewer.stage.choices.possible
            assert hand.state == possible(before.opened(name))


@pytest.mark.parametrize("name", builtin.SCENES)
def test_every_scene_is_what_render_draws(small, name):
    opened = put(ALONE, method=State().method).opened(name)
    method = "tap" if opened.method == State().method else opened.method
    state = small.viewer.state = put(opened, method=method, frame=3.0)
    got = small.picture()
    render, moment = library(state)
    want = srgb(render(*moment)[..., :3])
    assert got.std() > 0.01
    assert np.abs(got - want).max() < 2e-3


@pytest.mark.parametrize("tone", ["clip", "soft"])
def test_exposure_and_tone(small, tone):
    state = small.viewer.state = put(ALONE, exposure=1.5, tone=tone, look="sharp")
    want = library(state)[0].frame(0.0).color[..., :3] * 2**1.5
    want = want / (1 + want) if tone == "soft" else want
    assert np.abs(small.picture() - srgb(want)).max() < 2e-3


def test_false_colours_are_those_of_the_stops(small):
    state = small.viewer.state = put(ALONE, exposure=-2.0, tone="false", look="sharp")
    light = library(state)[0].frame(0.0).color[..., :3] * 2**-2.0
    stops = np.log2(np.maximum(light @ [0.2126, 0.7152, 0.0722], 1e-20))
    low, high = scopes.STOPS
    at = np.clip((stops - low) / (high - low), 0, 1)
    ramp = [(0, 0, 0.02), (0.28, 0.06, 0.46), (0.8, 0.2, 0.3), (0.99, 0.7, 0.15), (1, 1, 0.9)]

    def colors(at):
        return np.stack([np.interp(at, np.linspace(0, 1, 5), c) for c in np.transpose(ramp)], -1)

    shown, want = small.picture(), colors(at)
    place = (0, 0, shown.shape[1], shown.shape[0])
    x, y, wide, height = key_box(state, "COLOR", place, place, 1.0)
    key = np.round([y, y + height, x, x + wide]).astype(int)
    key = slice(*key[:2]), slice(*key[2:])
    across = (np.arange(shown.shape[1]) + 0.5 - x) / wide
    want[key] = colors(across)[key[1]]
    assert want[key].shape[0] >= 8 and want[key].shape[1] >= 60
    assert np.abs(shown - want).max() < 2e-3


def test_velocity_has_the_colours_of_display(bare):
    state = bare.viewer.state = put(ALONE, look="velocity")
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
    state = bare.viewer.state = put(ALONE, look="depth")
    shown = bare.picture()
    depth = library(state, BARE)[0].frame(0.0).depth
    want = np.where(np.isfinite(depth), 5 / (5 + depth), 0)
    apart = np.abs(shown - want[..., None])
    apart[150:, :160] = 0  # the legend
    assert apart.max() < 2e-3


def test_what_a_method_shows_of_itself_can_be_looked_at(hand):
    hand.viewer.state = put(PLAIN, method="reproject")
    result = hand.picture()
    assert "count" in hand.viewer.stage.choices.looks(hand.state)
    hand.choose("look at", "count")
    assert np.abs(hand.picture() - result).max() > 0.1


USUAL = {"tap", "gather", "accumulate"}


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    "method",
    [
        pytest.param(name, marks=[] if name in USUAL else pytest.mark.full)
        for name in METHODS
        if name != "volume"
    ],
)
def test_all_that_a_method_draws_is_what_render_draws(small, method):
    """Depth, velocity and error are those of all methods, and have tests of their own."""
    found = small.viewer.stage.choices.looks(put(ALONE, method=method))
    drawn = [look for look in found if look not in ("depth", "velocity", "error")]
    assert drawn[:3] == ["result", "sharp", "perceived"]
    for look in drawn:
        state = small.viewer.state = put(ALONE, method=method, look=look)
        render, moment = library(state)
        if look == "sharp":
            want = srgb(render.frame(*moment).color[..., :3])
        elif look == "perceived":
            numbers = range(1 - state.eye.frames_needed(state.fps), 1)
            want = seen([render(n / state.fps, n) for n in numbers], state.fps)
        else:
            want = srgb(render(*moment)[..., :3])
        assert np.abs(small.picture() - want).max() < 4e-3, look
