"""The article's figures against time itself."""

import numpy as np
import pytest

import make_frames as make
import wgmb
from twins import figure as twin
from wgmb import InputError, Shutter
from wgmb.color.srgb import srgb
from wgmb.cone import VIDEOS
from wgmb.scene import builtin

SIZE = (96, 54)
WIDE = (96, 48)


def rendered(name, size, shutter=0, time=0.0, **settings):
    render = wgmb.Render(
        builtin.make(name, **settings), wgmb.Blur("volume", shutter=shutter), size=size, fps=60
    )
    return srgb(render(time)[..., :3])


SHUTTERS = [Shutter(360), Shutter(720, curve="cosine"), Shutter(540, "start", "trapezoid"),
            Shutter(720, curve=lambda x: x)]  # fmt: skip


@pytest.mark.covers(1)
@pytest.mark.parametrize("speed", [0.0, 20.0, 500.0])
@pytest.mark.parametrize("shutter", SHUTTERS)
def test_disk_is_the_mean_over_the_exposure(shutter, speed):
    x, y = twin.positions(*SIZE)
    times = shutter.time((np.arange(4000) + 0.5) / 4000) / 60
    share = twin.exposed(lambda t: twin.in_disk(x, y, 1 + speed * t), times)[..., None]
    want = twin.grid(x, y, *SIZE) * (1 - share) + twin.SOLID * share
    got = rendered("disk", SIZE, shutter, speed=speed)
    assert np.abs(got - want).max() < 2e-3


def test_a_closed_shutter_shows_the_disk_antialiased():
    got = rendered("disk", SIZE, 0, speed=20.0, time=0.1)
    x, y = twin.positions(*SIZE)
    there = twin.in_disk(x, y, 1 + 20 * 0.1)
    assert np.abs(got[there] - twin.SOLID).max() < 1e-3
    edge = (np.abs(got - twin.SOLID).max(-1) > 1e-3) & (got[..., 0] > 0.21)
    assert 4 < edge.sum() < 60


@pytest.mark.covers(1)
@pytest.mark.parametrize("slice_", [0.0, 0.08, 0.2])
@pytest.mark.parametrize("shutter", SHUTTERS)
def test_spiric_is_the_mean_over_the_exposure(shutter, slice_):
    x, y = twin.positions(*SIZE)
    times = shutter.time((np.arange(4000) + 0.5) / 4000) / 60
    share = twin.exposed(lambda t: twin.in_section(x, y, 60 * t, 0.18, 0.32, slice_), times)
    got = rendered("spiric", SIZE, shutter, slice=slice_)
    assert np.abs(got - share[..., None]).max() < 2e-3


def seen_apart(got, want, shown):
    """Differences over the right panel, but for the bar and the dashes at `shown`."""
    x, y = twin.positions(*WIDE)
    x = x - 0.5
    ring = np.hypot(x - 0.2 * np.cos(np.pi - shown), y - 0.2 * np.sin(np.pi - shown)) - 0.1
    clean = (x > -0.4) & (np.abs(ring) * WIDE[1] > 2.1)
    assert clean.mean() > 0.4
    return np.abs(got - want[..., None] * twin.SOLID)[clean]


@pytest.mark.parametrize("speed", [0.0, 15.0, 80.0])
def test_natural_cone_is_the_past_weighted(speed):
    x, y = twin.positions(*WIDE)
    want = twin.perceived(lambda age: twin.in_disk(x - 0.5, y, speed * (0.07 - age)))
    assert seen_apart(cone("natural", speed, 0.07), want, speed * 0.07).max() < 3e-3


def cone(video, speed, time):
    render = wgmb.Render(
        builtin.make("cone", video=video, time=time, speed=speed), wgmb.Blur("volume"), size=WIDE
    )
    return srgb(render(0.0)[..., :3])


@pytest.mark.parametrize("video", ["none", "box", "trapezoid", "cosine"])
def test_screen_cone_is_the_sum_of_ten_frames(video):
    """Each frame counts from its own instant on, as in the article."""
    speed, now = 20.0, 0.07
    times = VIDEOS[video].time((np.arange(1000) + 0.5) / 1000) / 60
    x, y = twin.positions(*WIDE)
    x, total = x - 0.5, np.zeros(x.shape)
    for k in range(4, -6, -1):
        ages = now - k / 60 + np.linspace(0, 1 / 60, 2001)
        weight = np.trapezoid(twin.response(ages), ages)
        if video == "none":
            total += weight * twin.antialiased(x, y, speed * k / 60, WIDE[1])
        else:
            total += weight * twin.exposed(
                lambda t, k=k: twin.in_disk(x, y, speed * (k / 60 + t)), times
            )
    apart = seen_apart(cone(video, speed, now), total, speed * 4 / 60)
    assert apart.max() < 3e-3


@pytest.mark.parametrize(
    "arguments",
    ["disk --set speed=-1", "disk --set speed=nan", "disk --set speed=1e9", "cone --set video=film",
     "spiric --set minor_radius=-0.1", "spiric --set minor_radius=0.4", "disk --method tap",
     "spiric --set slice=inf", "disk --rolling up"],
)  # fmt: skip
def test_senseless_settings_are_one_line(capsys, tmp_path, arguments):
    code, out, err = make.inside(
        capsys, "render", *arguments.split(), "-o", tmp_path / "x.png", "--size", "32x18"
    )
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert not (tmp_path / "x.png").exists()


def test_a_figure_needs_its_method():
    with pytest.raises(InputError, match="flat"):
        wgmb.Render(builtin.make("disk"), wgmb.Blur("distributed"), size=(8, 8))(0.0)
