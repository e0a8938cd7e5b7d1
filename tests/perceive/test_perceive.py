"""Perception by cone cells: against time itself, the article's claim, the command."""

import numpy as np
import pytest
from PIL import Image

import make_frames as make
from twins import perceive as twin
from wgmb import InputError, Shutter
from wgmb.cone import VIDEOS, Cone
from wgmb.io import stills
from wgmb.observer import Observer
from wgmb.perceive.shutter_study import best_shutter, compare, difference

# Mean differences to perceived nature at 20, 40, 60, 80 rad/s and 60 frames a second.
TABLE = {
    "none": (0.0215, 0.0430, 0.0459, 0.0748),
    "box": (0.0044, 0.0065, 0.0073, 0.0090),
    "trapezoid": (0.0048, 0.0066, 0.0072, 0.0077),
    "cosine": (0.0054, 0.0072, 0.0076, 0.0076),
}


def pictures(count, channels=4, size=(20, 33)):
    return np.random.default_rng(1).random((count, *size, channels)).astype("f4")


@pytest.mark.parametrize("rate, count", [(24, 1), (24, 5), (60, 3), (60, 40), (250, 150)])
@pytest.mark.parametrize("cone", [Cone(), Cone(120, 0.02), Cone(30, 0.1)])
def test_a_viewer_is_its_twin(device, cone, rate, count):
    observer, shown = Observer(rate, cone, device=device), pictures(count)
    for picture in shown:
        observer.present(picture)
    for after in (0.0, 0.4 / rate):
        want = twin.perceived(shown, rate, after, cone.rate, cone.peak)
        np.testing.assert_allclose(observer.perceived(after), want, atol=1e-3)  # stored as f16


def test_what_does_not_change_is_seen_as_it_is(device):
    observer, picture = Observer(60, device=device), pictures(1, 3)[0]
    for _ in range(30):
        observer.present(picture)
    np.testing.assert_allclose(observer.perceived()[..., :3], picture, atol=1e-3)


def test_a_bad_pixel_leaves_its_neighbours_alone(device):
    observer, picture = Observer(60, device=device), pictures(1)[0]
    picture[3, 4] = np.nan
    observer.present(picture)
    seen = observer.perceived()
    assert not seen[3, 4].any()
    picture[3, 4] = 0
    np.testing.assert_allclose(seen, picture, atol=1e-3)


@pytest.mark.parametrize("cone", [Cone(), Cone(120, 0.02)])
def test_a_flash_is_strongest_at_the_peak_and_all_of_it_is_seen_once(cone):
    ages = np.linspace(-0.1, 1, 110_001)
    weights = cone.weights(ages, 1e-5)
    assert ages[weights.argmax()] == pytest.approx(cone.peak, abs=1e-4)
    assert weights.sum() == pytest.approx(1, abs=1e-6)
    assert cone.step_response(cone.memory) == pytest.approx(1, abs=1.1e-4)
    np.testing.assert_allclose(cone.impulse_response(ages), weights / 1e-5, atol=1e-3 * cone.rate)


def test_the_shutter_of_an_eye_is_its_answer_to_the_past():
    cone, fps = Cone(), 24.0
    shutter = cone.shutter(fps)
    assert shutter.span == pytest.approx((-cone.memory * fps, 0))
    ages = np.linspace(0.001, 0.2, 300)
    want = cone.impulse_response(ages) / fps  # per frame interval
    np.testing.assert_allclose(shutter.weight(-ages * fps), want, atol=5e-3 * want.max())


@pytest.mark.parametrize("name", TABLE)
def test_the_table_is_reproduced_within_5_percent(name):
    found = [difference(VIDEOS[name], speed, 60) for speed in (20, 40, 60, 80)]
    np.testing.assert_allclose(found, TABLE[name], rtol=0.05)


def test_overlapping_windows_win_once_the_disk_moves_its_own_width_a_frame():
    for fps in (30, 60, 120):
        slow, fast = (compare(fps, np.array([fps * widths])) for widths in (1 / 3, 1.5))
        assert slow["box"] < slow["cosine"] < slow["none"]
        assert fast["cosine"] < fast["box"] < fast["none"]
    assert best_shutter(20, 60)[0] == "box"
    assert best_shutter(100, 60)[0] == "cosine"


