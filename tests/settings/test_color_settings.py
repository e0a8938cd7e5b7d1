"""Colours from the command line: options, $OCIO, records; and nothing changes without them."""

import sys

import numpy as np
import pytest

import make_frames as make
from make_config import film_config, samples
from wgmb.color.primaries import AP1
from wgmb.color.spaces import ColorConfig
from wgmb.color.srgb import to_display
from wgmb.extras import install_command
from wgmb.io import exr, record


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, 4))


@pytest.fixture
def no_wheel(monkeypatch):
    monkeypatch.setitem(sys.modules, "PyOpenColorIO", None)


def run(capsys, shot, folder, *options, suffix="png"):
    output = folder / f"o.####.{suffix}"
    return make.inside(capsys, "blur", shot, "-o", output, "--method", "tap", *options)


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.glob("o.*")}


def one_line(said: tuple[int, str, str]) -> str:
    code, out, err = said
    assert (code, out) == (2, "")
    assert err.startswith("wgmb: ")
    assert err.count("\n") == 1
    return err


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif", "exr", "mp4"])
def test_without_options_files_are_the_same_to_the_bit_with_and_without_the_wheel(
    tmp_path, capsys, monkeypatch, shot, suffix
):
    folders = [tmp_path / name for name in ("with", "off", "without")]
    assert run(capsys, shot, folders[0], suffix=suffix)[0] == 0
    assert run(capsys, shot, folders[1], "--ocio", "off", suffix=suffix)[0] == 0
    monkeypatch.setitem(sys.modules, "PyOpenColorIO", None)
    assert run(capsys, shot, folders[2], suffix=suffix)[0] == 0
    files = [contents(folder) for folder in folders]
    assert files[0] == files[1] == files[2]
    if suffix != "mp4":
        said = record.read(files[0][f"o.0002.{suffix}"])
        assert said and not said.keys() & {"ocio", "display", "from", "from_", "look"}


def test_without_options_a_picture_is_shown_as_srgb(tmp_path, capsys, shot):
    run(capsys, shot, tmp_path)
    run(capsys, shot, tmp_path, suffix="exr")
    channels = exr.read(tmp_path / "o.0002.exr").channels()
    rgba = np.stack([channels[f"ViewLayer.Combined.{c}"] for c in "RGBA"], axis=2)
    got = samples(tmp_path / "o.0002.png").astype(int)
    assert np.abs(got - to_display(rgba, 8)).max() <= 1  # of half floats


def test_an_exr_that_says_ap1_looks_as_with_from_acescg(tmp_path, capsys):
    channels = make.frame(1, "plain")
    for folder, attributes in (("said", {"chromaticities": AP1}), ("plain", {})):
        (tmp_path / folder).mkdir()
        make.write_exr(tmp_path / folder / "a.0001.exr", channels, attributes)
    pictures = {}
    for folder, options in (("said", []), ("plain", ["--from", "acescg"]), ("plain", [])):
        out = tmp_path / f"{folder}{len(options)}"
        code, *_ = run(capsys, tmp_path / folder / "a.0001.exr", out, "--ocio", "builtin", *options)
        assert code == 0
        pictures[folder, len(options)] = samples(out / "o.0001.png").astype(int)
    said, told, neither = pictures.values()
    assert np.abs(said - told).max() <= 1
    assert np.abs(said - neither).max() > 8


def test_blur_stays_in_linear_light(tmp_path, capsys):
    """A log picture: the mean of what it stands for, not of its codes."""
    config = ColorConfig("builtin")
    codes = np.tile(np.repeat(np.float32([0.2, 0.7]), 8), (16, 4))
    channels = dict.fromkeys("RGB", codes) | {"to_next.x": np.full_like(codes, 16)}
    channels |= {
        "to_next.y": 0 * codes,
        "to_prev.x": -channels["to_next.x"],
        "to_prev.y": 0 * codes,
    }
    make.write_exr(tmp_path / "log.0001.exr", channels)
    code, *_ = run(capsys, tmp_path / "log.0001.exr", tmp_path, "--ocio", "builtin", "--from",
                   "acescct", "--shutter", "360", "--samples", "64", suffix="exr")  # fmt: skip
    assert code == 0
    found = exr.read(tmp_path / "o.0001.exr").parts[0]
    want = config.space("acescct").linear(np.dstack([codes] * 3)).mean()
    assert np.abs(found.channels["R"][:, 16:-16] / want - 1).max() < 0.03
    assert np.allclose(found.attributes["chromaticities"], AP1)
    said = record.read((tmp_path / "o.0001.exr").read_bytes())
    assert said and (said["from"], said["working_space"]) == ("ACEScct", "ACEScg")


def test_resume_does_those_again_that_are_to_look_different(tmp_path, capsys, shot):
    film = film_config(tmp_path)
    base = ["--ocio", film, "--resume"]
    looks = [[], ["--view-transform", "Log"], ["--look", "Punchy"], ["--from", "log"]]
    for more in looks:
        assert "already done" not in run(capsys, shot, tmp_path, *base, *more)[2]
        assert "3 already done" in run(capsys, shot, tmp_path, *base, *more)[2]
    said = record.read((tmp_path / "o.0002.png").read_bytes())
    assert said and said["ocio"].startswith("config.ocio (")
    assert (said["display"], said["view_transform"], said["from"]) == ("Screen", "Film", "log")
    film.write_text(film.read_text().replace("slope: [1.3", "slope: [1.4"))
    assert "already done" not in run(capsys, shot, tmp_path, *base, "--from", "log")[2]


