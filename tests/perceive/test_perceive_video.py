"""`wgmb perceive` of videos: pictures are held for their own times."""

from fractions import Fraction

import numpy as np
import pytest

import make_clips as clips
import make_frames as make
from twins import perceive as twin
from wgmb import InputError, gpu
from wgmb.cli import app
from wgmb.color.srgb import linear, srgb
from wgmb.cone import Cone
from wgmb.observer import Observer
from wgmb.video.read.reader import VideoReader

VALUES = [16, 235, 60, 200, 90, 150, 30, 220, 120, 40]
UNEVEN = [Fraction(n, 100) for n in (0, 1, 2, 5, 6, 11, 12, 14, 15, 19)]


def write(path, times):
    chroma = np.full((24, 32), 128, np.uint8)
    frames = [clips.frame([np.full((48, 64), v, "u1"), chroma, chroma], "yuv420p") for v in VALUES]
    return clips.write(path, frames, times, tone=0.2, codec="ffv1")


def seen_by_time(times, at, last):
    """Light seen at each instant `at` [s], by time itself in steps of 0.02 ms."""
    step = 2e-5
    light = linear((np.array(VALUES) - 16) / np.float32(219))
    ages = np.arange(-0.05, 1.0, step) + step / 2
    found = []
    for index, now in enumerate(at):
        shown = np.clip(np.searchsorted(times, now - ages, side="right") - 1, 0, index)
        found.append((twin.response(ages, 50.0, 0.05) * light[shown]).sum() * step)
    return np.array(found)


@pytest.mark.parametrize("even", [True, False], ids=["steady", "variable"])
def test_every_picture_counts_for_as_long_as_it_is_shown(tmp_path, capsys, even):
    times = [Fraction(n, 48) for n in range(10)] if even else UNEVEN
    source, out = write(tmp_path / "a.mkv", times), tmp_path / "b.mkv"
    assert app.main(["perceive", str(source), "-o", str(out), "-q"]) == 0, capsys.readouterr().err
    reader, got = VideoReader(source), VideoReader(out)
    shown = np.array([float(t) for t in reader.times])
    assert [round(1000 * float(t - got.times[0])) for t in got.times] == [
        round(1000 * t) for t in shown - shown[0]
    ]
    ends = np.append(shown[1:], shown[-1] + 1 / float(reader.rate))
    light = seen_by_time(shown, (shown + ends) / 2, ends[-1])
    want = 16 + 219 * srgb(light.astype("f4"))
    for value, (_, picture) in zip(want, got, strict=True):
        assert abs(picture.planes[0].astype(float) - value).max() < 2.5  # x264 at its default
    assert {s.kind for s in got.streams} == {"audio"}


def test_frames_held_alike_are_seen_as_at_a_rate():
    pictures = np.random.default_rng(2).random((9, 12, 20, 3)).astype("f4")
    device = gpu.open_device()
    one, other = Observer(30, device=device), Observer(30, device=device)
    for picture in pictures:
        one.present(picture)
        other.present(picture, 1 / 30)
    np.testing.assert_allclose(one.perceived(), other.perceived(), atol=1e-6)
    np.testing.assert_array_equal(one.cone.shares(9, 30), Cone().shares(9, 30))
    with pytest.raises(InputError, match="held must be over 0"):
        one.present(pictures[0], 0.0)


def test_shares_of_any_times_add_up_to_1():
    held = np.random.default_rng(3).uniform(0.001, 0.3, 40)
    for after in (0.0, 0.01):
        shares = Cone().shares_held(held, after)
        assert shares.sum() == pytest.approx(1) and (shares >= 0).all()


def test_it_becomes_pictures_too_and_a_part_is_taken(tmp_path, capsys):
    source = write(tmp_path / "a.mkv", UNEVEN)
    words = ["perceive", str(source), "-o", str(tmp_path / "b.##.png"), "--frames", "3-6", "-q"]
    assert app.main(words) == 0, capsys.readouterr().err
    assert make.names_in(tmp_path) == ["a.mkv", *(f"b.{n:02d}.png" for n in (1, 2, 3, 4))]
    assert app.main([*words[:4], "--fps", "24"]) == 2
    assert "--fps is for frames" in capsys.readouterr().err
    assert app.main([*words[:4], "--layer", "a"]) == 2
    assert "--layer is for rendered frames" in capsys.readouterr().err