@pytest.mark.parametrize(
    "make_it, word",
    [
        (lambda: Cone(rate=0), "rate"),
        (lambda: Cone(rate=np.nan), "rate"),
        (lambda: Cone(peak=-1), "peak"),
        (lambda: Observer(0), "rate"),
        (lambda: Observer(1e6), "too many"),
        (lambda: Observer(60).perceived(), "shown"),
        (lambda: Observer(60).present(np.zeros((4, 4))), "picture"),
        (lambda: difference(Shutter(0), -1, 60), "speed"),
        (lambda: difference(Shutter(0), 1, np.nan), "fps"),
    ],
)
def test_senseless_values_are_named(make_it, word):
    with pytest.raises(InputError, match=word):
        make_it()


def test_pictures_of_two_sizes_are_refused(device):
    observer = Observer(60, device=device)
    observer.present(np.zeros((4, 4, 3), "f4"))
    with pytest.raises(InputError, match="5 x 4"):
        observer.present(np.zeros((4, 5, 3), "f4"))


def test_a_sequence_is_perceived_frame_by_frame(tmp_path, capsys):
    shown = [p[..., :3] for p in pictures(4)]
    for i, picture in enumerate(shown):
        Image.fromarray((255 * picture).astype("u1")).save(tmp_path / f"a.{i:04d}.png")
    code, out, err = make.inside(capsys, "perceive", tmp_path / "a.####.png", "-o",
                                 tmp_path / "s.####.exr", "--fps", 60)  # fmt: skip
    assert (code, out, err.count("\n")) == (0, "", 1)
    read = [stills.read(tmp_path / f"a.{i:04d}.png") for i in range(4)]
    got = make.plain_read(tmp_path / "s.0003.exr")
    np.testing.assert_allclose(got["G"], twin.perceived(read, 60, 0)[..., 1], atol=2e-3)


def test_a_scene_is_seen_without_frames(tmp_path, capsys):
    """Nature, and the video of it at the same high rate, are seen alike."""
    size = ("--size", "64x36")
    make.inside(capsys, "perceive", "disk", "--frames", 3, "--fps", 60, "--set", "speed=30",
                "-o", tmp_path / "nature.exr", "--nature", 240, *size)  # fmt: skip
    for i in range(13):
        make.inside(capsys, "render", "disk", "--time", i / 240, "--shutter", 0, "--set",
                    "speed=30", "-o", tmp_path / f"v.{i + 100}.exr", *size)  # fmt: skip
    make.inside(capsys, "perceive", tmp_path / "v.###.exr", "--fps", 240,
                "-o", tmp_path / "seen.###.exr")  # fmt: skip
    nature = make.plain_read(tmp_path / "nature.exr")["G"]
    seen = make.plain_read(tmp_path / "seen.112.exr")["G"]
    there = seen > 0.05
    assert there.sum() > 20
    assert np.abs(nature - seen).mean() < 0.03  # before its first frame the video stood still


@pytest.mark.full
def test_the_report_is_drawn_and_recommends(tmp_path, capsys):
    code, out, err = make.inside(capsys, "perceive", "--report", "-o", tmp_path / "r.svg",
                                 "--fps", 60, "--speed", 100)  # fmt: skip
    assert (code, err) == (0, "")
    assert "--curve cosine --shutter 720" in out
    text = (tmp_path / "r.svg").read_text()
    assert text.startswith("<svg")
    assert all(f">{name}<" in text for name in VIDEOS)


@pytest.mark.parametrize(
    "arguments",
    ["", "no.png", "disk --report", "disk --speed 3", "disk --resume", "disk --set speed=x",
     "disk --cone-rate nan", "disk --cone-peak -1", "disk --nature 1e9", "--report --speed -1",
     "--report", "disk --frames x"],
)  # fmt: skip
def test_wrong_usage_is_one_line(tmp_path, capsys, arguments):
    code, _, err = make.inside(capsys, "perceive", *arguments.split(), "-o", tmp_path / "x.png")
    assert (code, err.count("\n")) == (2, 1)
    assert not (tmp_path / "x.png").exists()
