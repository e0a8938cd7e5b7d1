"""Flow where a picture repeats: the guide, the choice between repeats, and what comes of it."""

import numpy as np
import pytest
from test_flow import (
    FILTER,
    FIRST,
    MIDDLE,
    compared,
    grid,
    kit,
    matcher,
    random_states,
    read,
    states_texture,
    texture,
)

from twins import flow as twin_flow
from twins import guide as twin
from wgmb import Flow
from wgmb.flow.guide import begun, descended, median
from wgmb.flow.passes import STATES
from wgmb.flow.pyramid import features
from wgmb.flow.shot import follow_guide, matched
from wgmb.flow.sweeps import SweptLevel, half_sweep

SIZE = (13, 9)


def random_ways(size=(9, 13), seed=3):
    rng = np.random.default_rng(seed)
    ways = np.zeros((*size, 8))
    ways[..., :4] = rng.integers(-2, 3, (*size, 4))
    return ways


def test_the_guide_descends_from_the_motion_of_most():
    most = np.array([[1, 0, 3.3], [0, 1, -1.7], [0, 0, 1]]), np.diag([1.3, 1, 1])
    got = read(begun(kit(), SIZE, compared(MIDDLE, 1), most))[..., :4]

    def starts(x, y):
        place = np.array([x + 0.5, y + 0.5, 1])
        return [np.round(np.concatenate([(matrix @ place - place)[:2] for matrix in most]))]

    want = twin.descended(matcher(MIDDLE, 2), starts, 3)
    assert (got == want).all(axis=2).mean() > 0.97


@pytest.mark.covers(0)
@pytest.mark.parametrize("reach", [1, 2])
def test_the_guide_descends_from_the_coarser_level(reach):
    coarser = random_ways((5, 7))
    bound, given = compared(MIDDLE, 1), states_texture(coarser)
    got = read(descended(kit(), SIZE, bound, given, reach))[..., :4]
    want = twin.descended(matcher(MIDDLE, 2), twin.from_coarser(coarser[..., :4]), reach)
    assert (got == want).all(axis=2).mean() > 0.97


def test_the_median_of_displacements():
    ways = random_ways()
    got = read(median(kit(), SIZE, compared(MIDDLE, 1), states_texture(ways)))
    assert (got[..., :4] == twin.median(ways[..., :4])).all()


WIDE = (64, 8)  # what turns back by 3 px or less is led


def striped(views):
    """The matcher and the bindings of stripes 6 px apart that move by 1 px a frame."""
    on_gpu, numbers = {}, {}
    for n in range(3):
        x, y = grid(WIDE[::-1])
        wave = 0.5 + 0.4 * np.sin(2 * np.pi * (x - n) / 6) + 0.02 * np.sin(y)
        rgba = np.dstack([wave, wave, wave, np.ones_like(wave)]).astype("f4")
        view = kit().images.upload(f"striped {n}", rgba, "rgba32float")
        on_gpu[n] = 2 * features(kit(), view, WIDE)[:1]
        numbers[n] = read(on_gpu[n][0])[..., :7] / 255.0
    here, near, far = (numbers[n] for n in (views.here, views.near, views.far))
    price = 0.03 if views is FIRST else 0.0
    match = twin_flow.Matcher(here, near, far, views.factor, 2, price)
    return match, matched(kit(), views, on_gpu, 1)


@pytest.mark.covers(0)
@pytest.mark.parametrize(("views", "is_finer"), [(MIDDLE, False), (MIDDLE, True), (FIRST, False)])
@pytest.mark.parametrize("places", [slice(0, 20), slice(20, 64)])
def test_the_guide_leads_where_states_lead_to_repeats_or_turn_back(views, is_finer, places):
    """It does so in a part of the picture, of whose pixels a few are enough."""
    match, bound = striped(views)
    rng = np.random.default_rng(5)
    shape = WIDE[::-1]
    states, guide, near, far = np.zeros((4, *shape, 8))
    states[..., 0] = 1
    states[:, places, 0] = rng.choice([1, 1, 1, 7, -5], shape)[:, places]
    states[:, places, 2] = rng.choice([0, 0, 2, 3], shape)[:, places]
    guide[..., 0], guide[..., 1] = 1, rng.choice([0, 1], shape)
    if views is MIDDLE:
        guide[..., 2:4] = -guide[..., :2]
    near[..., 0] = rng.choice([-1, 1, 3], shape)
    far[..., 0] = rng.choice([1, -1], shape)
    backs = [near, far] if views is MIDDLE else []
    coarser = random_ways((4, 32)) if is_finer else None
    if is_finer:
        coarser[..., 4] = rng.choice([0, 1], (4, 32))
    marks = twin.found(match, states, guide[..., :4], backs, seeks_repeats=not is_finer)
    known = coarser[..., :5] if is_finer else None
    want, leads = twin.followed(match, states, guide[..., :4], marks, known)
    textures = states_texture(states), states_texture(guide)
    back = [states_texture(way) for way in backs]
    before = states_texture(coarser) if is_finer else None
    output, lead = follow_guide(kit(), WIDE, bound, *textures, back, before)
    assert (np.abs(read(output) - want).max(axis=2) < 1e-4).mean() > 0.97
    assert (np.abs(read(lead)[..., :5] - leads).max(axis=2) < 1e-5).mean() > 0.97
    assert (0.01 < marks[..., 0].mean() < 0.2) != is_finer
    assert (0.01 < marks[..., 1].mean() < 0.2) == (views is MIDDLE)
    assert 0.1 < leads[..., 4].mean() < 0.9
    least = 0.03 if is_finer else 0.05
    assert least < (np.abs(want - states) > 1e-4).any(axis=2).mean() < 0.5


