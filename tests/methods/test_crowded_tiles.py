"""Searches start from scattered pixels where more motions come than a tile lists."""

import numpy as np
import pytest

import wgmb
from images import frame_of
from twins import gather as gather_twin
from twins.gather import BLOCK, TILE
from wgmb import Shutter

TURN = np.radians(50)  # per frame


def wheel(t, size=(90, 100), spokes=5, turn=TURN, post=0):
    """A wheel of thin spokes that turns before a textured wall: colour, motion, depth.

    Its middle is beside that of the picture, so that no two motions are equally long. `post`: the
    width of a post before it [px].
    """
    fine, (height, width) = 4, size
    y, x = (np.mgrid[: height * fine, : width * fine] + 0.5) / fine
    u, v = x - 0.47 * width - 0.23, y - 0.48 * height + 0.17
    radius, angle = np.hypot(u, v), np.arctan2(v, u) - turn * t
    beside = radius * np.abs(np.sin((angle % (2 * np.pi / spokes)) - np.pi / spokes))
    spoke = (beside < 1.6) & (radius < 0.45 * height)
    wall = 0.4 + 0.2 * np.sin(0.3 * x + 0.5 * y)
    color = np.where(spoke, 0.9, wall)[..., None] * [1.0, 0.8, 0.6]
    before = np.abs(x - 0.63 * width) < post / 2
    color[before], spoke = 0.2, spoke & ~before

    def mean(a):
        return a.reshape(height, fine, width, fine, -1).mean(axis=(1, 3)).astype("f4")

    def turned(by):
        c, s = np.cos(by), np.sin(by)
        return np.stack([c * u - s * v - u, s * u + c * v - v], axis=-1)

    middle = np.s_[2::fine, 2::fine]
    motion = np.where(spoke[..., None], np.dstack([turned(-turn), turned(turn)]), 0.0)[middle]
    depth = np.where(before, 2.0, np.where(spoke, 4.0, 9.0))[middle]
    return mean(color), motion.astype("f4"), depth.astype("f4")


@pytest.mark.parametrize(("degrees", "least"), [(180, 43.5), (360, 41)])
def test_spokes_that_turn_far_are_found(degrees, least):
    """From the four motions of a tile alone: 42.2 and 35.9 dB."""
    frame = frame_of([wheel(t) for t in (0, -1, 1)])
    got = wgmb.Blur("gather", shutter=degrees, samples=16)(frame)
    times = Shutter(degrees).sample_times(64).astype(float)
    truth = np.mean([wheel(t)[0] for t in times], axis=0)
    assert -10 * np.log10(np.mean((got - truth) ** 2)) > least


def test_crowded_tiles_are_their_twin():
    """A search that takes nothing scattered differs in 11 % of the pixels."""
    color, motion, depth = wheel(0, (48, 52), spokes=4, turn=np.radians(80))
    frame = wgmb.Frame(color, motion=motion, depth=depth).between(None, None)
    got = wgmb.Blur("gather", samples=4, shutter=360)(frame)
    times = Shutter(360).sample_times(4).astype(float)
    want = gather_twin.gather([(0, color, motion, depth)], times)
    assert (np.abs(got - want) > 1e-3).any(axis=2).mean() < 0.01


def words_of(blur, frames, slices):
    """The depth and pixel that a Blur scattered last, by frame, then by slice and block."""
    scatter = blur.method._scatter
    size = blur.method._search._images._textures["second differences"].size[:2]
    across, down = (TILE // BLOCK * -(-n // TILE) for n in size)
    words = np.frombuffer(blur.device.queue.read_buffer(scatter._scattered._buffer), np.uint32)
    words = words[: frames * slices * down * across].reshape(frames, slices, down, across)
    found = [{} for _ in range(frames)]
    for f, k, j, i in np.argwhere(words):
        word = int(words[f, k, j, i]) ^ 0xFFFFFFFF
        depth = np.array(word >> 18 << 17, np.uint32).view("f4")
        x, y = ((word >> n & 511) - 256 + BLOCK * at for n, at in ((0, i), (9, j)))
        found[f][k, j, i] = float(depth), y, x
    return found


def test_what_is_scattered_is_its_twin():
    frames = [wheel(t, (48, 52), spokes=4, turn=np.radians(80), post=14) for t in (0, -1, 1)]
    blur = wgmb.Blur("gather", samples=4, shutter=360)
    blur(frame_of(frames))
    given = [(offset, *frame) for offset, frame in zip((0, -1, 1), frames, strict=True)]
    layers = [
        gather_twin.separate(*given[0], 0.5, prev=given[1], next=given[2]),
        gather_twin.separate(*given[1], 0.5, next=given[0]),
        gather_twin.separate(*given[2], 0.5, prev=given[0]),
    ]
    for frame, got in zip(layers, words_of(blur, 3, 4), strict=True):
        tiles = gather_twin.tile_candidates(frame, (-0.5, 0.5))
        gather_twin.scatter(frame, tiles, (-0.5, 0.5), 4, own=layers[0])
        want = {}
        for row in tiles:
            for tile in row:
                want |= tile["scattered"]
        assert len(want) > 10
        assert got == want


def test_spokes_behind_a_post_are_those_of_the_neighbours():
    """From what the frame itself scatters: 26.0 dB."""
    look = {"spokes": 7, "post": 14}
    frame, off = frame_of([wheel(t, **look) for t in (0, -1, 1)]), []
    for t in (-0.4, -0.3, 0.3, 0.4):
        got = wgmb.Blur("gather", shutter=Shutter(1, phase=t), samples=1)(frame)
        off.append(np.square(got - wheel(t, **look)[0]).mean())
    assert -10 * np.log10(np.mean(off)) > 26.1
