"""The viewer shows what OpenColorIO's processor makes, and keeps it while nothing changes."""

import numpy as np
import pytest

import make_frames as make
from make_config import film_config
from viewer_hand import ALONE, BARE, PLAIN, SIZE, Hand, put
from wgmb import DeviceError, InputError
from wgmb.cli import app
from wgmb.color.primaries import AP1, REC709
from wgmb.color.spaces import ColorConfig
from wgmb.gpu.textures import TexturePool
from wgmb.io import exr
from wgmb.settings.color import ColorSettings
from wgmb.viewer import State
from wgmb.viewer.draw import display as displayed
from wgmb.viewer.draw.ocio_shader import OUTPUT, OcioShader
from wgmb.viewer.state.groups import changed

ACES13 = "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1"
NEARLY_ALL = 0.9999  # of the pixels are within 1/255


def on_the_gpu(device, display, space, rgba: np.ndarray, exposure: float) -> np.ndarray:
    """The display values that a display's own shader makes."""
    size, pool = rgba.shape[1::-1], TexturePool(device)
    pool.upload("light", rgba, "rgba32float")
    light, shown = pool.texture("light", size, "rgba32float"), pool.texture("o", size, OUTPUT)
    OcioShader(device, display, space).show(light, exposure, shown)
    return pool.download(device.create_command_encoder(), shown)[..., :3].astype("f4")


@pytest.mark.covers(0)
@pytest.mark.parametrize(
    ("config", "view"),
    [("film", "Film"), ("builtin", None), ("builtin", "Un-tone-mapped"), (ACES13, None)],
)
def test_the_gpu_shows_what_the_processor_does(tmp_path, device, config, view):
    made = ColorConfig(film_config(tmp_path) if config == "film" else config)
    rng = np.random.default_rng(4)
    rgba = 2 ** rng.uniform(-8, 5, (120, 170, 4)).astype("f4")
    rgba[:9, :, 1] *= -0.1
    rgba[..., 3] = rng.choice(np.float32([0, 0.3, 1]), rgba.shape[:2])
    rgba[10, :4] = np.nan, np.inf, 0, 1
    rgba[11, :4] = 0
    display = made.display(view=view)
    for space in (made.space_of({}), made.scene_linear):
        got = on_the_gpu(device, display, space, rgba, 0.5)
        straight = rgba * np.float32([0.5, 0.5, 0.5, 1])
        off = np.abs(got - display.shown(straight, space, over_black=True)).max(axis=2)
        assert (off <= 1 / 255).mean() >= NEARLY_ALL
        assert not got[11, :4].any()


def shown_by(hand) -> np.ndarray:
    return hand.viewer.screen.picture()


def chosen(state) -> dict:
    """The options of colour that are not as by default."""
    return changed("color", state.color)


def wanted(hand, space=None) -> np.ndarray:
    """The processor's result for the light in the viewer."""
    display = hand.viewer.stage.choices.displayed.display(hand.state)
    light = hand.viewer.stage.download().astype("f4")
    light[..., :3] *= 2**hand.state.exposure
    return display.shown(light, space or display.config.space_of({}), over_black=True)


def cannot(*_) -> None:
    raise DeviceError("this compiler reads no GLSL")


@pytest.mark.parametrize("gpu_can", [True, False])
def test_a_scene_is_shown_as_the_view_shows_it(tmp_path, monkeypatch, gpu_can):
    if not gpu_can:
        monkeypatch.setattr(displayed, "OcioShader", cannot)
    state = ALONE.with_settings(ocio=str(film_config(tmp_path)))
    hand = Hand(put(state, exposure=1.0), BARE)
    hand.look_until(lambda: not hand.viewer.stage.report.busy)
    want = wanted(hand)
    off = np.abs(shown_by(hand) - want).max(axis=2)
    assert (off <= 1 / 255).mean() >= NEARLY_ALL
    hand.viewer.state = put(hand.state, color=ColorSettings())
    hand.look()
    assert np.abs(shown_by(hand) - want).mean() > 0.05


def test_what_does_not_change_is_not_shown_anew(tmp_path, monkeypatch):
    drawn = []
    draw = displayed.DisplayCache._draw
    monkeypatch.setattr(
        displayed.DisplayCache, "_draw", lambda *given: (drawn.append(1), draw(*given))
    )
    hand = Hand(ALONE.with_settings(ocio=str(film_config(tmp_path))), BARE)
    hand.look_until(lambda: not hand.viewer.stage.report.busy)
    count = len(drawn)
    for _ in range(3):
        hand.look()
    assert len(drawn) == count > 0
    hand.viewer.state = put(hand.state, exposure=0.5)
    hand.look()
    assert len(drawn) == count + 1


