"""Dense inverse search and the search of blocks, slow and obvious; wgsl/flow/dense/ as numpy.

Grey pictures are (height, width), levels of 0 to 255; ways are x, y [px].
"""

import numpy as np

from wgmb.color.srgb import srgb
from wgmb.gpu import wgsl

LUMA = 0.299, 0.587, 0.114


def constant(file, name):
    return wgsl.load(f"flow/dense/{file}.wgsl").constant(name)


def grey(picture):
    return (255 * srgb(picture[..., :3].clip(0, 1)) @ LUMA).astype("f4")


def reduced(plane, size):
    """Means over the areas of the pixels of a smaller size, width and height."""
    for axis, few in ((0, size[1]), (1, size[0])):
        many = plane.shape[axis]
        low, high = (np.arange(few)[:, None] + k for k in (0, 1))
        low, high = low * many / few, high * many / few
        at = np.arange(many)
        share = (np.minimum(high, at + 1) - np.maximum(low, at)).clip(0)
        share /= share.sum(axis=1, keepdims=True)
        plane = np.moveaxis(np.tensordot(share, plane, (1, axis)), 0, axis)
    return plane


def at(plane, x, y):
    """The plane at whole places; outside, the nearest pixel inside."""
    height, width = plane.shape
    return plane[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)].astype(float)


def between(plane, x, y):
    """The plane at places between four pixels."""
    low_x, low_y = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - low_x, y - low_y
    upper = (1 - u) * at(plane, low_x, low_y) + u * at(plane, low_x + 1, low_y)
    lower = (1 - u) * at(plane, low_x, low_y + 1) + u * at(plane, low_x + 1, low_y + 1)
    return (1 - v) * upper + v * lower


def patch_way(here, other, coarser, corner):
    """The way of the patch at a corner (x, y); `coarser` (height, width, 2): that of a level."""
    side, stride = constant("patches", "PATCH"), constant("patches", "STRIDE")
    y, x = np.mgrid[:side, :side] + np.array(corner)[::-1, None, None]
    across = (at(here, x + 1, y) - at(here, x - 1, y)) / 2
    down = (at(here, x, y + 1) - at(here, x, y - 1)) / 2
    slopes = np.stack([across - across.mean(), down - down.mean()], -1).reshape(-1, 2)
    flat = constant("patches", "FLAT")
    inverse = np.linalg.inv(slopes.T @ slopes + flat * np.eye(2))

    def apart(way):
        found = between(other, x + way[0], y + way[1]) - at(here, x, y)
        return (found - found.mean()).ravel()

    scale = np.array(here.shape[::-1]) / np.array(coarser.shape[1::-1])
    starts = []
    for by in ((0, 0), (-stride, 0), (stride, 0), (0, -stride), (0, stride)):
        place = (np.array(corner) + by + side / 2) / scale - 0.5
        place = np.clip(place, 0, np.array(coarser.shape[1::-1]) - 1)
        starts.append(scale * [between(coarser[..., k], *place) for k in (0, 1)])
    begin = min(starts, key=lambda way: (apart(way) ** 2).sum())
    tried, way = [], np.array(begin)
    for _ in range(constant("patches", "STEPS")):
        tried.append(way)
        step, most = -inverse @ (slopes.T @ apart(way)), constant("patches", "LONGEST_STEP")
        farthest = constant("patches", "FARTHEST")
        way = np.clip(way + np.clip(step, -most, most), begin - farthest, begin + farthest)
    return min(tried, key=lambda way: (apart(way) ** 2).sum())


def block_way(prev, here, next, cell, most):
    """The way to the next picture of a block, a cell (column, row), and its cost there."""
    side, spacing = constant("summary", "BLOCK"), constant("summary", "SPACING")
    y, x = np.mgrid[:side, :side] + (spacing * np.array(cell[::-1]) - 2)[:, None, None]
    block = at(here, x, y)
    reach = round(constant("blocks", "REACH") * max(here.shape))
    ways, costs = [], []
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            one = ((at(prev, x - dx, y - dy) - block) ** 2).mean()
            two = ((at(next, x + dx, y + dy) - block) ** 2).mean()
            worse = min(max(one, two), constant("blocks", "MOST_SQUARE"))
            costs.append(min(one, two) + constant("blocks", "OTHER") * worse)
            ways.append((dx, dy))
    limit = constant("blocks", "ALIKE") * min(costs) + constant("blocks", "LEVEL")
    alike = [k for k, cost in enumerate(costs) if cost <= limit]
    return ways[min(alike, key=lambda k: np.hypot(*(np.array(ways[k]) - most)))]


def raised(small, large, state):
    """The state (height, width, 4) of the likest of nine small pixels, for a larger grey."""
    factor = np.array(large.shape[::-1]) / np.array(small.shape[::-1])
    found = np.zeros((*large.shape, 4))
    for y in range(large.shape[0]):
        for x in range(large.shape[1]):
            place = (np.array([x, y]) + 0.5) / factor - 0.5
            middle, costs = np.rint(place).astype(int), {}
            for by in [(k % 3 - 1, k // 3 - 1) for k in (4, 5, 6, 7, 8, 0, 1, 2, 3)]:
                near = middle + by
                far = constant("raising", "AWAY") * np.hypot(*(near - place))
                inner = tuple(np.clip(near, 0, np.array(small.shape[::-1]) - 1))
                cost = abs(small[inner[1], inner[0]] - float(large[y, x])) + far
                costs[inner] = min(cost, costs.get(inner, np.inf))
            column, row = min(costs, key=lambda near: costs[near])
            found[y, x] = state[row, column] * np.tile(factor, 2)
    return found
