"""The viewer shows what an observer perceives, and nature as the reference."""

import numpy as np
import pytest

from viewer_hand import ALONE, PLAIN, SMALL, put, seen
from wgmb import Blur, Render
from wgmb.cone import Cone
from wgmb.scene import builtin
from wgmb.viewer import State
from wgmb.viewer.subjects.subject import SceneSubject

pytest_plugins = ["viewer_hand"]


def rendered(numbers, fps=24.0, antialias=1, speed=1.0, **blur):
    how = Blur(**{"method": "tap", "samples": 4, **blur})
    render = Render(
        builtin.make("crossing", speed=speed), how, size=SMALL, antialias=antialias, fps=fps
    )
    return [render(n / fps, n) for n in numbers]


@pytest.mark.parametrize("frame, newest, after", [(3.0, 3, 0.0), (3.4, 3, 0.4), (2.5, 3, -0.5)])
def test_what_is_perceived_is_what_the_library_says(small, frame, newest, after):
    small.viewer.state = put(ALONE, look="perceived", frame=frame)
    got = small.picture()
    want = seen(rendered(range(newest - 12, newest + 1)), 24.0, after / 24)
    assert np.abs(got - want).max() < 4e-3  # the library keeps pictures as f16
    small.viewer.state = put(small.state, look="result")
    assert np.abs(small.picture() - want).mean() > 0.005


@pytest.mark.parametrize("method", ["distributed", pytest.param("gather", marks=pytest.mark.full)])
def test_what_stands_still_is_perceived_as_it_is(small, method):
    state = put(ALONE, set=("speed=0",), samples=16, method=method, frame=2.0)
    small.viewer.state = state
    result = small.picture()
    small.viewer.state = put(state, look="perceived")
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
    small.viewer.state = put(ALONE, look="perceived", frame=4.0)
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
    small.viewer.state = put(small.state, cone_peak=0.051, exposure=1.0)
    small.picture()
    assert drawn == []
    small.viewer.state = put(small.state, shutter=90.0)
    small.picture()
    assert len(drawn) == held


def test_who_perceives_is_set_in_the_panel(hand):
    hand.viewer.state = put(PLAIN, look="perceived", frame=4.0)
    before = hand.picture()
    hand.touch("cone_rate", 0.9)
    hand.touch("cone_peak", 0.05)
    assert hand.state.cone_rate > 100 and hand.state.cone_peak < 0.02
    quick = hand.picture()
    assert np.abs(quick - before).mean() > 0.005
    hand.viewer.state = State.of_toml(hand.state.toml())
    assert np.array_equal(hand.picture(), quick)


@pytest.mark.full
def test_the_reference_of_what_is_perceived_is_perceived_nature(small):
    """Nature is a video of very many frames."""
    state = put(ALONE, look="perceived", compare="wipe", against="reference", wipe=0.0,
                    frame=4.0, set=("speed=4",))  # fmt: skip
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
    small.viewer.state = put(
        ALONE.opened("disk"), frame=8.0, look="perceived", compare="difference",
        against="reference", gain=1.0,
    )  # fmt: skip
    boxes = small.picture().mean()
    assert small.viewer.stage.report.labels[1] == "nature, perceived"
    small.viewer.state = put(small.state, shutter=0.0)
    assert small.picture().mean() > 1.2 * boxes > 0
    for name, choice in (("crossing", True), ("torusphere", False), ("cone", False)):
        state = put(ALONE.opened(name), look="perceived")
        assert ("reference" in small.viewer.stage.choices.rivals(state)) is choice
