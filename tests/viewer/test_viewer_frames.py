"""Frames on disk in the viewer."""

import imageio.v3 as iio
import numpy as np
import pytest

import make_frames as make
from viewer_hand import PLAIN, SAMPLE, Hand, put, seen
from wgmb import Blur, Clip, InputError, Passes
from wgmb.cli import app
from wgmb.color.srgb import srgb
from wgmb.methods import METHODS, default_method
from wgmb.settings import BlurSettings
from wgmb.viewer import State
from wgmb.viewer.capabilities import Choices

pytest_plugins = ["viewer_hand"]


@pytest.fixture(scope="module")
def reel():
    return Hand(put(PLAIN, antialias=1).opened(SAMPLE))


def test_frames_on_disk_are_blurred_as_the_library_does(reel):
    want = Blur("tap", samples=4)(next(iter(Clip(SAMPLE))))
    reel.viewer.state = put(reel.state, frame=9.0)
    reel.picture()
    got = reel.viewer.stage.download()[..., :3]
    assert np.abs(got - want[..., :3]).max() < 1e-5


@pytest.mark.parametrize("look", ["result", "perceived"])
def test_a_panorama_goes_around_as_in_a_file(tmp_path, hand, look):
    x = np.mgrid[:64, :128][1]
    for number in (1, 2):
        ball = np.abs((x - 12 * (number - 1) + 64) % 128 - 64) < 8
        planes = {c: 0.2 + 0.7 * ball.astype("f4") for c in "RGB"}
        ahead = np.where(ball, (x + 12) % 128 - x, 0).astype("f4")
        planes |= {"forward.u": ahead, "forward.v": np.zeros((64, 128), "f4")}
        make.write_exr(tmp_path / f"s.{number:04}.exr", planes)
    pattern = str(tmp_path / "s.####.exr")
    hand.viewer.state = put(PLAIN, antialias=1).opened(pattern)
    hand.viewer.state = put(hand.state, look=look, frame=1.0)
    hand.picture()
    got = hand.viewer.stage.download()[..., :3]
    blur = Blur("tap", samples=4)
    want, flat = (
        blur(Clip(pattern, passes=Passes(wrap=wrap))[1])[..., :3] for wrap in ("auto", "off")
    )
    if look == "perceived":
        got, want, flat = srgb(np.clip(got, 0, 1)), seen([want], 24.0), seen([flat], 24.0)
    assert np.abs(got - want).max() < 4e-3
    assert np.abs(want - flat).max() > 0.05


def test_frames_on_disk_are_perceived_too(reel):
    state = reel.state
    reel.viewer.state = put(state, look="perceived", frame=11.0)
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
        reel.viewer.state = put(state, look=look)
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
    reel.viewer.state = put(PLAIN.opened(SAMPLE), method="distributed", look="error")
    reel.look()
    assert (reel.state.method, reel.state.look) == (default_method(Clip(SAMPLE).has), "result")
    assert "distributed" in reel.viewer.message[0]


def test_what_cannot_be_opened_is_told(tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        State().opened("nowhere")
    assert app.main(["view", str(tmp_path / "nowhere.####.exr")]) == 2


def test_options_of_the_command_line_reach_the_state():
    state = State().with_options(
        {"method": "reproject", "samples": 8, "variant": "published", "shutter": 90.0}
    )
    blur = BlurSettings(method="reproject", samples=8, variant="published")
    assert (state.blur, state.shutter.shutter) == (blur, 90)


def test_a_scene_that_loops_is_there_for_its_whole_loop():
    state = PLAIN.opened("torusphere")
    assert (state.frames, state.speed) == ("0-1199", 1.0)
    assert state.opened("fence").frames == PLAIN.frames


@pytest.mark.parametrize("look", ["result", "sharp"])
def test_a_frame_is_there_from_its_number_until_that_of_the_next_one(reel, look):
    pictures = {}
    for at in (9.0, 9.9, 10.0, 10.6, 11.0, 11.99):
        reel.viewer.state = state = put(reel.state, look=look, frame=at)
        assert state.number == int(at)
        pictures.setdefault(state.number, []).append(reel.picture())
    for first, second in pictures.values():
        np.testing.assert_array_equal(first, second)
    assert not np.array_equal(pictures[9][0], pictures[10][0])
    assert put(reel.state, frames="9,11", frame=10.5).number == 9


@pytest.mark.parametrize("look", ["result", "perceived"])
def test_between_frames_on_disk_no_stale_picture_is_seen(reel, look):
    first = float(reel.state.span[0])
    pictures = []
    for frames in ([first, first + 0.7], [first + 1.0, first + 0.7]):
        for at in frames:
            reel.viewer.state = put(reel.state, look=look, frame=at)
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
    assert shown == ("gather" if with_depth else "tiles")
