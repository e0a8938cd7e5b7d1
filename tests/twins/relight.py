"""A neighbour's light made that of the frame, one pixel at a time."""

import numpy as np

from twins.five_positions import moved
from twins.tap import bilinear

TILE, FARTHEST, LEAST = 16, 32, 0.01
DARKEST, BRIGHTEST = np.log(1 / 8), np.log(4)
DISTANCES = [1]
while DISTANCES[-1] * 7 // 5 < FARTHEST:
    DISTANCES.append(max(DISTANCES[-1] + 1, DISTANCES[-1] * 7 // 5))


def gains(own, there, own_color, color, span):
    """Factors (height, width, 3) of the colours of `there`, a neighbour of `own`; both Layers."""
    height, width = there.single.shape
    changes = np.zeros((-(-height // TILE), -(-width // TILE)))
    hidden = np.zeros((height, width), bool)
    for y, x in np.ndindex(height, width):
        at, is_there, hidden[y, x] = shown(own, there, y, x)
        hidden[y, x] = hidden[y, x] and appears(own, there, y, x, at, span)
        if is_there:
            change = ratio(own_color[int(at[1]), int(at[0]), :3], color[y, x, :3])
            changes[y // TILE, x // TILE] += np.abs(change).max() > 0.2
    out = np.ones((height, width, 3))
    for y, x in np.ndindex(-(-height // 2), -(-width // 2)):
        inside = [(2 * y + j, 2 * x + i) for j in (0, 1) for i in (0, 1)]
        inside = [p for p in inside if p[0] < height and p[1] < width and hidden[p]]
        if inside:
            j, i = inside[0][0] // TILE, inside[0][1] // TILE
            if changes[max(j - 2, 0) : j + 3, max(i - 2, 0) : i + 3].max() >= 16:
                gain = gain_at(own, there, own_color, color, *inside[0])
                for p in inside:
                    if alike(there.depth[0][p], there.depth[0][inside[0]], 1.05):
                        out[p] = gain
    return out


def ratio(a, b):
    """Logarithm of the ratio of two colours, none in the dark."""
    return np.log((np.maximum(a, 0) + LEAST) / (np.maximum(b, 0) + LEAST))


def alike(a, b, most):
    """True if two depths differ by a smaller factor."""
    return max(a, b) < most * min(a, b)


def pixel(at, shape):
    """The pixel (y, x) at a place, or the nearest to it."""
    i, j = np.clip(at, 0, np.array(shape[::-1]) - 1).astype(int)
    return j, i


def shown(own, there, y, x):
    """Place of the surface of a neighbour's pixel in the frame, and if it is shown or hidden."""
    size = np.array(there.single.shape[::-1])
    step = moved(there.trajectory[0][y, x], -there.offset)
    at = np.array([x, y]) + 0.5 + step
    inside = (at >= 0.5).all() and (at <= size - 0.5).all()
    j, i = pixel(at, there.single.shape)
    off = step + moved(own.unsplit[j, i], there.offset)
    same = alike(own.unsplit_depth[j, i], there.depth[0][y, x], 1.15) and off @ off < 1
    is_shown = same and own.smooth[j, i]
    is_hidden = inside and there.single[y, x] and not is_shown
    return at, inside and is_shown and there.smooth[y, x], is_hidden


def appears(own, there, y, x, at, span):
    """True if at a time of the exposure what hides a pixel is not before it."""
    hider = own.unsplit[pixel(at, there.single.shape)]
    for t in np.linspace(*span, 4):
        place = np.array([x, y]) + 0.5 + moved(there.trajectory[0][y, x], t - there.offset)
        first = moved(own.unsplit[pixel(place - moved(hider, t), there.single.shape)], t)
        p = pixel(place - first, there.single.shape)
        step, off = moved(own.unsplit[p], t) - first, place - first - at
        found = step @ step < 1 and off @ off > 1
        nearer = own.unsplit_depth[p] < 1.05 * there.depth[0][y, x]
        if not (found and own.smooth[p] and nearer):
            return True
    return False


def gain_at(own, there, own_color, color, y, x):
    """The factor of a hidden pixel's colour, by the nearest places of its surface around it."""
    z, found = there.depth[0][y, x], []
    motion = moved(there.trajectory[0][y, x], -there.offset)
    for j, i in [(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if j or i]:
        for far in DISTANCES:
            p = y + far * j, x + far * i
            inside = 0 <= p[0] < there.single.shape[0] and 0 <= p[1] < there.single.shape[1]
            distance = far * np.hypot(j, i)
            if not inside or not alike(there.depth[0][p], z, 1.05 + 0.01 * distance):
                break
            its_motion = moved(there.trajectory[0][p], -there.offset)
            if np.hypot(*(its_motion - motion)) >= 1 + 0.1 * distance:
                break
            at, is_there, _ = shown(own, there, *p)
            if is_there:
                seen = np.maximum(bilinear(own_color, *at)[:3], 0), np.maximum(color[p][:3], 0)
                found.append((1 / distance**2, *seen, ratio(*seen)))
                break
    if len(found) < 2:
        return np.ones(3)
    shares = [f[0] for f in found]
    mine, its, mean = (np.average([f[k] for f in found], axis=0, weights=shares) for k in (1, 2, 3))
    square = np.average([f[3] ** 2 for f in found], axis=0, weights=shares)
    change = np.abs(ratio(mine, its)) - 0.5 * np.sqrt(np.maximum(square - mean**2, 0))
    trust = sum(shares) / (sum(shares) + 1 / 8**2)
    gain = trust * np.clip(change.max() / 0.1 - 1, 0, 1) * ratio(mine, its)
    if not gain.any():
        return np.ones(3)
    steps = np.round(np.clip((gain - DARKEST) / (BRIGHTEST - DARKEST), 0, 1) * 1023)
    return np.exp(DARKEST + steps / 1023 * (BRIGHTEST - DARKEST))
