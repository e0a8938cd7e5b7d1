"""Depth-tested time slices, one sample and one pixel at a time."""

import numpy as np

from twins.tap import bilinear, displacement

FAR = 1e10


def reproject(sources, times):
    """Mean over `times` of what is nearest; sources: (offset, color, motion, depth), own first."""
    height, width, channels = sources[0][1].shape
    total, count = np.zeros((height, width, channels)), np.zeros((height, width))
    for t in times:
        seen = _nearest(sources, t, height, width)
        for (y, x), (_, _, _, source, row, column) in seen.items():
            offset, color, motion, _ = sources[source]
            way = displacement(motion[row, column].astype(float), t - offset)
            total[y, x] += bilinear(color, x + 0.5 - way[0], y + 0.5 - way[1])
            count[y, x] += 1
    mean = total / np.maximum(count, 1)[..., None]
    return np.where(count[..., None] > 0, mean, sources[0][1]), count


def _nearest(sources, t, height, width):
    """The sample that is seen at every pixel: own frame first, then depth, then index."""
    seen = {}
    for source, (offset, _, motion, depth) in enumerate(sources):
        for row in range(height):
            for column in range(width):
                way = displacement(motion[row, column].astype(float), t - offset)
                x, y = column + way[0], row + way[1]
                z = depth[row, column]
                z = float(z) if np.isfinite(z) and z > 0 else FAR
                for j in (int(np.floor(y)), int(np.floor(y)) + 1):
                    for i in (int(np.floor(x)), int(np.floor(x)) + 1):
                        off = abs(i - x), abs(j - y)
                        if not (0 <= i < width and 0 <= j < height) or max(off) >= 1:
                            continue
                        key = np.float32(z * (1 + 0.004 * sum(off)))
                        candidate = (source > 0, key, source, source, row, column)
                        if (j, i) not in seen or candidate < seen[j, i]:
                            seen[j, i] = candidate
    return seen
