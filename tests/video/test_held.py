"""Animations whose last picture is held for longer than the others."""

from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

from wgmb.settings.video import VideoSettings
from wgmb.video.output_times import OutputFrames
from wgmb.video.read.reader import VideoReader


def animation(path, delays):
    """A file of one colour a picture, shown for so many milliseconds each."""
    pictures = [Image.new("RGB", (16, 16), (40 * n, 90, 200 - 30 * n)) for n in range(len(delays))]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=list(delays))
    return VideoReader(path)


@pytest.mark.parametrize("suffix", [".gif", ".apng"])
def test_a_last_picture_that_is_held_lasts_as_long(tmp_path, suffix):
    reader = animation(tmp_path / f"a{suffix}", (100, 100, 100, 900))
    assert reader.duration == Fraction(12, 10)
    clock = VideoSettings().clock(reader, None)
    assert len(OutputFrames(reader, clock, Fraction(10))) == 12
    part = VideoSettings(end="0.5").clock(reader, None)
    assert len(OutputFrames(reader, part, Fraction(10))) == 5


def test_at_its_own_times_it_is_shown_again_where_its_interval_ends(tmp_path):
    reader = animation(tmp_path / "a.gif", (100, 300, 100, 900))
    clock = VideoSettings().clock(reader, None)
    times = [moment.time for moment in OutputFrames(reader, clock, None)]
    assert times[:4] == [0, Fraction(1, 10), Fraction(4, 10), Fraction(5, 10)]
    assert len(times) == 5 and times[4] + 1 / reader.rate == Fraction(14, 10)


def test_delays_that_are_rounded_are_no_hold(tmp_path):
    """GIF has hundredths of a second."""
    reader = animation(tmp_path / "a.gif", (30, 40, 30, 40))
    clock = VideoSettings().clock(reader, None)
    assert len(OutputFrames(reader, clock, None)) == 4


def test_a_delay_that_browsers_do_not_keep_is_theirs(tmp_path):
    """Under 0.02 s they show a picture for 0.1 s."""
    reader = animation(tmp_path / "a.gif", (10, 20, 10, 50, 10))
    assert list(reader.times) == [Fraction(n, 100) for n in (0, 10, 12, 22, 27)]
    assert reader.until == Fraction(37, 100)
    assert "3 pictures with a delay under 0.02 s are shown for 0.1 s" in "; ".join(reader.notes)
    levels = [int(picture.planes[0][0, 0]) for _, picture in reader]
    assert np.abs(np.array(levels) - [0, 40, 80, 120, 160]).max() <= 2
