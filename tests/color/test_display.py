"""OpenColorIO: pictures look as its own processor makes them, inputs mean what they say."""

import re
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from PyOpenColorIO import (
    OPTIMIZATION_LOSSLESS,
    TRANSFORM_DIR_FORWARD,
    Config,
    DisplayViewTransform,
    GroupTransform,
    LookTransform,
)

import make_frames as make
from make_config import film_config, light, samples
from wgmb import InputError
from wgmb.color.primaries import (
    AP0,
    AP1,
    P3_D65,
    REC709,
    REC2020,
    XYZ,
    conversion,
    of_matrix,
)
from wgmb.color.spaces import ColorConfig
from wgmb.color.srgb import linear, to_display
from wgmb.extras import install_command
from wgmb.io import exr, stills
from wgmb.output.output import Output
from wgmb.sequence.clip import Clip
from wgmb.sequence.frame_file import FrameFile

pytestmark = pytest.mark.fast

ACES13 = "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1"
SRGB = "sRGB - Display"
RAW = FrameFile(1, Path("made.exr"), None, {}, {})


@pytest.fixture
def film(tmp_path):
    return ColorConfig(film_config(tmp_path))


@pytest.fixture(scope="module")
def aces():
    return ColorConfig("builtin")


def by_ocio(config, source: str, display: str, view: str, rgb: np.ndarray) -> np.ndarray:
    """The result of OpenColorIO's own processor for straight colours."""
    processor = config.getProcessor(source, display, view, TRANSFORM_DIR_FORWARD)
    shown = np.array(rgb, np.float32, order="C")
    processor.getDefaultCPUProcessor().applyRGB(shown)
    return np.clip(shown, 0, 1)


VIEWS = [
    ("builtin", "Linear Rec.709 (sRGB)", SRGB, "ACES 2.0 - SDR 100 nits (Rec.709)"),
    ("builtin", "Linear Rec.709 (sRGB)", SRGB, "Un-tone-mapped"),
    (ACES13, "Linear Rec.709 (sRGB)", SRGB, "ACES 1.0 - SDR Video"),
    ("film", "lin_rec709", "Screen", "Film"),
]


@pytest.mark.parametrize(("config", "source", "display", "view"), VIEWS, ids=lambda v: v[:12])
@pytest.mark.parametrize("bits", [8, 16])
def test_a_png_looks_as_opencolorio_makes_it(tmp_path, config, source, display, view, bits):
    place = film_config(tmp_path) if config == "film" else config
    made = ColorConfig(place)
    rgb, out = light(), tmp_path / "o.png"
    Output(out, numbers=[1], bits=bits, display=made.display(display, view)).write(rgb, RAW)
    own = Config.CreateFromFile({"builtin": "ocio://default"}.get(config, str(place)))
    want = by_ocio(own, source, display, view, rgb)
    assert np.abs(samples(out) / (2.0**bits - 1) - want).max() <= (1 / 255 if bits == 8 else 2e-4)
    assert np.ptp(want) > 0.8


def test_colours_are_unassociated_for_the_transform(tmp_path, film):
    rgba, out = light(4), tmp_path / "o.png"
    rgba[5, :10] = 0, 0, 0, 0
    rgba[6, :10] = 0.5, 0.2, 0.1, 0  # light that is added
    rgba[7, :10] = 0.2, 0.1, 0.1, 1e-7
    Output(out, numbers=[1], display=film.display()).write(rgba, RAW)
    got = samples(out)
    with np.errstate(all="ignore"):
        straight = np.where(rgba[..., 3:] > 0, rgba[..., :3] / rgba[..., 3:], 0)
    want = by_ocio(film._config, "lin_rec709", "Screen", "Film", straight)
    want[rgba[..., 3] == 0] = 0
    assert np.abs(got[..., :3] / 255 - want).max() <= 1 / 255
    assert (got[..., 3] == np.rint(255 * rgba[..., 3])).all()


def test_without_alpha_in_the_file_the_picture_lies_over_black(film):
    rgba, shown = light(4), film.display()
    rgba[6, :10] = 0.5, 0.2, 0.1, 0
    rgba[7, :10] = 0
    space = film.space_of({})
    over = shown.of(space)(rgba, 8, over_black=True)
    straight = shown.shown(rgba, space)
    want = straight * rgba[..., 3:]
    want[6, :10] = shown.shown(rgba[6:7, :10, :3], space)  # as it is: nothing covers it
    assert over.shape[2] == 3
    assert np.abs(over / 255 - want).max() <= 1 / 255
    assert not over[7, :10].any()


