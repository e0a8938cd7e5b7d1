"""The published form of reproject: counts, lines, and the tests that Taylor left out."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import make_frames as make
import wgmb
from wgmb import Clip, InputError
from wgmb.cli import app

PUBLISHED = [{}, {"depth_test": True}, {"splat": "line"}]


def frame(color, to_prev, depth=5.0):
    plane = np.full(color.shape[:2], 1, "f4") * depth
    return wgmb.Frame(color, to_prev=to_prev.astype("f4"), depth=plane.astype("f4"))


def published(given, samples=8, **options):
    return wgmb.Blur("reproject", variant="published", samples=samples, **options)(given)


def converging(size=(48, 64)):
    """Everything comes together in the middle pixel."""
    y, x = np.mgrid[: size[0], : size[1]]
    return np.stack([size[1] // 2 - x, size[0] // 2 - y], axis=2).astype("f4")


@pytest.mark.parametrize("options", PUBLISHED)
def test_the_same_bits_every_run(options):
    rng = np.random.default_rng(2)
    given = frame(rng.random((48, 64, 3), "f4"), 20 * rng.normal(size=(48, 64, 2)),
                  rng.uniform(1, 3, (48, 64)))  # fmt: skip
    given = replace(given, prev=given)
    first = published(given, **options)
    for _ in range(3):
        assert np.array_equal(published(given, **options), first)


@pytest.mark.parametrize("options", PUBLISHED)
@pytest.mark.parametrize("value, seen", [(262143.0, 262143.0), (1e9, 262143.0), (-5.0, 0.0),
                                         (1 / 16384, 1 / 16384)])  # fmt: skip
def test_sums_do_not_overflow(options, value, seen):
    """3072 pixels on one, 64 times: 2^50 in fixed point."""
    given = frame(np.full((48, 64, 3), value, "f4"), converging())
    out = published(given, samples=64, **options)
    reached = published(given, samples=64, show="count", **options)[..., 0] > 0
    assert reached[24, 32]
    np.testing.assert_allclose(out[reached], seen, rtol=1e-6)


def test_many_steps_are_done_in_several_chunks(monkeypatch):
    rng = np.random.default_rng(2)
    given = frame(rng.random((48, 64, 3), "f4"), 9 * rng.normal(size=(48, 64, 2)))
    whole = published(given, samples=10)
    monkeypatch.setattr(sys.modules["wgmb.methods.reproject"], "AT_ONCE", 3 * 4 * 48 * 64)
    assert np.array_equal(published(given, samples=10), whole)


def test_lines_leave_no_gaps_between_the_steps():
    """One row moves 30 px in two steps; points reach its start and end alone."""
    color = np.ones((8, 64, 3), "f4")
    to_prev = np.zeros((8, 64, 2), "f4")
    to_prev[:, :4, 0] = 30
    points, lines = (
        published(frame(color, to_prev), samples=2, show="count", splat=s)[0, :, 0]
        for s in ("point", "line")
    )
    still = points[50]
    assert (points[10:28] == still).all()
    assert (lines[6:28] > still).all()
    assert lines.sum() == pytest.approx(points.sum(), rel=0.01)  # the energy is the same


def test_the_nearest_of_a_step_is_seen():
    color = np.zeros((8, 32, 3), "f4")
    color[:, :8] = 1
    to_prev = np.zeros((8, 32, 2), "f4")
    to_prev[:, :8, 0] = 16
    depth = np.full((8, 32), 5.0)
    for near, seen in ((2.0, 1.0), (9.0, 0.0)):
        depth[:, :8] = near
        out = published(frame(color, to_prev, depth), samples=1 + 1, depth_test=True)
        assert out[4, 20, 0] == pytest.approx(seen / 2)  # one step of the two
    assert published(frame(color, to_prev, depth), samples=2)[4, 20, 0] == pytest.approx(1 / 3)


@pytest.mark.parametrize("options, words", [
    ({"facing": True}, "variant='published'"),
    ({"splat": "line"}, "variant='published'"),
    ({"variant": "published", "splat": "square"}, "splat must be one of point, line"),
    ({"variant": "published", "splat": "line", "depth_test": True}, "depth_test` needs `splat"),
])  # fmt: skip
def test_options_that_do_not_fit_are_named(options, words):
    with pytest.raises(InputError, match=words):
        wgmb.Blur("reproject", **options)


def test_facing_without_cameras_is_named(noise):
    with pytest.raises(InputError, match="facing needs the cameras"):
        published(frame(noise, converging()), facing=True)


def test_options_reach_the_command_line(tmp_path):
    path = make.write_exr(tmp_path / "a.exr", make.frame(1))
    seen = []
    for i, more in enumerate([[], ["--depth-test"], ["--splat", "line"]]):
        out = tmp_path / f"out{i}.exr"
        words = ["blur", str(path), "-o", str(out), "--method", "reproject", "-q"]
        assert app.main([*words, "--variant", "published", "--samples", "3", *more]) == 0
        seen.append(next(iter(Clip(out))).color)
    assert not np.array_equal(seen[0], seen[1])
    assert not np.array_equal(seen[0], seen[2])
    assert app.main([*words[:3], str(tmp_path / "b.exr"), *words[4:], "--facing"]) == 2