@pytest.mark.parametrize("views", [MIDDLE, FIRST])
def test_half_a_sweep_keeps_near_the_lead(views):
    """Nothing that the twin tries is better, what goes astray from the guide included."""
    states, match = random_states(seed=8), matcher(views)
    states[..., :2] += 2 * np.random.default_rng(8).normal(0, 1, (9, 13, 2))
    lead = random_ways((5, 7))
    lead[..., 4] = np.arange(7) % 2
    output, most = kit().take(SIZE, STATES), np.eye(3)
    on = SweptLevel(0, SIZE, compared(views, 0), [], most, states_texture(lead))
    half_sweep(kit(), on, 0, states_texture(states), output)
    got, energies = read(output).astype(float), []

    def energy(x, y, state):
        own = match.energy(x, y, state, states, 2.0, most, 0.4)
        way = twin.astray(match, state, lead[y // 2, x // 2, :4], 2)
        return own + 0.1 * lead[y // 2, x // 2, 4] * way

    for y in range(9):
        for x in range(y % 2, 13, 2):
            tried = [energy(x, y, s) for s in twin_flow.propagated(match, states, x, y)]
            energies.append((energy(x, y, got[y, x]), min(tried), tried[0]))
    new, least, before = np.transpose(energies)
    assert (new < least + FILTER).all()
    assert (new < before - FILTER).sum() > 10


@pytest.mark.parametrize("quality", [pytest.param("best", marks=pytest.mark.full), "fast"])
def test_checks_that_change_their_shade_are_not_confused(quality):
    """A shadow moves over a checkered cloth by half of its period more than the cloth does."""
    way, period, centre = np.array([3.0, 1.0]), 40, (128, 72)
    x, y = grid((144, 256))

    def seen(n):
        i, j = x - n * way[0], y - n * way[1]
        is_cloth = np.maximum(np.abs(i - centre[0]) / 90, np.abs(j - centre[1]) / 60) < 1
        waves = np.sin(2 * np.pi * i / period) * np.sin(2 * np.pi * j / period)
        color = np.where((waves > 0)[..., None], [0.9, 0.9, 0.85], [0.8, 0.1, 0.12])
        shade = 0.7 + 0.3 * np.cos(2 * np.pi * (j - n * period / 2) / 200)
        return np.where(is_cloth[..., None], color * shade[..., None], texture(x, y)).astype("f4")

    motion, _ = Flow(quality=quality)(seen(-1), seen(0), seen(1))
    error = np.abs(motion - [*-way, *way]).max(axis=2)[20:-20, 50:-50]
    assert (error < 4).mean() > 0.95


@pytest.mark.full
def test_cloth_that_turns_back_is_found_on_both_sides():
    """Waves run through it: slopes and speeds differ so much that one side seems hidden."""
    highest, length, turn = 8, 90, 1.0  # px, px, radians per frame
    x, y = grid((180, 320))
    wave = 2 * np.pi / length

    def cloth(n):
        at = x
        for _ in range(60):
            at = x - highest * np.sin(wave * at + turn * n)
        return at

    place = [highest * np.sin(wave * cloth(0) + turn * n) for n in (-1, 0, 1)]
    true = np.stack([place[0] - place[1], 0 * x, place[2] - place[1], 0 * x], axis=2)
    pictures = (texture(cloth(n), y).astype("f4") for n in (-1, 0, 1))
    motion, _ = Flow()(*pictures)
    error = np.abs(motion - true).max(axis=2)[20:-20, 30:-30]
    assert (error < 1).mean() > 0.8
