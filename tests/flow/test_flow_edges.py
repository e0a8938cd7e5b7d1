"""Sweeps of those tiles alone in which the motion changes."""

import numpy as np
import pytest
from test_flow import MIDDLE, kit, read, states_texture

from wgmb.flow.edges import SweptTiles, tiles_at_edges
from wgmb.flow.match import matched
from wgmb.flow.passes import STATES
from wgmb.flow.pyramid import features
from wgmb.flow.sweeps import half_sweep, sweep

TILE = 8  # px of a colour a side
SIZE = 150, 70  # px; nine whole tiles and a part across, eight and a part down


def listed(tiles):
    """(count, 2) places of the tiles that a sweep is limited to."""
    count = tiles.across * tiles.grid[1] // 2  # a workgroup has two rows
    data = kit().device.queue.read_buffer(tiles.places, 0, max(8 * count, 8))
    places = np.frombuffer(data, np.uint32).reshape(-1, 2)[:count]
    return {(int(x), int(y)) for x, y in places if x < 1000}


def covered(tiles):
    """(height, width) bool: the pixels of the tiles."""
    mask = np.zeros(SIZE[::-1], bool)
    for x, y in listed(tiles):
        mask[TILE * y :][:TILE, 2 * TILE * x :][:, : 2 * TILE] = True
    return mask


def test_tiles_are_those_within_four_pixels_of_another_motion():
    """Half of the size, a sloped plane; a rectangle, and one pixel elsewhere, move otherwise."""
    width, height = SIZE[0] // 2, SIZE[1] // 2
    y, x = np.mgrid[:height, :width].astype("f4")
    states = np.zeros((height, width, 8), "f4")
    states[..., 4:] = [0.2, 0.1, -0.1, 0.3]
    states[..., 0], states[..., 1] = 0.2 * x + 0.1 * y, -0.1 * x + 0.3 * y
    plain = states_texture(states)
    assert listed(tiles_at_edges(kit(), SIZE, plain)) == set()
    apart = np.zeros((height, width), bool)
    apart[10:22, 20:41] = apart[30, 60] = True
    states[apart, 0] += 0.5
    states[5, 5, 2] += 0.5  # a bend
    apart[5, 5] = True
    jumps = np.zeros_like(apart)
    jumps[:, :-1] |= apart[:, 1:] != apart[:, :-1]
    jumps[:-1] |= apart[1:] != apart[:-1]
    want = set()
    for py, px in np.argwhere(jumps):
        for ty in range(9):
            for tx in range(10):
                near_x = 8 * tx - 2 <= px < 8 * tx + 10
                near_y = 4 * ty - 2 <= py < 4 * ty + 6
                if near_x and near_y:
                    want.add((tx, ty))
    assert listed(tiles_at_edges(kit(), SIZE, states_texture(states))) == want
    assert 5 < len(want) < 45


@pytest.fixture(scope="module")
def moving():
    """The bindings of match.wgsl for the middle one of three pictures of noise that moves."""
    noise = np.random.default_rng(3).random((SIZE[1] + 8, SIZE[0] + 8, 4), "f4")
    shown = {}
    for n in range(3):
        picture = np.ascontiguousarray(noise[n : n + SIZE[1], 2 * n : 2 * n + SIZE[0]])
        shown[n] = features(kit(), kit().images.upload(f"edges {n}", picture, "rgba32float"), SIZE)
    return matched(kit(), MIDDLE, shown, 0)


def some_tiles(count):
    """SweptTiles spread over the picture, the last of a part of it among them."""
    every = [(x, y) for y in range(9) for x in range(10)]
    chosen = [*every[:: len(every) // (count - 1)][: count - 1], (9, 8)]
    places = np.full((4 * -(-count // 4), 2), 1 << 20, np.uint32)
    places[:count] = chosen
    buffer = kit().device.create_buffer_with_data(data=places, usage=128 | 4)
    return SweptTiles(buffer, 4, (4 * 32, len(places) // 4 * 2))


def states_of(seed):
    rng = np.random.default_rng(seed)
    states = np.zeros((SIZE[1], SIZE[0], 8), "f4")
    states[..., :2] = rng.choice([-2.0, 1.0, 4.0], (SIZE[1], SIZE[0], 2))
    return states


@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_a_pass_over_tiles_does_there_what_one_over_the_picture_does(moving, number):
    states, tiles = states_of(4), some_tiles(23)
    results = []
    for limit in (None, tiles):
        output = kit().take(SIZE, STATES)
        kit().copy(states_texture(states), output)
        args = [], 0, number, output, np.eye(3)
        half_sweep(kit(), SIZE, moving, states_texture(states), *args, tiles=limit)
        results.append(read(output))
        kit().give(output)
    whole, part = results
    mask = covered(tiles)
    assert 0.15 < mask.mean() < 0.5
    np.testing.assert_array_equal(part[mask], whole[mask])
    np.testing.assert_array_equal(part[~mask], states[~mask])
    assert (whole[mask] != states[mask]).any(axis=1).mean() > 0.2


def test_a_sweep_of_tiles_leaves_all_else(moving):
    states, tiles = states_of(5), some_tiles(9)
    got = read(sweep(kit(), SIZE, moving, states_texture(states), [], 0, 1, np.eye(3), None, tiles))
    mask = covered(tiles)
    np.testing.assert_array_equal(got[~mask], states[~mask])
    assert (got[mask] != states[mask]).any(axis=1).mean() > 0.4


def test_a_sweep_of_no_tiles_changes_nothing(moving):
    plain = states_texture(np.zeros((SIZE[1] // 2, SIZE[0] // 2, 8), "f4"))
    none = tiles_at_edges(kit(), SIZE, plain)
    states = states_of(6)
    got = read(sweep(kit(), SIZE, moving, states_texture(states), [], 0, 1, np.eye(3), None, none))
    np.testing.assert_array_equal(got, states)