def test_values_that_are_not_finite_have_a_colour(film):
    rgb = np.zeros((4, 5, 3), "f4")
    rgb[0, 0], rgb[1, 1], rgb[2, 2], rgb[3, 3] = np.nan, np.inf, -np.inf, 3e38
    shown = film.display().shown(rgb, film.space_of({}))
    assert np.isfinite(shown).all()
    assert shown[1, 1].min() > 0.9
    assert shown[2, 2].max() < 0.1


def test_a_large_picture_in_threads_is_the_same_to_the_bit(aces):
    rgb, shown, space = light(), aces.display(), aces.space("acescg")
    large = np.tile(rgb, (8, 8, 1))
    assert (shown.shown(large, space) == np.tile(shown.shown(rgb, space), (8, 8, 1))).all()


def test_a_look_replaces_the_views_own(film):
    rgb, space = light(), film.space("lin_rec709")
    plain, punchy = film.display(), film.display(look="Punchy")
    group = GroupTransform([
        LookTransform(src="lin_rec709", dst="lin_rec709", looks="Punchy"),
        DisplayViewTransform(src="lin_rec709", display="Screen", view="Film"),
    ])  # fmt: skip
    want = rgb.copy()
    film._config.getProcessor(group).getDefaultCPUProcessor().applyRGB(want)
    got = punchy.shown(rgb, space)
    assert np.abs(got - np.clip(want, 0, 1)).max() < 1e-4
    assert np.abs(got - plain.shown(rgb, space)).max() > 0.1
    assert punchy.settings["look"] == "Punchy"


# ---- what the input means -------------------------------------------------------------------


def test_primaries_lead_where_the_configs_own_spaces_do(aces):
    rgb = light()
    for primaries, name in (
        (REC709, "lin_rec709"), (AP1, "ACEScg"), (REC2020, "Linear Rec.2020"),
        (P3_D65, "Linear P3-D65"), (AP0, "ACES2065-1"),
    ):  # fmt: skip
        want = rgb.copy()
        processor = aces._config.getProcessor(name, "ACES2065-1")
        processor.getDefaultCPUProcessor().applyRGB(want)
        assert np.abs(rgb @ conversion(primaries, AP0).T - want).max() < 2e-6 * rgb.max()
        assert aces.chromaticities(aces.space(name)) == primaries


def test_chromaticities_come_back_from_a_matrix():
    odd = (0.7, 0.3, 0.2, 0.75, 0.1, 0.05, 0.31, 0.33)
    for primaries in (odd, REC709, AP1):
        matrix = conversion(primaries, AP0)
        assert np.allclose(conversion(of_matrix(matrix), AP0), matrix, rtol=0, atol=1e-6)
    assert of_matrix(conversion(AP1, AP0)) == AP1


def test_colours_as_they_are_measured_have_the_white_of_daylight():
    """As openexr-images/Chromaticities wants it: XYZ.exr looks like Rec709.exr."""
    x, y = REC709[6:]
    white = np.array([x / y, 1, (1 - x - y) / y])
    assert np.allclose(conversion(XYZ, REC709) @ white, 1, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "numbers",
    [(0.6, 0.3, 0.6, 0.3, 0.1, 0.1, 0.3, 0.3), (0.0,) * 8, (*REC709[:7], np.nan),
     (*REC709[:6], 0.3, 0.0)],
)  # fmt: skip
def test_numbers_that_are_no_primaries_are_named(aces, numbers):
    with pytest.raises(InputError, match="chromaticities must be") as error:
        aces.space_of({"chromaticities": numbers})
    assert f"{numbers[0]:g}, {numbers[1]:g}" in str(error.value)


def test_the_first_attribute_that_answers_says_the_space(aces):
    found = {"chromaticities": REC2020, "acesImageContainerFlag": 1, "colorspace": "lin_rec709",
             "oiio:ColorSpace": "ACES - ACEScg", "colorInteropID": "lin_p3d65_scene"}  # fmt: skip
    said = []
    while found:
        space = aces.space_of(found)
        said.append((space.why, space.name))
        del found[space.why]
    assert said == [
        ("colorInteropID", "Linear P3-D65"), ("oiio:ColorSpace", "ACEScg"),
        ("colorspace", "Linear Rec.709 (sRGB)"), ("acesImageContainerFlag", "ACES2065-1"),
        ("chromaticities", "ACES2065-1"),
    ]  # fmt: skip
    assert aces.space_of({}).why == "default"


@pytest.mark.parametrize("value", ["scene_linear", "nobody's space", "", "unknown", 7])
def test_roles_and_unknown_words_of_attributes_say_nothing(aces, value):
    assert aces.space_of({"oiio:ColorSpace": value}) == aces.space_of({})


def test_a_config_without_the_role_is_understood_by_names_that_tell(tmp_path):
    config = ColorConfig(film_config(tmp_path, name="scene", alias="ACES - ACEScg"))
    rgb = np.abs(light())
    shown = config.display("Screen", "Film")
    got = shown.shown(rgb, config.space_of({"chromaticities": AP1}))
    want = by_ocio(config._config, "scene", "Screen", "Film", rgb)
    assert np.abs(got - want).max() < 1e-4


