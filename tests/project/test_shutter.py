"""Laws of every shutter, and the curve files that people write."""

import itertools

import numpy as np
import pytest

import make_frames as make
from wgmb import InputError, Shutter
from wgmb.shutter import CURVES, OVERLAPS, read_curve

pytestmark = pytest.mark.fast

DEGREES = (1.0, 90.0, 180.0, 360.0, 540.0, 720.0, 1500.0)


def weight(shutter: Shutter, times: np.ndarray) -> np.ndarray:
    """Weight per frame interval, from the curve alone."""
    opens, closes = shutter.span
    x = np.clip((times - opens) / (closes - opens), 0, 1)
    inside = (times > opens) & (times < closes)
    curve = CURVES[shutter.curve]
    fine = np.linspace(0, 1, 20001)
    area = np.trapezoid(curve(fine), fine) * (closes - opens)
    return np.where(inside, curve(x), 0) / area


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("degrees", DEGREES)
@pytest.mark.parametrize("phase", ["start", "centre", "end", 0.3])
def test_strata_are_equal_shares_of_the_exposure(curve, degrees, phase):
    shutter = Shutter(degrees, phase, curve)
    opens, closes = shutter.span
    assert closes - opens == pytest.approx(degrees / 360)
    strata = shutter.strata(16).astype(float)
    assert (strata[:, 2] - strata[:, 0]).sum() == pytest.approx(closes - opens, rel=1e-5)
    assert (np.diff(strata.ravel()) >= 0).all()
    edges = np.append(strata[:, 0], strata[-1, 2])
    for begin, end in itertools.pairwise(edges):
        t = np.linspace(begin, end, 2001)
        assert np.trapezoid(weight(shutter, t), t) == pytest.approx(1 / 16, abs=1e-3)


@pytest.mark.parametrize(
    "phase, span",
    [("start", (0, 0.5)), ("centre", (-0.25, 0.25)), ("end", (-0.5, 0)), (1.0, (0.75, 1.25))],
)
def test_phase_says_when_a_shutter_opens(phase, span):
    assert Shutter(180, phase).span == pytest.approx(span)


@pytest.mark.parametrize("curve", OVERLAPS)
def test_windows_of_neighbouring_frames_add_up_to_one(curve):
    shutter = Shutter(OVERLAPS[curve], curve=curve)
    t = np.linspace(0.001, 0.999, 500)
    total = sum(weight(shutter, t - n) for n in range(-3, 5))
    np.testing.assert_allclose(total, 1, atol=1e-3)
    np.testing.assert_allclose(shutter.overlap(t), 1, atol=1e-3)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("degrees", [90.0, 360.0, 720.0])
@pytest.mark.parametrize("phase", ["start", "centre", 0.3])
def test_weights_are_those_of_the_curve(curve, degrees, phase):
    shutter = Shutter(degrees, phase, curve)
    t = np.linspace(-2, 3, 2000)
    np.testing.assert_allclose(shutter.weight(t), weight(shutter, t), atol=0.01)


def test_a_closed_shutter_has_no_weights():
    with pytest.raises(InputError, match="0 degrees"):
        Shutter(0).weight(np.zeros(1))


@pytest.mark.parametrize("options, says", [
    (["--curve", "cosine"], "cosine, 720 degrees: all frames' windows add up to 1"),
    (["--curve", "trapezoid"], "trapezoid, 540 degrees: all frames' windows add up to 1"),
    (["--curve", "trapezoid", "--shutter", "720"], "add up to 0.75 to 1.125"),
    ([], "box, 360 degrees: all frames' windows add up to 1"),
])  # fmt: skip
def test_a_shutter_is_drawn_and_its_sum_told(tmp_path, capsys, options, says):
    code, out, err = make.inside(capsys, "shutter", *options, "-o", tmp_path / "s.svg")
    assert (code, err) == (0, "")
    assert says in out
    text = (tmp_path / "s.svg").read_text()
    assert all(f">{word}<" in text for word in ("curve", "integral", "sum"))
    assert make.inside(capsys, "shutter", "-o", tmp_path / "s.svg")[0] == 2  # it is there


