"""Guertin, McGuire and Nowrouzezahrai 2014, one tile, one pixel and one tap at a time."""

import math

import numpy as np

from twins.tap import bilinear, displacement, source

KAPPA, GAMMA, SHORT, FAR, NEAR, STATIC = 40.0, 1.5, 0.5, 1e10, 1.0, 0.01


def tiles(color, motion, depth, times, span, noise, edge, published=False, weight=None):
    """`span`: opens, closes; `noise` (height, width) moves the tile look-up."""
    height, width = color.shape[:2]
    motion = motion.astype(float)
    fastest = _fastest(motion, span, edge)
    dominant = _dominant(fastest, span, published)
    streak, way = np.zeros((height, width)), np.zeros((height, width, 2))
    for at in np.ndindex(height, width):
        streak[at], way[at] = _streak(motion[at], span), _direction(motion[at], span)
    out = np.zeros(color.shape)
    for y, x in np.ndindex(height, width):
        tile = _tile(x, y, noise[y, x], edge, dominant.shape)
        fast = _held(dominant[tile], span, edge)
        reach = _streak(fast, span)
        if not published and (depth is None or reach <= SHORT):
            out[y, x] = _passing(color, motion, times, span, dominant[tile], weight, y, x)
            continue
        if reach <= SHORT:
            out[y, x] = _own(color, weight, y, x)
            continue
        along = _direction(fast, span)
        here = _within(streak[y, x], SHORT, edge)
        share = (1.0 if published else 0.25) / (KAPPA * here)
        total = share * color[y, x]
        counted = share * (1 if weight is None else weight[y, x])
        for i, t in enumerate(times):
            offset = displacement(fast, t)
            far = np.hypot(*offset)
            if i % 2:
                trust = _within((here - SHORT) / GAMMA, 0, 1)
                offset = far * np.sign(t) * _own_direction(way[y, x], along, trust)
            at = np.array([x + 0.5, y + 0.5]) - offset
            column = int(_within(at[0], 0, width - 1))
            row = int(_within(at[1], 0, height - 1))
            there = _within(streak[row, column], SHORT, edge)
            w = _weight(far, offset, here, there, way[y, x], way[row, column],
                        _depth(depth, y, x), _depth(depth, row, column))  # fmt: skip
            if not published:
                w /= max(2 * _cone(far, reach) + 2 * _cylinder(far, reach), 1e-3)
            total = total + w / len(times) * bilinear(color, *at)
            counted += w / len(times) * (1 if weight is None else bilinear(weight, *at))
        out[y, x] = total / counted if counted > 0 else _own(color, weight, y, x)
    return out


def _passing(color, motion, times, span, fast, weight, y, x):
    """The pixel's own path, but what moves farther when it passes."""
    if _streak(fast, span) < STATIC:
        return _own(color, weight, y, x)
    height, width = color.shape[:2]
    here, own, total, counted = np.array([x + 0.5, y + 0.5]), _velocity(motion[y, x]), 0.0, 0.0
    for t in times:
        at = here + source(motion, y, x, t)
        offset = displacement(fast, t)
        column = int(_within(np.floor((here - offset)[0]), 0, width - 1))
        row = int(_within(np.floor((here - offset)[1]), 0, height - 1))
        other = _velocity(motion[row, column])
        speed = np.hypot(*other)
        is_faster = speed > np.hypot(*own) + 0.5
        is_faster &= np.hypot(*(other - own)) > max(1.0, 0.25 * speed)
        if is_faster and np.hypot(*(displacement(motion[row, column], t) - offset)) < NEAR:
            at = here - offset
        total = total + bilinear(color, *at) / len(times)
        counted += (1 if weight is None else bilinear(weight, *at)) / len(times)
    if counted <= 0:
        return _own(color, weight, y, x)
    return total if weight is None else total / counted


def _velocity(motion):
    return (motion[2:] - motion[:2]) / 2


