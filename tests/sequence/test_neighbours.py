"""Neighbouring frames bring no holdouts and no bad pixels into this one."""

from dataclasses import replace

import numpy as np
import pytest

import wgmb
from images import crossing, frame_of

SIZE = (54, 96)
METHODS = [("gather", {}), ("reproject", {}), ("reproject", {"variant": "published"})]
PLACES = {-1: np.s_[16:32, 40:56], 1: np.s_[16:32, 56:72]}


@pytest.fixture(params=METHODS, ids=lambda m: " ".join([m[0], *m[1].values()]))
def blur(request):
    method, options = request.param
    return wgmb.Blur(method, shutter=360, samples=8, **options)


def passing(offset, kept, size=(48, 112)):
    """A grey wall that opens in the middle; in the neighbouring frames a red thing before it."""
    shade = np.random.default_rng(0).random((*size, 1)).astype("f4")
    color = np.repeat(shade, 3, axis=2)
    motion, depth = np.zeros((*size, 4), "f4"), np.full(size, 9, "f4")
    mask = np.zeros(size, "f4")
    motion[:, :56], motion[:, 56:] = (8, 0, -8, 0), (-8, 0, 8, 0)
    if offset:
        at = PLACES[offset]
        color[at], motion[at], depth[at], mask[at] = (9, 0, 0), (-20, 0, 20, 0), 3, 1
    return wgmb.Frame(color, motion=motion, depth=depth, holdout=mask if kept else None)


@pytest.mark.parametrize("all_frames", [False, True])
def test_what_is_kept_there_leaves_no_trace_here(blur, all_frames):
    def red(kept):
        frame = passing(0, kept and all_frames)
        out = blur(replace(frame, prev=passing(-1, kept), next=passing(1, kept)))
        return (out[..., 0] - out[..., 1]).max()

    assert red(False) > 0.5
    assert red(True) == 0


def test_an_empty_mask_changes_nothing(blur):
    frame = frame_of([crossing(SIZE, offset) for offset in (0, -1, 1)])
    masked = replace(frame, holdout=np.zeros(SIZE, "f4"))
    np.testing.assert_allclose(blur(masked), blur(frame), atol=1e-5)


def test_a_bad_pixel_there_does_not_cost_the_frame(blur):
    frame = frame_of([crossing(SIZE, offset) for offset in (0, -1, 1)])
    color, motion = frame.prev.color.copy(), frame.prev.motion.copy()
    color[3, 5], motion[4, 60] = np.nan, np.inf
    spoiled = replace(frame, prev=replace(frame.prev, color=color, motion=motion))
    out, want, alone = (blur(f) for f in (spoiled, frame, replace(frame, prev=None)))
    assert np.isfinite(out).all()
    assert abs(out - want).mean() < 0.1 * abs(alone - want).mean()
