"""Stereo frames in the viewer: one eye, a pair, red-cyan."""

import numpy as np
import pytest

import make_frames as make
from make_stereo import many_parts, one_view, single_part, with_stereo
from viewer_hand import PLAIN, SAMPLE, Hand, put
from wgmb import Blur, Clip
from wgmb.viewer import State, controls

ALONE = put(PLAIN, panel=False)


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """A pattern of stereo frames; right is the default view."""
    return with_stereo(tmp_path_factory.mktemp("stereo"), single_part)


@pytest.fixture(scope="module")
def shared(frames):
    return Hand(ALONE.opened(frames), (320, 240))


@pytest.fixture
def bare(shared, frames):
    shared.viewer.state = put(ALONE.opened(frames), frame=2.0)
    shared.look()
    return shared


def eye(bare, view: str, **more) -> np.ndarray:
    """The picture of one view."""
    bare.viewer.state = put(bare.state, eyes=view, compare="off", **more)
    return bare.picture()


def test_each_eye_is_what_the_library_blurs(bare, frames):
    clip = Clip(frames)
    for view in clip.views:
        eye(bare, view)
        want = Blur("tap", samples=4)(clip.with_neighbours(clip.source(2, view)))
        got = bare.viewer.stage.download()
        assert np.abs(got - want[..., : got.shape[2]]).max() < 1e-5


def test_the_default_view_is_seen_first_or_the_one_that_was_chosen(frames):
    assert Hand(ALONE.opened(frames), (160, 120)).state.eyes == "right"
    chosen = ALONE.opened(frames).with_options({"view": "left"})
    hand = Hand(chosen, (160, 120))
    assert hand.state.eyes == "left"
    assert "--view left" in " ".join(hand.state.command("o.####.exr"))


@pytest.mark.parametrize("look", ["result", "sharp", "velocity"])
def test_a_pair_shows_the_left_eye_on_the_left(bare, look):
    each = [eye(bare, view, look=look) for view in ("left", "right")]
    pair = eye(bare, "pair", look=look)
    height, width, _ = pair.shape
    small = [one.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3)) for one in each]
    halves = np.split(pair[height // 4 : height // 4 + height // 2], 2, axis=1)
    for half, own, other in zip(halves, small, small[::-1], strict=True):
        inner = slice(4, -60)  # without the line between them, and the colours' key
        apart = [np.abs(half - whole)[:, inner].mean() for whole in (own, other)]
        assert apart[0] < 0.03
        assert apart[0] < 0.5 * apart[1]


def test_red_is_the_left_eye_and_cyan_the_right(bare):
    left, right = (eye(bare, view) for view in ("left", "right"))
    both = eye(bare, "red-cyan")
    assert np.array_equal(both[..., 0], left[..., 0])
    assert np.array_equal(both[..., 1:], right[..., 1:])


def test_what_is_perceived_may_be_seen_with_both_eyes(bare):
    left, right = (eye(bare, view, look="perceived", frame=3.0) for view in ("left", "right"))
    both = eye(bare, "red-cyan", look="perceived", frame=3.0)
    assert np.abs(both[..., 0] - left[..., 0]).max() < 2e-3
    assert np.abs(both[..., 1:] - right[..., 1:]).max() < 2e-3


def test_an_eye_is_compared_with_its_own_sharp_picture(bare):
    sharp = eye(bare, "left", look="sharp")
    bare.viewer.state = put(bare.state, look="result", compare="wipe", against="sharp", wipe=0)
    assert np.array_equal(bare.picture()[:, 4:], sharp[:, 4:])


def test_e_goes_through_the_eyes_and_does_nothing_without_any(bare):
    seen = []
    for _ in range(5):
        bare.press("e")
        seen.append(bare.state.eyes)
    assert seen == ["left", "pair", "red-cyan", "right", "left"]
    assert controls.key(PLAIN, controls.WindowLayout((0, 0, 9, 9), (0, 0, 9, 9)), "e")[0] == PLAIN


def test_the_panel_has_a_choice_of_eyes_for_stereo_frames_only(frames):
    hand = Hand(PLAIN.opened(frames))
    hand.choose("eyes", "red-cyan")
    assert hand.state.eyes == "red-cyan"
    assert "compare" not in hand.viewer.panel.places
    hand.viewer.state = PLAIN.opened(SAMPLE)
    hand.look()
    hand.look()
    assert hand.state.eyes == ""
    assert "eyes" not in hand.viewer.panel.places
    assert "compare" in hand.viewer.panel.places


def test_eyes_are_saved_and_are_no_option_of_blur(frames):
    state = put(State().opened(frames), eyes="red-cyan")
    assert State.of_toml(state.toml()) == state
    assert "red-cyan" not in state.command("o.####.exr")


def test_eyes_of_other_data_windows_lie_where_they_are(tmp_path):
    """The left eye has overscan that the right one has not."""
    whole = 0, 0, make.WIDTH - 1, make.HEIGHT - 1
    parts = [make.part(one_view(1, (2, 0)), {"view": "left"}, name="l", data=whole,
                       display=(8, 4, 60, 40)),
             make.part(
                 {n: p[4:41, 8:61] for n, p in one_view(1, (2, 0)).items()}, {"view": "right"},
                 name="r", data=(8, 4, 60, 40), display=(8, 4, 60, 40))]  # fmt: skip
    path = make.write_parts(tmp_path / "a.exr", parts)
    hand = Hand(put(ALONE.opened(str(path)), look="sharp", eyes="red-cyan"), (640, 480))
    both = hand.picture()
    assert hand.viewer.stage.report.size == (make.WIDTH, make.HEIGHT)
    left = eye(hand, "left")
    height, width, _ = both.shape
    inside = (slice(height * 6 // 48, height * 38 // 48), slice(width * 10 // 64, width * 58 // 64))
    assert np.abs(both - left)[inside].max() < 5e-3
    assert not both[: height * 3 // 48, :, 1:].any()


def test_views_of_any_names_are_two_eyes(tmp_path):
    parts = many_parts(1)
    for part in parts:
        if "view" in part.header:
            part.header["view"] = {"right": "R", "left": "centre"}[part.header["view"]]
    path = make.write_parts(tmp_path / "a.exr", parts)
    hand = Hand(put(ALONE.opened(str(path)), eyes="pair"), (160, 120))
    assert hand.viewer.stage.choices.sides(hand.state) == ("centre", "R")
    assert hand.viewer.stage.report.labels == ("tap, centre", "tap, R")