def test_resume_of_exr_output_does_not_ask_how_others_would_look(tmp_path, capsys, shot):
    film = film_config(tmp_path)
    run(capsys, shot, tmp_path, "--ocio", film, suffix="exr")
    said = run(capsys, shot, tmp_path, "--resume", suffix="exr")[2]
    assert "3 already done" in said


def test_the_environment_names_the_config(tmp_path, capsys, monkeypatch, shot):
    film, folders = film_config(tmp_path), [tmp_path / str(i) for i in range(3)]
    run(capsys, shot, folders[0], "--ocio", film)
    monkeypatch.setenv("OCIO", str(film))
    run(capsys, shot, folders[1])
    run(capsys, shot, folders[2], "--ocio", "off")
    named, set_, off = (contents(folder) for folder in folders)
    assert named == set_ != off
    monkeypatch.setenv("OCIO", str(tmp_path / "gone.ocio"))
    assert run(capsys, shot, tmp_path / "exr", suffix="exr")[0] == 0  # needs none
    said = one_line(run(capsys, shot, tmp_path / "3"))
    assert said.startswith("wgmb: $OCIO: ")
    assert "gone.ocio" in said
    assert "--ocio off" in said


def test_an_environment_that_cannot_be_followed_is_one_line(
    tmp_path, capsys, monkeypatch, shot, no_wheel
):
    assert run(capsys, shot, tmp_path / "plain")[0] == 0
    monkeypatch.setenv("OCIO", str(film_config(tmp_path)))
    code, _, err = run(capsys, shot, tmp_path / "set")
    assert code == 0
    first, last = err.splitlines()
    assert first.startswith("$OCIO is ignored")
    assert install_command("ocio") in first
    assert last.startswith("3 frames in ")
    assert contents(tmp_path / "plain") == contents(tmp_path / "set")
    assert run(capsys, shot, tmp_path / "quiet", "-q")[2] == ""


def test_an_option_that_needs_the_wheel_is_one_line(tmp_path, capsys, monkeypatch, shot, no_wheel):
    said = one_line(run(capsys, shot, tmp_path, "--ocio", "builtin"))
    assert install_command("ocio") in said
    monkeypatch.setenv("OCIO", "x.ocio")
    assert install_command("ocio") in one_line(run(capsys, shot, tmp_path, "--display", "sRGB"))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--display sRGB", "--display needs an OpenColorIO config: --ocio may be builtin, studio"),
        ("--view-transform AgX", "--view-transform needs an OpenColorIO config"),
        ("--look Punchy", "--look needs an OpenColorIO config"),
        ("--from acescg", "--from needs an OpenColorIO config"),
        ("--ocio off --from acescg", "--from needs an OpenColorIO config"),
        ("--ocio builtin --display TV", "unknown display 'TV' in cg-config"),
        ("--ocio builtin --view-transform AgX", "unknown view 'AgX' of display 'sRGB - Display'"),
        ("--ocio builtin --look Punchy", "unknown look 'Punchy'"),
        ("--ocio builtin --from acesgc", "unknown colour space 'acesgc'"),
        ("--ocio nowhere.ocio", "nowhere.ocio"),
        ("--ocio ocio://none", "'none'"),
    ],
)
def test_wrong_names_are_one_line_and_leave_nothing(tmp_path, capsys, shot, options, said):
    out = tmp_path / "out"
    assert said in one_line(run(capsys, shot, out, *options.split()))
    assert not out.exists()


def test_scenes_are_shown_too(tmp_path, capsys):
    film = film_config(tmp_path)
    words = ["render", "fence", "--size", "64x36", "--method", "tap", "-o"]
    assert make.inside(capsys, *words, tmp_path / "o.exr")[0] == 0
    assert make.inside(capsys, *words, tmp_path / "o.png", "--ocio", film)[0] == 0
    channels = exr.read(tmp_path / "o.exr").channels()
    rgba = np.stack([channels[c] for c in "RGBA"[: len(channels)]], axis=2).astype("f4")
    shown = ColorConfig(film).display()
    want = shown.of(shown.config.space_of({}))(rgba, 8)
    assert np.abs(samples(tmp_path / "o.png").astype(int) - want).max() <= 1  # of half floats


def test_settings_files_hold_the_options(tmp_path, capsys, shot):
    film = film_config(tmp_path)
    text = f'[blur]\nocio = "{film}"\nview_transform = "Log"\nlook = "Punchy"\nfrom = "log"\n'
    (tmp_path / "s.toml").write_text(text)
    words = ["--view-transform", "Log", "--look", "Punchy", "--from", "log"]
    assert run(capsys, shot, tmp_path / "a", "--ocio", film, *words)[0] == 0
    assert run(capsys, shot, tmp_path / "b", "--config", tmp_path / "s.toml")[0] == 0
    assert contents(tmp_path / "a") == contents(tmp_path / "b")
