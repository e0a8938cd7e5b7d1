"""Cells of an exposure: shares, parts of the shutter, and what lies beyond the clip."""

from itertools import pairwise

import numpy as np
import pytest

from wgmb import InputError, Shutter
from wgmb.exposure import cells, cells_in_shot, evened, own_interval
from wgmb.shutter import CURVES

pytestmark = pytest.mark.fast

RATES = [(240, 60), (144, 60), (60, 60), (24, 24), (24000 / 1001, 24), (25, 60)]
SHUTTERS = [Shutter(180), Shutter(360), Shutter(540, "start", "trapezoid"), Shutter(90, "end"),
            Shutter(720, 0.1, "cosine"), Shutter(300, -0.2, "triangle"),
            Shutter(200, "centre", lambda x: 1 + x)]  # fmt: skip


def slowly(times, at, interval, shutter, steps=8_000):
    """Shares by walking through the exposure: every moment belongs to the nearest frame."""
    moments = at + interval * shutter.time((np.arange(steps) + 0.5) / steps)
    middles = (times[1:] + times[:-1]) / 2
    nearest = (moments[:, None] > middles).sum(axis=1)
    first, last = times[0], times[-1]
    gaps = times[1] - times[0], times[-1] - times[-2]
    inside = (moments >= first - gaps[0] / 2) & (moments <= last + gaps[1] / 2)
    found = np.bincount(nearest[inside], minlength=len(times))
    return found / found.sum()


@pytest.mark.parametrize("shutter", SHUTTERS, ids=range(len(SHUTTERS)))
@pytest.mark.parametrize(("rate", "fps"), RATES)
def test_every_moment_belongs_to_the_nearest_frame(rate, fps, shutter):
    times = np.arange(40) / rate
    for at in (0.0, 5 / fps, times[-1]):
        found = cells(times, at, 1 / fps, shutter)
        got = np.zeros(40)
        for cell in found:
            got[cell.index] += cell.share
        assert got.sum() == pytest.approx(1, abs=1e-9)
        np.testing.assert_allclose(got, slowly(times, at, 1 / fps, shutter), atol=6e-4)


def test_variable_rates_have_shares_and_parts_that_cover_the_exposure():
    rng = np.random.default_rng(1)
    for _ in range(40):
        times = np.cumsum(rng.choice([1 / 60, 1 / 30, 1 / 20, 0.2], 30))
        at = float(rng.choice(times[3:-3])) + 0.003
        shutter = Shutter(float(rng.choice([90, 180, 360])), float(rng.uniform(-0.5, 0.5)))
        found = cells(times, at, 1 / 24, shutter)
        assert sum(c.share for c in found) == pytest.approx(1, abs=1e-9)
        spans = []
        for cell in found:
            own = own_interval(times, cell.index)
            spans.append([times[cell.index] + own * t for t in cell.shutter.span])
        want = [at + t / 24 for t in shutter.span]
        assert spans[0][0] == pytest.approx(want[0]) and spans[-1][1] == pytest.approx(want[1])
        for (_, closes), (opens, _) in pairwise(spans):
            assert closes == pytest.approx(opens)


@pytest.mark.parametrize("curve", [*CURVES, lambda x: 0.2 + x**2], ids=[*CURVES, "own"])
def test_a_part_of_a_shutter_weighs_what_the_shutter_weighs_there(curve):
    shutter = Shutter(540, 0.2, curve)
    part = shutter.part(-0.1, 0.45)
    assert part.span == pytest.approx((-0.1, 0.45))
    times = np.linspace(-0.09, 0.44, 30)
    ratio = shutter.weight(times) / part.weight(times)
    np.testing.assert_allclose(ratio, shutter.share(-0.1, 0.45), rtol=2e-3)


