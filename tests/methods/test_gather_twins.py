"""`gather` against its slow, obvious twin in numpy."""

import numpy as np
import pytest
from fine_scenes import soft_disk

import wgmb
from images import blades, crossing
from twins import gather as gather_twin
from wgmb import Shutter


@pytest.mark.covers(1)
@pytest.mark.parametrize("frames", [1, 2, 3, pytest.param(5, marks=pytest.mark.full)])
@pytest.mark.parametrize("size", [(28, 42), (1, 1)])
@pytest.mark.parametrize("degrees", [180, 400])
@pytest.mark.parametrize("wall", [True, False])
def test_gather_is_its_twin(size, frames, degrees, wall):
    """Samples on a texel's edge may read the next one; nearly all pixels agree."""
    offsets = (0, -1, 1, -2, 2)[:frames]
    sources = [(offset, *crossing(size, offset, wall=wall)) for offset in offsets]
    assert differing_from_gather(sources, degrees) < 0.01


def test_gather_is_its_twin_in_a_crowd():
    """Grass, over a fifth of whose pixels show three surfaces: nothing is separated there."""
    sources = [(offset, *blades((36, 52), offset)) for offset in (0, -1, 1)]
    assert not (gather_twin.separate(*sources[0], 0.25).depth[1] > 0).any()
    assert differing_from_gather(sources, 180) < 0.01


def test_gather_is_its_twin_where_surfaces_hardly_move_apart():
    """Vectors are not filtered: up to 8 px apart, only thin parts are separated."""
    sources = [(offset, *crossing((24, 40), offset, wall=False)) for offset in (0, -1, 1)]
    none, thin, every = (
        (gather_twin.separate(*sources[0], longest).depth[1] > 0).sum()
        for longest in (0.02, 0.14, 0.5)
    )
    assert 0 == none < thin < every
    assert differing_from_gather(sources, 100) < 0.01


def test_gather_is_its_twin_where_depths_contradict_colours():
    """Two columns of a box are as deep as what is behind it, and have vectors of their own."""
    sources = []
    for offset in (0, -1, 1):
        color, motion, depth = crossing((24, 40), offset, wall=False)
        last = (depth < 5) & ~np.roll(depth < 5, -1, axis=1)
        wrong = last | np.roll(last, -1, axis=1)
        motion[wrong] += (-3, 1, 3, -1)
        sources.append((offset, color, motion, np.where(wrong, np.inf, depth)))
    assert differing_from_gather(sources, 360) < 0.01


def test_gather_is_its_twin_where_a_body_turns_under_its_outline():
    """Nothing is separated there: an outline that rests shows the same of both sides."""
    sources = [(offset, *crossing((24, 40), offset, turns=True)) for offset in (0, -1, 1)]
    prev, after = sources[1:]
    alone, between = (
        (gather_twin.separate(*sources[0], 0.25, **around).depth[1] > 0).sum()
        for around in ({}, {"prev": prev, "next": after})
    )
    assert alone > 20 and between == 0
    assert differing_from_gather(sources, 180) < 0.01


def test_gather_is_its_twin_out_of_focus():
    """A wide rim, over which motions change evenly, has no edge in it while it moves slowly."""
    sources = [(offset, *soft_disk(offset, size=(24, 72))) for offset in (0, -1, 1)]
    slowly, quickly = (
        (gather_twin.separate(*sources[0], longest).depth[1] > 0).any() for longest in (0.1, 0.3)
    )
    assert quickly and not slowly
    assert differing_from_gather(sources, 72) < 0.01


@pytest.mark.full
def test_gather_is_its_twin_of_what_comes_nearer():
    """At the same depth in the neighbours, whose samples would be seen instead, 19 % differ."""
    sources = []
    for offset in (0, -1, 1):
        color, motion, depth = crossing((48, 64), offset)
        sources.append(
            (offset, color, motion, np.where(depth < 9, depth * (1 - 0.2 * offset), depth))
        )
    assert differing_from_gather(sources, 360) < 0.01


@pytest.mark.covers(0)
@pytest.mark.parametrize("left", [1.0, 0.5])
def test_gather_is_its_twin_where_light_changes(left):
    """The wall is darker in the neighbours, or its left half alone."""
    sources = []
    for offset in (0, -1, 1):
        color, motion, depth = crossing((24, 40), offset)
        darker = (depth > 5) & (np.arange(40) < 40 * left) & bool(offset)
        color[darker, :3] *= 0.35
        sources.append((offset, color, motion, depth))
    assert differing_from_gather(sources, 360) < 0.01


def differing_from_gather(sources, degrees):
    """Share of the pixels at which gather and its twin differ."""
    made = {o: wgmb.Frame(c, motion=m, depth=d) for o, c, m, d in sources}
    near = (made.get(side) and made[side].between(made.get(-2), made.get(2)) for side in (-1, 1))
    frame = made[0].between(*near)
    got = wgmb.Blur("gather", samples=4, shutter=degrees, reach=2)(frame)
    want = gather_twin.gather(sources, Shutter(degrees).sample_times(4).astype(float))
    return (np.abs(got - want) > 1e-3).any(axis=2).mean()