@pytest.mark.parametrize("options", ["--shutter 0 -o s.svg", "-o s.png", "--curve hat -o s.svg"])
def test_a_senseless_drawing_is_one_line(tmp_path, capsys, monkeypatch, options):
    monkeypatch.chdir(tmp_path)
    code, out, err = make.inside(capsys, "shutter", *options.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert make.names_in(tmp_path) == []


def test_windows_that_do_not_add_up_are_told_apart():
    t = np.linspace(0.001, 0.999, 500)
    total = sum(weight(Shutter(360, curve="cosine"), t - n) for n in range(-3, 5))
    assert np.ptp(total) > 1


def test_the_integral_of_the_raised_cosine_is_its_closed_form():
    times, integral = Shutter(720, curve="cosine").integral()
    x = times / 2 + 0.5
    exact = x - np.sin(2 * np.pi * x) / (2 * np.pi)
    np.testing.assert_allclose(integral, exact, atol=1e-7)


def test_time_inverts_the_integral_over_a_gap():
    """A curve that is closed in the middle: no sample falls there."""
    shutter = Shutter(360, curve=lambda x: np.where(np.abs(x - 0.5) < 0.25, 0.0, 1.0))
    middles = shutter.sample_times(8)
    assert (np.abs(middles) > 0.24).all()
    assert (np.diff(middles) > 0).all()


def test_a_closed_shutter_has_one_time():
    np.testing.assert_array_equal(Shutter(0).strata(4), np.zeros((4, 3), "f4"))


@pytest.mark.parametrize(
    "options, word",
    [
        ({"degrees": -1}, "degrees"),
        ({"degrees": float("nan")}, "degrees"),
        ({"phase": "middle"}, "phase"),
        ({"phase": float("nan")}, "phase"),
        ({"curve": "hat"}, "curve"),
        ({"rolling": "sideways"}, "rolling"),
        ({"rolling": "up", "rolling_duration": -1.0}, "rolling"),
    ],
)
def test_senseless_options_are_named(options, word):
    with pytest.raises(InputError, match=word):
        Shutter(**options)


@pytest.mark.parametrize("curve", [lambda x: -x, lambda x: 0 * x, lambda x: x + np.inf])
def test_senseless_curves_are_refused(curve):
    with pytest.raises(InputError, match="curve"):
        Shutter(180, curve=curve).strata(4)


def test_a_curve_file_is_the_curve_it_lists(tmp_path):
    (tmp_path / "c.csv").write_text("time,weight\n# a comment\n10,0\n11,1\n12,0\n")
    x = np.linspace(0, 1, 9)
    np.testing.assert_allclose(read_curve(tmp_path / "c.csv")(x), 1 - np.abs(2 * x - 1))


@pytest.mark.parametrize(
    "text",
    ["", "time,weight\n", "1,1\n", "1,1\n1,2\n", "2,1\n1,1\n", "0,-1\n1,1\n", "0,0\n1,0\n",
     "0,x\n1,1\n", "0\n1\n", "0,nan\n1,1\n", "0,1e999\n1,1\n",
     "0,1e308\n1,1e308\n", "-1e308,1\n1e308,1\n", "0,0\n1e-9,1\n2e-9,0\n1,0\n",
     f"0,{200_000 * '1'}\n"],
    ids=lambda text: repr(text[:30]),
)  # fmt: skip
def test_a_senseless_curve_file_is_named(tmp_path, text):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(InputError, match=r"bad\.csv"):
        read_curve(tmp_path / "bad.csv")


def test_a_missing_curve_file_is_named():
    with pytest.raises(InputError, match=r"none\.csv"):
        read_curve("none.csv")


def test_the_gaussian_is_cut_at_three_deviations():
    x = np.linspace(0, 1, 101)
    np.testing.assert_allclose(CURVES["gaussian"](x), np.exp(-4.5 * (2 * x - 1) ** 2), rtol=1e-12)
