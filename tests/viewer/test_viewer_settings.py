"""Settings, pictures and recordings that the viewer saves, and the commands that take them."""

import os
import random
import tomllib
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

import make_frames as make
from viewer_hand import BESIDE, PLAIN, SAMPLE, put
from wgmb import Blur, InputError, Render
from wgmb.cli import app
from wgmb.io import exr
from wgmb.scene import builtin
from wgmb.viewer import State

pytest_plugins = ["viewer_hand"]


MANY = put(
    State(),
    source="fence",
    set=("speed=4.5", "posts=11"),
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
    variant="slices",
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
        ("[render", "not TOML"),
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


SAVED = """
[render]
scene = "fence"
set = ["speed=4.5", "posts=11"]
size = "256x144"
antialias = 1
orbit = [10.5, -3.0]
pan = [0.25, -0.5]
dolly = 0.8
method = "reproject"
samples = 5
jitter = 0.5
max_blur = 33.0
variant = "slices"
shutter = 270.0
phase = "0.1"
curve = "cosine"
rolling_duration = 1.0
fps = "30"
time = 0.11666666666666667

[view]
frames = "0-11"
frame = 3.5
look = "result"
eyes = ""
compare = "split"
against = "tap"
wipe = 0.5
gain = 4.0
fastest = 0.05
middle = 5.0
exposure = -0.5
tone = "soft"
cone_rate = 80.0
cone_peak = 0.02
zoom = 1.0
center = [0.5, 0.5]
playing = true
speed = 0.5
panel = true
"""


def test_saved_settings_have_the_form_that_files_of_users_have():
    assert tomllib.loads(MANY.toml()) == tomllib.loads(SAVED)
    assert State.of_toml(SAVED) == MANY


ON_DISK = State("a.####.exr").with_settings(
    also=("b.####.exr", "c\x7f.exr"), camera=Path("cam.json"), far=50.0, holdout=("Matte", "-x"),
    ocio="off", reach=2, rolling="up",
)  # fmt: skip


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
    [(b"\xff[render]", "UTF-8"), (b"[render", "not TOML"), (b"[render]\nscene = 3", "scene")],
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
    hand.viewer.state = put(MANY, playing=False, jitter=0.0, **plain)
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


@pytest.mark.parametrize("state", [MANY, put(PLAIN.opened(SAMPLE), shutter=90.0)])
def test_the_command_line_is_one(state, tmp_path):
    state = put(state, frames="9-10") if not state.is_scene else put(state, frames="0-1")
    out = tmp_path / "out.####.png"
    assert app.main([*state.command(str(out)), "--quiet"]) == 0
    assert len(list(tmp_path.glob("out.*.png"))) == 2


@pytest.mark.skipif(os.name == "nt", reason="permissions are the folder's there")
def test_screenshots_of_private_frames_are_private(hand, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    shot = make.write_sequence(tmp_path / "in", [1, 2])
    (tmp_path / "in" / "shot.0002.exr").chmod(0o600)
    hand.viewer.do("open", shot)
    for key in "svv":
        hand.press(key)
        hand.look()
    made = sorted(tmp_path.glob("wgmb-001.*"))
    assert [path.suffix for path in made] == [".exr", ".mp4", ".png"]
    assert not any(path.stat().st_mode & 0o077 for path in made)


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
    hand.viewer.state = put(PLAIN, size="64x36", frames="0-1")
    hand.look()
    hand.viewer.do("export", str(tmp_path / "out.####.png"))
    child = hand.viewer.actions.export[0]
    assert child.wait(60) == 0
    hand.look()
    assert "exported" in hand.viewer.actions.export_message
    assert len(list(tmp_path.glob("*.png"))) == 2
