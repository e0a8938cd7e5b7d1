"""`wgmb blur --try`: places of a video beside the original."""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from test_blur_video import SIZE, lumas, moving, run, write

from wgmb.run.trial.trial import places
from wgmb.video.clock import Clock

WIDTH, HEIGHT = SIZE
ASIDE = WIDTH + 4


def test_a_trial_shows_seconds_of_the_original_beside_the_result(tmp_path, capsys):
    """Of four seconds, those around the first and the third: as in the whole result."""
    source = write(tmp_path / "a.mkv", moving(32, speed=2.0), 8, codec="ffv1")
    how = "--flow", "dis", "--codec", "ffv1"
    run(capsys, "blur", source, "-o", tmp_path / "whole.mkv", *how)
    text = run(capsys, "blur", source, "-o", tmp_path / "b.mkv", "--flow", "dis", "--try", 2)
    assert "side by side" in text and "b.mkv" in text
    tried, sharp, whole = (lumas(f) for f in (tmp_path / "b.mkv", source, tmp_path / "whole.mkv"))
    numbers = [*range(4, 12), *range(20, 28)]
    assert len(tried) == len(numbers) and tried[0].shape[:2] == (HEIGHT, ASIDE + WIDTH)
    for got, n in zip(tried, numbers, strict=True):
        for part, want in ((got[:, :WIDTH], sharp[n]), (got[:, ASIDE:], whole[n])):
            assert np.abs(part.astype(int) - want).mean() < 2.5, n  # it is encoded
        assert got[:, WIDTH + 1 : ASIDE - 1].max() < 24


def test_a_trial_into_an_image_has_a_row_for_each_place(tmp_path, capsys):
    source = write(tmp_path / "a.mkv", moving(20), 8, codec="ffv1")
    run(capsys, "blur", source, "-o", tmp_path / "b.png", "--flow", "dis", "--try", 3, "-q")
    image = np.asarray(Image.open(tmp_path / "b.png"))
    assert image.shape == (3 * HEIGHT + 8, ASIDE + WIDTH, 3)
    rows = [image[k * (HEIGHT + 4) :][:HEIGHT] for k in range(3)]
    assert all((row[:, :WIDTH] != row[:, ASIDE:]).any() for row in rows)
    assert (rows[0] != rows[1]).any() and (rows[1] != rows[2]).any()
    run(capsys, "blur", source, "-o", tmp_path / "b.png", "--try", 3, code=2)


@pytest.mark.parametrize("words, said", [
    (["--try", 0], "--try must be 1 to 20, got 0"), (["--try", 21], "got 21"),
])  # fmt: skip
def test_a_trial_that_makes_no_sense_is_one_line(tmp_path, capsys, words, said):
    source = write(tmp_path / "a.mkv", moving(3), 8, codec="ffv1")
    assert said in run(capsys, "blur", source, "-o", tmp_path / "b.mp4", *words, code=2)
    assert not (tmp_path / "b.mp4").exists()


@pytest.mark.parametrize("begin, end, count, want", [
    (None, None, 1, [(4.5, 5.5)]), (None, None, 2, [(2, 3), (7, 8)]),
    (6, None, 2, [(6.5, 7.5), (8.5, 9.5)]),
    (None, None, 10, [(0, 10)]), (3, 5, 5, [(3, 5)]),
])  # fmt: skip
def test_places_are_evenly_spaced(begin, end, count, want):
    reader = SimpleNamespace(times=[Fraction(0)], until=Fraction(10))
    plan = SimpleNamespace(reader=reader, clock=Clock(first=begin, end=end))
    assert places(plan, count, Fraction(1)) == want