def test_the_panel_chooses_config_display_view_and_look(tmp_path):
    config = film_config(tmp_path)
    hand = Hand(PLAIN.with_settings(ocio=str(config)), SIZE)
    before = shown_by(hand)
    hand.choose("view", "Log")
    assert chosen(hand.state) == {"ocio": str(config), "view_transform": "Log"}
    assert np.abs(shown_by(hand) - before).mean() > 0.02
    hand.choose("look", "Punchy")
    assert chosen(hand.state)["look"] == "Punchy"
    hand.choose("ocio", "builtin")
    assert chosen(hand.state) == {"ocio": "builtin"}
    hand.choose("display", "Display P3 - Display")
    assert chosen(hand.state)["display"] == "Display P3 - Display"
    hand.choose("ocio", "off")
    assert chosen(hand.state) == {"ocio": "off"}
    assert "tone" in hand.viewer.panel.places


def test_a_view_that_is_gone_is_a_message(tmp_path):
    hand = Hand(ALONE.with_settings(ocio=str(film_config(tmp_path))), BARE)
    hand.viewer.state = hand.state.with_settings(view_transform="Agfa")
    hand.look()
    assert "unknown view 'Agfa'" in hand.viewer.message[0]
    assert chosen(hand.state).keys() == {"ocio"}


def shot(folder, attributes=None) -> str:
    """Two frames; what their pattern is."""
    for n in (1, 2):
        make.write_exr(folder / f"a.{n:04d}.exr", make.frame(n, "plain"), attributes)
    return str(folder / "a.####.exr")


def test_frames_are_shown_by_what_they_say_of_their_colours(tmp_path):
    config = film_config(tmp_path, alias="lin_ap1", name="scene")
    for folder, attributes in (("said", {"chromaticities": AP1}), ("silent", {})):
        (tmp_path / folder).mkdir()
        state = ALONE.opened(shot(tmp_path / folder, attributes))
        hand = Hand(put(state, method="tap").with_settings(ocio=str(config)), (64, 48))
        hand.look_until(lambda hand=hand: not hand.viewer.stage.report.busy)
        found = hand.viewer.stage.choices.displayed.display(hand.state).config
        space = found.space_of(attributes)
        off = np.abs(shown_by(hand) - wanted(hand, space)).max(axis=2)
        assert (off <= 1 / 255).mean() >= NEARLY_ALL
        primaries = hand.viewer.stage.chromaticities["chromaticities"]
        assert np.allclose(primaries, AP1 if attributes else REC709, rtol=0, atol=1e-6)


def test_frames_that_are_not_linear_are_made_so(tmp_path):
    config = film_config(tmp_path)
    state = put(ALONE.opened(shot(tmp_path)), method="tap", look="sharp")
    hand = Hand(state.with_settings(ocio=str(config), from_="log"), (64, 48))
    codes = exr.read(tmp_path / "a.0001.exr").channels()
    want = ColorConfig(config).space("log").linear(np.stack([codes[c] for c in "RGB"], axis=2))
    got = hand.viewer.stage.download()[..., :3]
    assert np.allclose(got, want, rtol=2e-3)  # of half floats


def test_colours_go_into_settings_files_and_command_lines(tmp_path, capsys):
    config, pattern = film_config(tmp_path), shot(tmp_path)
    color = {"ocio": str(config), "view_transform": "Log", "look": "Punchy", "from_": "log"}
    state = put(ALONE.opened(pattern), method="tap").with_settings(**color)
    again = State.of_toml(state.toml())
    assert chosen(again) == color
    assert again.look == state.look == "result"
    assert 'from = "log"\n' in state.toml()
    words = state.command(str(tmp_path / "o.####.png"))
    assert words[words.index("--from") + 1] == "log"
    assert app.main([*words, "-q"]) == 0
    (tmp_path / "s.toml").write_text(state.toml())
    more = ["blur", "--config", str(tmp_path / "s.toml"), "-o", str(tmp_path / "p.####.png"), "-q"]
    assert app.main(more) == 0
    assert (tmp_path / "o.0001.png").read_bytes() == (tmp_path / "p.0001.png").read_bytes()
    assert capsys.readouterr().err == ""


def test_a_scene_has_no_colour_space_to_be_given(tmp_path):
    with pytest.raises(InputError, match="--from is for frames, crossing is a scene"):
        ALONE.with_options({"ocio": "builtin", "from_": "acescg", "look": None})
    with pytest.raises(InputError, match="unknown name 'from'"):
        State.of_toml('[render]\nscene = "wheel"\nfrom = "acescg"\n')
    with pytest.raises(InputError, match="unknown name 'from_'"):
        State.of_toml('[blur]\npattern = "a.exr"\nfrom_ = "acescg"\n')


def test_other_frames_have_colours_of_their_own(tmp_path):
    state = ALONE.opened(shot(tmp_path)).with_settings(ocio="builtin", from_="acescg")
    assert chosen(state.opened("wheel")) == {"ocio": "builtin"}