def test_the_same_rate_and_half_an_interval_is_one_frame_and_its_own_shutter():
    (cell,) = cells(np.arange(9) / 24, 4 / 24, 1 / 24, Shutter(180))
    assert (cell.index, cell.share) == (4, 1) and cell.shutter.span == pytest.approx((-0.25, 0.25))


def test_beyond_the_clip_the_nearest_frame_stands_still():
    times = np.arange(5) / 24
    (cell,) = cells(times, 9.0, 1 / 24, Shutter(180))
    assert cell.index == 4 and cell.shutter.degrees == 0
    (cell,) = cells([3.0], 3.0, 1 / 24, Shutter(180))
    assert cell.index == 0 and cell.shutter.span == pytest.approx((-0.25 / 24, 0.25 / 24))


def test_a_closed_shutter_takes_the_frame_of_that_moment():
    found = cells(np.arange(9) / 24, 4.2 / 24, 1 / 24, Shutter(0))
    assert [(c.index, c.share) for c in found] == [(4, 1)]
    assert found[0].shutter.span == pytest.approx((0.2, 0.2))


@pytest.mark.parametrize("shutter", [*SHUTTERS, Shutter(0), Shutter(90, 3.0), Shutter(90, -3.0)],
                         ids=range(len(SHUTTERS) + 3))  # fmt: skip
def test_the_cells_of_a_shot_are_those_among_all_of_its_frames(shutter):
    """To the last bit, though none are asked for but those it meets and one or two beyond."""
    rng = np.random.default_rng(2)
    for steady in (True, False):
        times = np.cumsum(np.full(30, 1 / 48) if steady else rng.choice([1 / 60, 1 / 30, 0.2], 30))
        for at in (*times[[0, 14, 29]], times[14] + 0.5 / 48, times[0] + 1.5 / 48):
            here, asked = int(np.searchsorted(times, at, "right")) - 1, set()

            def time(number, times=times, asked=asked):
                asked.add(number)
                return float(times[number - 100])

            def neighbour(number, side):
                return number + side if 100 <= number + side < 130 else None

            found = cells_in_shot(100 + here, neighbour, time, at, 1 / 24, shutter)
            want = cells(times, at, 1 / 24, shutter)
            assert [(c.index - 100, c.share) for c in found] == [(c.index, c.share) for c in want]
            for ours, theirs in zip(found, want, strict=True):
                assert ours.shutter.span == theirs.shutter.span
                weights = (c.shutter.time(np.linspace(0, 1, 9)) for c in (ours, theirs))
                np.testing.assert_array_equal(*weights)
            met = {*range(found[0].index, found[-1].index + 1), 100 + here}
            between = range(min(met) - 1, max(met) + 3)
            assert asked <= set(between)


def test_ways_to_neighbours_are_told_in_the_frame_s_own_interval():
    times = np.array([0.0, 0.1, 0.4])
    assert own_interval(times, 1) == pytest.approx(0.2)
    assert evened(times, 1) == pytest.approx((2.0, 2 / 3))
    assert evened(times, 0) == (1.0, 1.0) and own_interval(times, -1) == pytest.approx(0.3)


def test_intervals_that_differ_by_rounding_alone_are_even():
    steady = np.arange(8) / 30
    assert {evened(steady, n) for n in range(8)} == {(1.0, 1.0)}
    in_ms = np.round(np.arange(8) / 60, 3)
    assert {evened(in_ms, n, tolerance=0.001) for n in range(8)} == {(1.0, 1.0)}
    assert evened(in_ms, 1) != (1.0, 1.0)
    assert evened(np.array([0.0, 0.017, 0.050]), 1, tolerance=0.001) != (1.0, 1.0)


def test_times_must_ascend_and_rows_cannot_roll():
    with pytest.raises(InputError, match="ascend"):
        cells([0.0, 0.0], 0, 1, Shutter(180))
    with pytest.raises(InputError, match="rolling"):
        cells([0.0, 1.0], 0, 1, Shutter(180, rolling="down"))
