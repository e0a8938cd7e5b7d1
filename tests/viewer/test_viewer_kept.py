"""Two settings side by side: A, the present ones, and B, those that were kept."""

import weakref

import numpy as np
import pytest

from viewer_hand import ALONE, SAMPLE, SMALL, Hand, library, put
from wgmb import Blur, gpu
from wgmb.color.srgb import srgb
from wgmb.gpu.textures import TexturePool
from wgmb.viewer import controls
from wgmb.viewer.capabilities import Choices
from wgmb.viewer.draw import blurs
from wgmb.viewer.draw.adaptive import Pace
from wgmb.viewer.draw.blurs import Blurs
from wgmb.viewer.panel.panel import commands
from wgmb.viewer.state.state import Kept
from wgmb.viewer.subjects.subject import ClipSubject

LAYOUT = controls.WindowLayout((0, 0, 9, 9), (0, 0, 9, 9))
A = put(ALONE, shutter=360.0)
B = put(ALONE, method="tiles", shutter=90.0, samples=8)


def pressed(state, key):
    return controls.key(state, LAYOUT, key)[0]


def as_drawn(state):
    render, moment = library(put(state, look="result"))
    return srgb(np.clip(render(*moment)[..., :3], 0, 1))


@pytest.fixture(scope="module")
def hand():
    return Hand(B, SMALL)


def test_the_picture_is_a_on_one_side_and_b_on_the_other(hand):
    kept = pressed(B, "b")
    assert (kept.compare, kept.against, kept.kept) == ("wipe", "B", Kept.of(B))
    hand.viewer.state = put(kept, method="tap", samples=4, shutter=360.0, wipe=0.5)
    both = hand.picture()
    half = SMALL[0] // 2
    np.testing.assert_allclose(both[:, : half - 2], as_drawn(A)[:, : half - 2], atol=3e-3)
    np.testing.assert_allclose(both[:, half + 2 :], as_drawn(B)[:, half + 2 :], atol=3e-3)
    labels = hand.viewer.stage.report.labels
    assert labels == ("tap, 4 samples, 360 deg", "B: tiles, 8 samples, 90 deg")
    hand.viewer.state = put(hand.state, compare="difference", gain=1.0)
    want = np.abs(as_drawn(A) - as_drawn(B))
    np.testing.assert_allclose(hand.picture(), want, atol=4e-3)


def test_a_setting_of_a_draws_b_no_more_than_once(hand, monkeypatch):
    hand.viewer.state = put(pressed(B, "b"), method="tap", samples=4)
    hand.picture()
    before = hand.viewer.stage._slots["second"]
    hand.viewer.state = put(hand.state, samples=6)
    hand.picture()
    assert hand.viewer.stage._slots["second"] is before


def test_they_are_exchanged_and_back():
    state = put(pressed(B, "b"), method="tap", samples=4, shutter=360.0)
    other = pressed(state, "x")
    assert (other.blur, other.shutter) == (B.blur, B.shutter)
    assert other.kept == Kept.of(state)
    assert pressed(other, "x") == state
    assert pressed(ALONE, "x") == ALONE


def test_another_source_has_no_b_and_none_is_offered(hand):
    kept = pressed(B, "b")
    assert kept.opened(SAMPLE).kept is None
    choices = hand.viewer.stage.choices
    assert "B" in choices.rivals(kept) and "B" not in choices.rivals(ALONE)
    assert choices.possible(put(kept, kept=None)).against != "B"


def test_both_have_a_command():
    state = put(pressed(B, "b"), method="tap", samples=4, shutter=360.0)
    first, second = commands(state, "out.mp4").splitlines()
    assert "--method tap" in first and "-o out.mp4" in first and "--shutter 360" in first
    assert "--method tiles" in second and "-o out-b.mp4" in second and "--shutter 90" in second
    assert len(commands(put(state, compare="off"), "out.mp4").splitlines()) == 1


def test_blurs_are_kept_as_far_as_memory_allows(monkeypatch):
    device = gpu.open_device()
    kept = Blurs(device, Choices(device), Pace())
    states = [put(A, samples=count) for count in range(4, 9)]

    def asked(size):
        made = [weakref.ref(kept("first", "result", state, size, None)) for state in states]
        return [ref() is not None for ref in made]

    small, large = (64, 36), (480, 270)
    monkeypatch.setattr(kept, "_most", 4 * blurs._PIXEL * 64 * 36)
    assert asked(small) == [False, True, True, True, True]
    assert asked(large) == [False, False, False, True, True]
    monkeypatch.undo()
    assert asked(large) == 5 * [True]


def test_frames_keep_no_method_and_the_textures_of_a_few():
    device, state = gpu.open_device(), ALONE.opened(SAMPLE)
    subject = ClipSubject(device, state, None)
    size = subject.size(state)
    texture = TexturePool(device).texture("output", size, "rgba32float")
    drawn = []
    for method in ("tap", "tiles", "fusion", "reproject", "gather"):
        blur = Blur(method, samples=4, device=device)
        subject.look_at(state, size, 1)
        subject.draw(blur, texture, (0, 1.0), None)
        drawn.append(weakref.ref(blur))
        del blur
    assert not any(blur() for blur in drawn)
    assert len(subject._uploads) == 3