def test_a_config_that_says_nothing_of_its_primaries_is_one_line(tmp_path):
    config = ColorConfig(film_config(tmp_path, name="scene", alias="ours"))
    with pytest.raises(
        InputError,
        match=r"neither the role aces_interchange.*`space` names their space",
    ):
        config.space_of({"chromaticities": AP1})
    assert config.space("ours").is_linear
    assert config.chromaticities(config.space("ours")) is None


def write(path: Path, rgb: np.ndarray, attributes: dict | None = None, kind="f4") -> Path:
    return make.write_exr(path, make.colors(rgb, kind=kind), attributes)


@pytest.mark.parametrize(("bits", "step"), [(8, 255), (16, 65535)])
def test_a_still_in_a_log_space_becomes_linear_light(tmp_path, aces, bits, step):
    codes = np.random.default_rng(5).integers(0, step + 1, (6, 7, 3)).astype(f"u{bits // 8}")
    path, space = tmp_path / "log.png", aces.space("ACEScct")
    path.write_bytes(stills._png(codes))
    want = (codes / np.float32(step)).astype("f4")
    processor = aces._config.getProcessor("ACEScct", "ACEScg")
    processor.getOptimizedCPUProcessor(OPTIMIZATION_LOSSLESS).applyRGB(want)
    source = Clip(path, space=space).source(1)
    assert np.allclose(source.rgba, want, rtol=1e-6)
    assert source.space == aces.scene_linear
    out = tmp_path / "o.exr"
    Output(out, numbers=[1]).write(source.rgba, source)
    written = exr.read(out)
    assert np.allclose(written.parts[0].attributes["chromaticities"], AP1)
    assert aces.space_of(written.parts[0].attributes).why == "chromaticities"


def test_a_log_exr_becomes_linear_light_and_says_so(tmp_path, aces):
    rgba = np.random.default_rng(6).uniform(0.1, 0.9, (6, 7, 4)).astype("f4")
    rgba[..., :3] *= rgba[..., 3:]
    said = {"oiio:ColorSpace": "ACEScct", "owner": "us", "acesImageContainerFlag": 1}
    path = write(tmp_path / "log.0001.exr", rgba, said)
    clip = Clip(path, space=aces.space("ACEScct"))
    source = clip.source(1)
    want = np.ascontiguousarray(rgba[..., :3] / rgba[..., 3:])
    processor = aces._config.getProcessor("ACEScct", "ACEScg")
    processor.getOptimizedCPUProcessor(OPTIMIZATION_LOSSLESS).applyRGB(want)
    assert np.allclose(source.rgba[..., :3], want * rgba[..., 3:], rtol=1e-5)
    out = tmp_path / "o.0001.exr"
    Output(out, numbers=[1]).write(source.rgba, source)
    written = exr.read(out).parts[0]
    assert np.allclose(written.attributes["chromaticities"], AP1)
    assert written.attributes["owner"] == "us"
    assert not {"oiio:ColorSpace", "acesImageContainerFlag"} & written.attributes.keys()
    assert np.allclose(written.channels["R"], source.rgba[..., 0])


def test_a_linear_exr_keeps_its_pixels_and_attributes(tmp_path, aces):
    rgb, said = light(), {"chromaticities": P3_D65, "oiio:ColorSpace": "lin_rec709"}
    path = write(tmp_path / "a.0001.exr", rgb, said)
    source = Clip(path, space=aces.space("acescg")).source(1)
    assert (source.rgba == rgb).all()
    assert source.part is not None
    assert source.part.attributes["oiio:ColorSpace"] == "lin_rec709"
    assert source.space == aces.space("ACEScg")


def test_a_still_without_a_space_is_srgb_as_ever(tmp_path, aces):
    codes = np.random.default_rng(5).integers(0, 256, (6, 7, 3)).astype("u1")
    path, out = tmp_path / "a.png", tmp_path / "o.png"
    path.write_bytes(stills._png(codes))
    source = Clip(path).source(1)
    assert np.allclose(source.rgba, linear(codes / np.float32(255)))
    Output(out, numbers=[1], display=aces.display(SRGB, "Un-tone-mapped")).write(
        source.rgba, source
    )
    assert np.abs(samples(out).astype(int) - codes).max() <= 1


def test_a_picture_that_says_it_is_not_linear_is_refused(tmp_path, aces):
    path = write(tmp_path / "a.0001.exr", light(), {"oiio:ColorSpace": "ACEScct"})
    source = Clip(path).source(1)
    with pytest.raises(InputError, match="not linear") as error:
        Output(tmp_path / "o.png", numbers=[1], display=aces.display()).write(light(), source)
    assert str(path) in str(error.value)
    assert "`space='ACEScct'` makes it linear" in str(error.value)