def followed(motion, span, edge):
    """(rows, columns, 2) what each tile follows [px], as it goes on after time 0."""
    dominant = _dominant(_fastest(motion.astype(float), span, edge), span)
    ways = np.zeros((*dominant.shape[:2], 2))
    for at in np.ndindex(ways.shape[:2]):
        ways[at] = _streak(dominant[at], span) * _direction(dominant[at], span)
    return ways


def _weight(far, offset, here, there, own_way, way, z, z_there):
    front = _within(1 - (z_there - z) / min(z, z_there), 0, 1)
    behind = _within(1 - (z - z_there) / min(z, z_there), 0, 1)
    direction = _unit(offset)
    along_here = abs(own_way @ direction) if here > SHORT and far > 0 else 1.0
    along_there = abs(way @ direction) if there > SHORT and far > 0 else 1.0
    return (
        front * _cone(far, there) * along_there
        + behind * _cone(far, here) * along_here
        + 2 * _cylinder(far, min(there, here)) * max(along_here, along_there)
    )


def _farthest(motion, span):
    """The time at which it is farthest from its place: at an end, or where it turns."""
    velocity, curvature = (motion[2:] - motion[:2]) / 2, (motion[2:] + motion[:2]) / 2
    bend = curvature @ curvature
    turn = _within(-0.5 * (velocity @ curvature) / max(bend, 1e-30), *span)
    return max((span[1], span[0], turn), key=lambda t: np.hypot(*displacement(motion, t)))


def _streak(motion, span):
    return np.hypot(*displacement(motion, _farthest(motion, span)))


def _direction(motion, span):
    """Of the farthest place, as it is after time 0."""
    when = _farthest(motion, span)
    return np.sign(when) * _unit(displacement(motion, when))


def _held(motion, span, edge):
    return motion * min(1, edge / max(_streak(motion, span), 1e-6))


def _fastest(motion, span, edge):
    height, width = motion.shape[:2]
    found = np.zeros((-(-height // edge), -(-width // edge), 4))
    for j, i in np.ndindex(found.shape[:2]):
        inside = motion[j * edge : (j + 1) * edge, i * edge : (i + 1) * edge].reshape(-1, 4)
        found[j, i] = max(inside, key=lambda m: _streak(m, span))
    return found


def _dominant(fastest, span, published=False):
    found = np.zeros_like(fastest)
    rows, columns = fastest.shape[:2]
    for j, i in np.ndindex(rows, columns):
        candidates = []
        for dj in (-1, 0, 1):
            for di in (-1, 0, 1):
                if not (0 <= j + dj < rows and 0 <= i + di < columns):
                    continue
                motion = fastest[j + dj, i + di]
                along = displacement(motion, span[1]) - displacement(motion, span[0])
                if published and di and dj and along[0] * di * along[1] * dj <= 0:
                    continue  # it does not come this way
                candidates.append(motion)
        found[j, i] = max(candidates, key=lambda m: _streak(m, span))
    return found


def _tile(x, y, noise, edge, shape):
    at = np.array([x + 0.5, y + 0.5]) / edge
    at += 0.5 * (np.array([noise, (8 * noise + 0.5) % 1]) - 0.5)
    i, j = (int(_within(v, 0, n - 1)) for v, n in zip(at, shape[1::-1], strict=True))
    return j, i


def _own_direction(own, dominant, trust):
    along = _unit(dominant)
    across = np.array([-along[1], along[0]])
    if across @ own < 0:
        across = -across
    return _unit((1 - trust) * across + trust * own)


def _own(color, weight, y, x):
    if weight is None:
        return color[y, x]
    return color[y, x] / weight[y, x] if weight[y, x] > 0 else 0 * color[y, x]


def _unit(v):
    return v / max(math.hypot(*v), 1e-6)


def _within(value, low, high):
    return min(max(value, low), high)


def _depth(depth, y, x):
    if depth is None:
        return 1.0
    z = float(depth[y, x])
    return min(z, FAR) if np.isfinite(z) and z > 0 else FAR


def _cone(far, length):
    return _within(1 - far / length, 0, 1)


def _cylinder(far, length):
    u = _within((far - 0.95 * length) / (0.1 * length), 0, 1)
    return 1 - u * u * (3 - 2 * u)
