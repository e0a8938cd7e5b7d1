"""Methods that read backwards from a pixel follow closed forms of uneven motion."""

import numpy as np
import pytest

import wgmb
from wgmb import metrics

SIZE, BORDER, SAMPLES = 96, 24, 64
TIMES = (np.arange(SAMPLES) + 0.5) / (2 * SAMPLES) - 0.25
GRID = np.stack(np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5), axis=2) - SIZE / 2


def pattern(at):
    """(..., 3) soft light at places (..., 2)."""
    x, y = at[..., 0], at[..., 1]
    waves = [np.sin(x / 5 + y / 7 + k) * np.cos(x / 6 - y / 9 + 2 * k) for k in range(3)]
    return 0.5 + 0.3 * np.stack(waves, axis=-1)


def speeding(velocity, half):
    """A translation: forwards from the frame to a time, and back."""
    way = lambda t: np.array(velocity) * t + np.array(half) * t * t  # noqa: E731
    return lambda at, t: at + way(t), lambda at, t: at - way(t)


def turning(degrees):
    def turned(at, t):
        angle = np.radians(degrees) * t
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return at @ turn

    return turned, lambda at, t: turned(at, -t)


def growing(share):
    """A zoom whose scale grows evenly."""
    return lambda at, t: at * (1 + share * t), lambda at, t: at / (1 + share * t)


def kinked(velocity):
    """It stands until the frame, and moves from then on."""
    way = lambda t: np.array(velocity) * max(t, 0.0)  # noqa: E731
    return lambda at, t: at + way(t), lambda at, t: at - way(t)


def frame(body, time=0.0):
    ahead, back = body
    here = back(GRID, time)
    motion = np.concatenate([ahead(here, time + side) - GRID for side in (-1, 1)], axis=2)
    depth = np.ones((SIZE, SIZE), np.float32)
    return wgmb.Frame(pattern(here).astype("f4"), motion=motion.astype("f4"), depth=depth)


def blurred(body, method="tap", **options):
    made = frame(body)
    if options.get("path") == "five":
        made = made.between(frame(body, -1.0), frame(body, 1.0))
    out = np.asarray(wgmb.Blur(method, samples=SAMPLES, shutter=180, jitter=0, **options)(made))
    return out[BORDER:-BORDER, BORDER:-BORDER, :3]


def truth(body):
    seen = np.mean([pattern(body[1](GRID, t)) for t in TIMES], axis=0)
    return seen[BORDER:-BORDER, BORDER:-BORDER].astype("f4")


BODIES = [
    (speeding((12, 0), (8, 0)), 60),
    (speeding((4, 1), (10, -3)), 60),
    (turning(20), 50),
    (growing(0.2), 60),
]


@pytest.mark.parametrize("path", ["curved", "five"])
@pytest.mark.parametrize(("body", "least"), BODIES, ids=["faster", "much faster", "turn", "zoom"])
def test_taps_come_from_where_the_content_was(body, least, path):
    assert metrics.psnr(blurred(body, path=path), truth(body)) > least


def test_taps_know_that_a_body_stood_before_it_moved():
    body = kinked((12, 0))
    assert metrics.psnr(blurred(body, path="five"), truth(body)) > 60


def test_a_straight_path_takes_the_mean_velocity():
    body = speeding((12, 0), (8, 0))
    even = truth(speeding((12, 0), (0, 0)))
    assert metrics.psnr(blurred(body, path="straight"), even) > 60


@pytest.mark.parametrize(("body", "least"), BODIES, ids=["faster", "much faster", "turn", "zoom"])
def test_the_trail_of_fusion_comes_from_there_too(body, least):
    """All weight is the trail's; its Gaussian costs some light."""
    out = blurred(body, "fusion", alpha_front=0.04)
    assert metrics.psnr(out, truth(body)) > 40