# ---- names, videos, what is missing ---------------------------------------------------------


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda c: c.space("acesgc"), r"colour space 'acesgc' .*available: .*ACEScct.*'acescg'"),
        (lambda c: c.display("sRGB Display"), r"display 'sRGB D.*available: sRGB - .*'sRGB - Disp"),
        (lambda c: c.display(None, "AgX"), r"view 'AgX' of display 'sRGB - .*: ACES 2.0 .*, Raw"),
        (lambda c: c.display(look="x"), r"look 'x' .*available: ACES 1.3 Reference Gamut Compr"),
        (lambda c: ColorConfig("ocio://none"), "ocio://none: Could not find 'none'"),
        (lambda c: ColorConfig("no/config.ocio"), "no/config.ocio: .* does not exist"),
        (lambda c: ColorConfig(__file__), "test_display.py: Error: Loading the OCIO profile"),
    ],
)
def test_names_that_are_unknown_are_one_line_with_those_there_are(aces, ask, said, capfd):
    with pytest.raises(InputError, match=said) as error:
        ask(aces)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def test_names_are_understood_in_small_letters_and_kept_as_the_config_has_them(aces):
    shown = aces.display("srgb - display", "un-TONE-mapped")
    assert (shown.display, shown.view) == (SRGB, "Un-tone-mapped")


def test_the_record_changes_with_the_contents_of_a_config(tmp_path):
    before = ColorConfig(film_config(tmp_path)).display().settings
    again = ColorConfig(tmp_path / "config.ocio").display().settings
    text = (tmp_path / "config.ocio").read_text()
    (tmp_path / "config.ocio").write_text(text.replace("slope: [1.3", "slope: [1.4"))
    after = ColorConfig(tmp_path / "config.ocio").display().settings
    assert before == again
    assert before != after
    assert before | {"ocio": None} == after | {"ocio": None}


def test_blenders_config_is_found_in_its_module(tmp_path, monkeypatch):
    folder = tmp_path / "bpy" / "4.5" / "datafiles" / "colormanagement"
    folder.mkdir(parents=True)
    (tmp_path / "bpy" / "__init__.py").write_text("raise RuntimeError('is not imported')")
    film_config(folder)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="neither the module bpy nor the program blender"):
        ColorConfig("blender")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert ColorConfig("blender").display().view == "Film"


def test_opencolorio_that_is_missing_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "PyOpenColorIO", None)
    with pytest.raises(InputError, match=re.escape(f"not installed: {install_command('ocio')}")):
        ColorConfig("builtin")


@pytest.mark.parametrize(
    ("display", "primaries", "transfer"),
    [(None, 1, 13), (SRGB, 1, 13), ("Display P3 - Display", 12, 13),
     ("Rec.2100-PQ - Display", 9, 16), ("Rec.1886 Rec.709 - Display", 1, 1),
     ("Display P3 HDR - Display", 2, 2)],
)  # fmt: skip
def test_videos_are_tagged_as_their_display(tmp_path, aces, display, primaries, transfer):
    path, rgb = tmp_path / "o.mp4", np.full((16, 16, 3), 0.3, "f4")
    shown = aces.display(display, "Un-tone-mapped") if display else None
    output = Output(path, numbers=[1], display=shown)
    output.write(rgb, RAW)
    output.close()
    with av.open(str(path)) as container:
        frame = next(container.decode(video=0))
    assert (frame.color_primaries, frame.color_trc) == (primaries, transfer)
    want = shown.of(aces.space_of({}))(rgb, 8) if shown else to_display(rgb, 8)
    assert np.abs(frame.to_ndarray(format="rgb24")[8, 8].astype(int) - want[8, 8]).max() <= 3


@pytest.mark.parametrize("change, said", [
    (lambda text: text.replace(b"Screen", b"Scr\xf7en"), "must be text in UTF-8, byte"),
    (lambda text: text.replace(b"scene_linear: lin_rec709", b"scene_linear: none"),
     "the role scene_linear of config.ocio names no colour space"),
    (lambda text: text.replace(b"Screen", b"\"\\xf7\""), "config.ocio"),
])  # fmt: skip
def test_a_config_that_is_damaged_behind_its_beginning_is_one_line(tmp_path, change, said):
    path = film_config(tmp_path)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(InputError, match=said) as error:
        config = ColorConfig(path)
        config.space("log").linear(np.ones((2, 2, 3), np.float32))
        config.display(view="Film").shown(np.ones((2, 2, 3)), config.space("lin_rec709"))
        raise InputError("config.ocio: read")
    assert "\n" not in str(error.value)
