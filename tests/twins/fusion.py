"""Weighted fusion, one pixel and one sample at a time."""

import numpy as np

from twins.tap import bilinear, displacement, source

MIN_SLOPE, MIN_COSINE = 2e-5, 1e-3


def fusion(color, motion, depth, times, middle, alphas, *, span=None, delay=(0.0, 0.0),
           printed=False, tau=1.0, normal=None, weight=None):  # fmt: skip
    """`times` of the samples and `middle` of the exposure; without `span`, the paper's steps.

    `alphas`: in front, behind. `normal`: (height, width, 2) in the picture, x right, y down.
    """
    height, width = depth.shape
    soft = gaussian(color)
    soft_weight = None if weight is None else gaussian(weight[..., None])[..., 0]
    count = len(times)
    fade = np.array([tau ** (count - 1 - i) for i in range(count)])
    out = np.zeros(color.shape)
    for y in range(height):
        for x in range(width):
            path = motion[y, x].astype(float)
            opens, closes = span or (-0.5, 0.0)
            if span is None:
                path = np.concatenate([path[:2], -path[:2]])
            late = delay[0] * ((x + 0.5) / width - 0.5) + delay[1] * ((y + 0.5) / height - 0.5)
            ends = [displacement(path, t) for t in _instants(path, opens + late, closes + late)]
            if max(map(np.linalg.norm, ends)) < 0.01:
                out[y, x] = color[y, x]
                continue
            velocity = (path[2:] - path[:2]) / 2
            if normal is not None and normal[y, x].any():
                n = normal[y, x]
                ahead = n[:2] @ velocity > MIN_COSINE * np.linalg.norm(n) * np.linalg.norm(velocity)
            else:
                ahead = faces_motion(depth, x, y, velocity)
            alpha = alphas[0] if ahead else alphas[1]
            if printed:  # equation 8
                sharp, each = 1.0, alpha * (1 - tau) * fade
            else:
                share = min(alphas) / alpha
                sharp, each = 1 - share, share * fade / fade.sum()
            if span is not None:
                blur_length = min(1.0, max(np.linalg.norm(a - b) for a in ends for b in ends))
                sharp, each = sharp + each.sum() * (1 - blur_length), each * blur_length
            here = np.array([x + 0.5, y + 0.5])

            def moved(t, x=x, y=y, path=path):
                return displacement(path, -t) if span is None else source(motion, y, x, t)

            at = here + moved(middle + late)
            total = sharp * bilinear(color, *at)
            counted = sharp * (1.0 if weight is None else bilinear(weight, *at))
            places = here + moved(np.reshape(times, (-1, 1)) + late)
            for at, share in zip(places, each, strict=True):
                total = total + share * bilinear(soft, *at)
                counted += share * (1.0 if weight is None else bilinear(soft_weight, *at))
            if weight is not None:
                if counted <= 0:
                    total, counted, sharp = color[y, x], max(weight[y, x], 1e-30), 1 - each.sum()
                total = total / counted * (sharp + each.sum())
            out[y, x] = total
    return out


def _instants(path, opens, closes):
    """Times at which the shutter opens and closes, and at which the path turns between them."""
    velocity, half_acceleration = (path[2:] - path[:2]) / 2, (path[2:] + path[:2]) / 2
    turn = -0.5 * (velocity @ half_acceleration) / max(half_acceleration @ half_acceleration, 1e-30)
    return opens, min(max(turn, opens), closes), closes


def gaussian(image):
    """1 2 1 along rows and columns, edges repeated; sixteenths."""
    padded = np.pad(image.astype(float), ((1, 1), (1, 1), (0, 0)), mode="edge")
    out = np.zeros(image.shape)
    for j, a in enumerate((1, 2, 1)):
        for i, b in enumerate((1, 2, 1)):
            out += a * b / 16 * padded[j : j + image.shape[0], i : i + image.shape[1]]
    return out


def faces_motion(depth, x, y, velocity):
    """True if depth grows in the direction of this pixel's motion."""
    z = float(depth[y, x])
    if not np.isfinite(z) or z <= 0:
        return False
    slope = np.array([_slope(depth, x, y, 1, 0), _slope(depth, x, y, 0, 1)])
    return slope @ velocity > MIN_SLOPE * z * np.linalg.norm(velocity)


def _slope(depth, x, y, dx, dy):
    height, width = depth.shape
    here, sides = float(depth[y, x]), []
    for sign in (1, -1):
        i, j = x + sign * dx, y + sign * dy
        if 0 <= i < width and 0 <= j < height and np.isfinite(depth[j, i]) and depth[j, i] > 0:
            sides.append(sign * (float(depth[j, i]) - here))
    return min(sides, key=abs, default=0.0)
