"""Data windows: canvases, what lies outside, and frames cropped to what is in them."""

import numpy as np
import pytest

from wgmb import Frame, InputError
from wgmb.sequence import data_windows

DISPLAY = (10, 20, 1929, 1099)


def holds(outer, inner):
    return (
        outer[0] <= inner[0]
        and outer[1] <= inner[1]
        and outer[2] >= inner[2]
        and outer[3] >= inner[3]
    )


@pytest.mark.fast
def test_a_canvas_holds_what_it_must_and_lies_on_the_grid_or_ends_with_the_picture():
    rng = np.random.default_rng(0)
    for _ in range(500):
        x, y = rng.integers(-300, 2200, 2), rng.integers(-300, 1300, 2)
        needed = (int(x.min()), int(y.min()), int(x.max()), int(y.max()))
        limit = data_windows.allowed([needed], DISPLAY, (False,) * 4)
        assert holds(limit, DISPLAY) and holds(limit, needed)
        found = data_windows.canvas(needed, limit, [needed], DISPLAY)
        assert holds(limit, found) and holds(found, needed)
        for i in range(4):
            step = (128, 64)[i % 2]
            on_grid = (found[i] + (i >= 2) - DISPLAY[i % 2]) % step == 0
            assert on_grid or found[i] == limit[i]


@pytest.mark.fast
def test_a_canvas_is_all_there_may_be_once_it_is_half_of_that():
    limit = data_windows.allowed([DISPLAY], DISPLAY, (False,) * 4)
    assert data_windows.canvas((10, 20, 1100, 1099), limit, [], DISPLAY) == DISPLAY
    assert data_windows.canvas((10, 20, 100, 100), limit, [], DISPLAY) == (10, 20, 137, 147)


@pytest.mark.fast
def test_a_side_that_cuts_through_the_picture_is_where_canvases_end():
    region = (500, 300, 900, 600)
    cut = (True, False, True, False)
    assert data_windows.allowed([region], DISPLAY, cut) == (500, 20, 900, 1099)
    assert data_windows.unknown(region, DISPLAY, cut) == cut
    assert data_windows.unknown((10, 300, 900, 1099), DISPLAY, (False,) * 4) == (
        True, False, False, True,
    )  # fmt: skip


@pytest.mark.fast
def test_windows_far_apart_are_an_error():
    far = (-30_000, 20, -29_000, 500)
    limit = data_windows.allowed([far, (31_000, 20, 31_100, 500)], DISPLAY, (False,) * 4)
    with pytest.raises(InputError, match="canvas of 61101"):
        data_windows.canvas(limit, limit, [far], DISPLAY)


@pytest.mark.fast
@pytest.mark.parametrize("opaque, want", [(0.4, False), (0.6, True)])
def test_a_side_is_covered_if_over_half_of_its_pixels_are(opaque, want):
    for channels in (3, 4):
        rgba = np.zeros((10, 10, channels), "f4")
        rgba[: int(10 * opaque), -1] = 1
        assert data_windows.covered(rgba) == (False, False, want, False)


def slowly(array, window, onto, edges, empty):
    """Every pixel of the canvas on its own."""
    left, top, right, bottom = window
    width, height = data_windows.size_of(onto)
    out = np.full((height, width), empty, array.dtype)
    for y in range(height):
        for x in range(width):
            px, py = x + onto[0], y + onto[1]
            ok = True
            for outside, edge in ((px < left, edges[0]), (py < top, edges[1]),
                                  (px > right, edges[2]), (py > bottom, edges[3])):  # fmt: skip
                ok &= edge or not outside
            if ok:
                out[y, x] = array[min(max(py, top), bottom) - top, min(max(px, left), right) - left]
    return out


@pytest.mark.fast
@pytest.mark.parametrize("seed", range(12))
def test_pixels_are_laid_on_a_canvas_one_by_one(seed):
    rng = np.random.default_rng(seed)
    window = (3, -2, 9, 4)
    onto = (int(rng.integers(-4, 4)), int(rng.integers(-6, -1)), 9 + int(rng.integers(0, 5)), 4)
    edges = tuple(bool(b) for b in rng.integers(0, 2, 4))
    array = rng.random((7, 7)).astype("f4")
    got = data_windows.laid(array, window, onto, edges, 7.0)
    np.testing.assert_array_equal(got, slowly(array, window, onto, edges, 7.0))


@pytest.mark.fast
def test_what_lies_outside_is_transparent_still_and_infinitely_far():
    shape = (4, 5)
    frame = Frame(
        np.ones((*shape, 4), "f2"),
        motion=np.ones((*shape, 4), "f4"),
        depth=np.ones(shape, "f4"),
        normal=np.ones((*shape, 3), "f4"),
        holdout=np.ones(shape, "f4"),
        scale=np.full(shape, 0.5, "f4"),
        window=(2, 1, 20, 10),
    )
    got = data_windows.placed(frame, (2, 1, 6, 4), (0, 0, 19, 9), (False,) * 4)
    assert got.window == (0, 0, 20, 10) and got.color.dtype == np.float16
    for name, outside in (("color", 0), ("motion", 0), ("depth", np.inf), ("normal", 0),
                          ("holdout", 0), ("scale", 1)):  # fmt: skip
        array = getattr(got, name)
        assert (array[0] == outside).all() and (array[:, -1] == outside).all()
        np.testing.assert_array_equal(array[1:5, 2:7], getattr(frame, name))


@pytest.mark.fast
def test_a_result_grows_as_far_as_it_is_not_empty_but_not_into_the_unknown():
    picture = np.zeros((10, 20, 4), "f4")
    picture[2, 3] = picture[8, 17] = 0.1
    own, onto = (5, 5, 9, 6), (0, 0, 19, 9)
    free, held = (
        data_windows.Placement(onto, (-9, -9, 99, 99)),
        data_windows.Placement(onto, (5, -9, 9, 99)),
    )
    assert data_windows.result_window(picture, free, own) == (3, 2, 17, 8)
    assert data_windows.result_window(picture, held, own) == (5, 2, 9, 8)
    assert data_windows.result_window(0 * picture, free, own) == own
