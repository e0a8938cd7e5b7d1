"""Two pictures compared in the viewer, and the error to the reference."""

import numpy as np
import pytest

from viewer_hand import ALONE, SMALL, put
from wgmb import Blur, Render
from wgmb.color.srgb import srgb
from wgmb.scene import builtin
from wgmb.viewer import controls
from wgmb.viewer.draw import renderer
from wgmb.viewer.draw.adaptive import Pace
from wgmb.viewer.draw.place import key_box

pytest_plugins = ["viewer_hand"]


def pictures(bare):
    """The result, and the sharp picture."""
    bare.viewer.state = ALONE
    first = bare.picture()
    bare.viewer.state = put(ALONE, look="sharp")
    return first, bare.picture()


def test_wipe_shows_either_side_and_its_line_is_dragged(bare):
    first, second = pictures(bare)
    bare.viewer.state = put(ALONE, compare="wipe", against="sharp", wipe=0.5)
    shown = bare.picture()
    assert np.array_equal(shown[:, :158], first[:, :158])
    assert np.array_equal(shown[:, 162:], second[:, 162:])
    bare.drag((160, 85), (80, 125))
    assert bare.state.wipe == pytest.approx(0.25)
    assert bare.state.scene.orbit == (0, 0)
    shown = bare.picture()
    assert np.array_equal(shown[:, 82:], second[:, 82:])


def test_split_shows_both_whole(bare):
    bare.viewer.state = put(ALONE, compare="split", against=ALONE.method)
    bare.picture()
    whole = bare.look()
    left, right = whole[45:135, 5:155], whole[45:135, 165:315]
    assert np.abs(left - right).max() <= 2
    assert left.std() > 10


def test_difference_of_the_same_is_black_and_of_others_is_not(bare):
    bare.viewer.state = put(ALONE, compare="difference", against=ALONE.method)
    assert bare.picture().max() == 0
    bare.viewer.state = put(ALONE, compare="difference", against="sharp", gain=2.0)
    got, (first, second) = bare.picture(), pictures(bare)
    assert np.abs(got - np.clip(2 * np.abs(first - second), 0, 1)).max() < 5e-3


def test_flicker_changes_with_the_clock(bare):
    first, second = pictures(bare)
    bare.viewer.state = put(ALONE, compare="flicker", against="sharp")
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
        bare.viewer.state = put(ALONE, look="error", compare=compare)
        bare.look(1.0)
        for _ in range(2):
            bare.look(0.5)
            shown.append(bare.viewer.screen.picture())
        assert key_box(bare.state, "COLOR", (0, 0, 9, 9), (0, 0, 9, 9), 1.0)
        layout = controls.WindowLayout((0, 0, 320, 1010), (0, 400, 320, 180))
        assert controls.grip(bare.state, layout, 160, 500, 1, ()) == "orbit"
    assert all(picture.max() > 0.3 for picture in shown)  # flicker would show black in between


@pytest.mark.full
def test_the_reference_converges_and_is_measured(small, monkeypatch):
    monkeypatch.setattr(renderer, "_STEP", 0.0)  # a sample a frame, however fast the machine is
    at = 7 / 24  # a moment that no other test has measured
    small.viewer.state = put(ALONE, look="error", gain=1.0, frame=7.0)
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
    small.viewer.state = put(small.state, frame=1.0)
    small.look()
    assert small.viewer.stage.report.reference[0] < rays[-1]  # begun anew


def test_what_is_shown_never_has_less_in_it_than_before(small, monkeypatch):
    monkeypatch.setattr(renderer, "_STEP", 0.0)  # a few samples at a time
    monkeypatch.setattr(small.viewer.stage.detail, "is_slow", True)
    monkeypatch.setattr(small.viewer.stage.detail, "pace", Pace(5))
    small.viewer.state = put(ALONE, method="accumulate", samples=32)
    want, shown = small.picture(), small.viewer.stage._slots
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
