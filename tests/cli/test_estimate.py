"""The estimate of a long run."""

import re

import pytest

from wgmb.cli.commands.blur_video import Estimate, spelled

pytestmark = pytest.mark.fast


def told(seconds, total, statuses=("done",) * 6):
    """Lines of a run whose frames are done after so many seconds each, the first after 100."""
    lines, passed, now = [], [], [100.0]
    estimate = Estimate(
        lambda *words: passed.append(words), total, "x is quicker", lines.append, lambda: now[0]
    )
    for number, status in enumerate(statuses):
        estimate(number, status)
        now[0] += seconds
    assert passed == list(enumerate(statuses))
    return lines


def test_a_long_run_is_told_once_with_what_is_quicker():
    assert told(5, 1803) == ["about 2 h 30 min for 1800 more frames; x is quicker"]


def test_a_short_run_is_not_told():
    assert told(5, 100) == [] and told(400, 2, ("done",) * 2) == []


def test_a_run_whose_later_frames_take_long_is_told_when_that_shows():
    lines, now = [], [0.0]
    estimate = Estimate(lambda *_words: None, 300, "x is quicker", lines.append, lambda: now[0])
    for number in range(20):
        now[0] += 0.5 if number < 10 else 20.0
        estimate(number, "done")
    # After the 12th frame: 9 frames of 0.5 s and one of 20 s, beside the slowest one.
    assert lines == ["about 12 min for 288 more frames; x is quicker"]


@pytest.mark.parametrize("starts", [(60, 2, 2), (60, 9, 2), (60, 2, 9), (3, 40, 2.4), (2, 2, 2)])
def test_the_third_frame_tells_the_time_however_slow_the_start_was(starts):
    lines, now = [], [0.0]
    estimate = Estimate(lambda *_words: None, 3003, "x is quicker", lines.append, lambda: now[0])
    for number, seconds in enumerate(starts):
        now[0] += seconds
        estimate(number, "done")
    (line,) = lines
    hours, minutes = (int(word) for word in re.findall(r"(\d+) (?:h|min)", line))
    assert 60 * hours + minutes == pytest.approx(3000 * 2 / 60, rel=0.3)


def test_frames_that_are_done_already_are_no_measure():
    statuses = ("skipped",) * 90 + ("done",) * 4
    assert told(60, 113, statuses) == ["about 20 min for 20 more frames; x is quicker"]


@pytest.mark.parametrize("seconds, text", [(20, "1 min"), (3599, "1 h 0 min"), (90, "2 min")])
def test_times_are_spelled(seconds, text):
    assert spelled(seconds) == text
