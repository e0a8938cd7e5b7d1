"""Judges are judged: what every measure must see, and by how much."""

import numpy as np
import pytest

from wgmb import metrics
from wgmb.errors import InputError
from wgmb.metrics import METRICS

pytestmark = pytest.mark.fast

ALL = pytest.mark.parametrize("name", METRICS)
SAME = {name: np.inf if "psnr" in name else 1.0 if name == "ssim" else 0.0 for name in METRICS}


@pytest.fixture(scope="module")
def picture():
    """A bright disc and soft stripes with detail, 64 x 48, linear."""
    y, x = np.mgrid[:48, :64].astype(np.float32)
    stripes = 0.25 + 0.15 * np.sin(x / 3 + y / 7)
    disc = ((x - 20.3) ** 2 + (y - 22.6) ** 2 < 81) * 0.5
    detail = np.random.default_rng(3).random((48, 64)) * 0.05
    plane = (stripes + disc + detail).astype(np.float32)
    return np.dstack([plane, 0.8 * plane, 0.6 * plane])


def worse(name: str, got: float) -> float:
    """Distance from perfect, 0 and up; for PSNR the error itself."""
    if "psnr" in name:
        return 10 ** (-got / 20)
    return abs(got - SAME[name])


def metric(name, picture, truth):
    return METRICS[name].compute(picture, truth)


@ALL
def test_the_same_picture_is_perfect(name, picture):
    assert metric(name, picture, picture.copy()) == pytest.approx(SAME[name], abs=1e-6)


@ALL
@pytest.mark.parametrize("axis", [0, 1])
def test_a_shift_of_one_pixel_is_seen(name, picture, axis):
    shifted = np.roll(picture, 1, axis=axis)
    assert worse(name, metric(name, shifted, picture)) > 0.01


@ALL
def test_a_larger_shift_is_worse(name, picture):
    errors = [worse(name, metric(name, np.roll(picture, s, axis=1), picture)) for s in (1, 2, 4)]
    assert errors == sorted(errors)


@ALL
def test_a_constant_offset_is_seen(name, picture):
    errors = [worse(name, metric(name, picture + offset, picture)) for offset in (0.02, 0.1)]
    assert 0.002 < errors[0] < errors[1]


@pytest.mark.parametrize("name", ["energy", "edges"])
def test_swapped_arguments_are_another_question(name, picture):
    dim = 0.5 * picture
    assert metric(name, dim, picture) < 0.75 * metric(name, picture, dim)


@pytest.mark.parametrize("name", sorted(METRICS.keys() - {"energy", "edges"}))
def test_the_others_do_not_care_which_is_the_truth(name, picture):
    other = np.roll(picture, 1, axis=1) + 0.02
    assert metric(name, other, picture) == pytest.approx(metric(name, picture, other), rel=1e-4)


@ALL
def test_other_sizes_are_refused(name, picture):
    with pytest.raises(InputError, match="64 x 47, the truth 64 x 48"):
        metric(name, picture[:47], picture)
    with pytest.raises(InputError, match="picture must be"):
        metric(name, picture[..., 0], picture)


@ALL
def test_alpha_and_bad_pixels_do_not_spoil_a_judge(name, picture):
    four = np.dstack([picture, np.full(picture.shape[:2], 0.3, np.float32)])
    assert metric(name, four, picture) == pytest.approx(SAME[name], abs=1e-6)
    bad = picture.copy()
    bad[5, 6] = np.nan, np.inf, -np.inf
    assert np.isfinite(metric(name, bad, picture))


def test_psnr_of_a_known_error():
    truth = np.full((12, 12, 3), 0.5)
    assert metrics.psnr_linear(truth + 0.1, truth) == pytest.approx(20)
    encoded = metrics.display(truth + 0.1)[0, 0, 0] - metrics.display(truth)[0, 0, 0]
    assert metrics.psnr(truth + 0.1, truth) == pytest.approx(-20 * np.log10(encoded), abs=1e-3)


def test_display_is_srgb():
    known = {0.0: 0, 0.0031308: 0.04045, 0.214041: 0.5, 0.5: 0.735357, 1.0: 1.0, 7.0: 1.0}
    light = np.array(list(known), np.float64).reshape(1, -1, 1).repeat(3, axis=2)
    np.testing.assert_allclose(
        metrics.display(light)[0, :, 0], list(known.values()), rtol=0, atol=2e-6
    )


def test_ssim_against_its_definition(picture):
    """Every window by itself, as the paper writes it."""
    other = np.roll(picture, 2, axis=1) + 0.03
    a, b = (metrics.display(p).astype("f8")[:15, :17] for p in (other, picture))
    x = np.arange(-5, 6)
    weights = np.exp(-(x[:, None] ** 2 + x**2) / (2 * 1.5**2))
    weights /= weights.sum()
    found = []
    for top in range(5):
        for left in range(7):
            for c in range(3):
                p, q = (s[top : top + 11, left : left + 11, c] for s in (a, b))
                mp, mq = (weights * p).sum(), (weights * q).sum()
                vp, vq = (weights * (p - mp) ** 2).sum(), (weights * (q - mq) ** 2).sum()
                cov = (weights * (p - mp) * (q - mq)).sum()
                top_part = (2 * mp * mq + 1e-4) * (2 * cov + 9e-4)
                found.append(top_part / ((mp**2 + mq**2 + 1e-4) * (vp + vq + 9e-4)))
    got = metrics.ssim(other[:15, :17], picture[:15, :17])
    assert got == pytest.approx(np.mean(found), abs=1e-6)


def test_energy_is_the_share_of_light_too_much(picture):
    assert metrics.energy_error(1.06 * picture, picture) == pytest.approx(0.06, rel=1e-5)
    assert metrics.energy_error(0 * picture, picture) == pytest.approx(1.0)
    assert metrics.energy_error(picture, 0 * picture) == np.inf


def test_energy_sees_highlights_beyond_white(picture):
    bright = picture.copy()
    bright[10, 10] = 50.0
    assert metrics.energy_error(picture, bright) > 0.05


def test_energy_forgives_noise_more_than_moved_light(picture):
    noise = np.random.default_rng(5).normal(0, 0.05, picture.shape)
    moved = np.roll(picture, 8, axis=1)
    assert 4 * metrics.energy_error(picture + noise, picture) < metrics.energy_error(moved, picture)


def test_a_picture_without_edges_has_edge_error_1(picture):
    assert metrics.edge_error(np.full_like(picture, 0.3), picture) == pytest.approx(1.0)


def test_flip_colors_are_dark_where_alike_and_bright_where_not(picture):
    other = picture.copy()
    other[20:30, 30:40] = 1.0
    colors = metrics.flip_colors(other, picture)
    assert colors.shape == picture.shape
    assert colors[:8, :8].max() < 0.1
    assert colors[25, 35].max() > 0.5


def test_measure_asks_every_judge(picture):
    found = metrics.measure(picture + 0.01, picture)
    assert list(found) == list(METRICS)
    assert all(np.isfinite(v) for v in found.values())
