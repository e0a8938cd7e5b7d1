"""Depth-tested time slices, one sample and one pixel at a time."""

from functools import cache

import numpy as np

from twins.five_positions import bend, moved, valid
from twins.tap import bilinear, displacement


def reproject(sources, times):
    """Mean over `times` of what is nearest; sources: (offset, color, motion, depth), own first."""
    height, width, channels = sources[0][1].shape
    total, count = np.zeros((height, width, channels)), np.zeros((height, width))
    paths = [_paths(source, sources) for source in sources]
    for t in times:
        seen = _nearest(sources, paths, t, height, width)
        for (y, x), (_, _, _, source, row, column) in seen.items():
            offset, color = sources[source][:2]
            way = moved(paths[source][row, column], t - offset)
            total[y, x] += bilinear(color, x + 0.5 - way[0], y + 0.5 - way[1])
            count[y, x] += 1
    mean = total / np.maximum(count, 1)[..., None]
    return np.where(count[..., None] > 0, mean, sources[0][1]), count


def _paths(source, sources):
    """Velocity, half acceleration, third term in half precision, 1 where it has a kink."""
    offset, _, motion, depth = source
    at = {one[0]: one for one in sources}
    motion, z = motion.astype(float), valid(depth)
    path = np.zeros((*z.shape, 7))
    path[..., :2] = (motion[..., 2:] - motion[..., :2]) / 2
    path[..., 2:4] = (motion[..., 2:] + motion[..., :2]) / 2
    for y, x in np.ndindex(z.shape):
        bent = bend(motion[y, x], z[y, x], y, x, at.get(offset - 1), at.get(offset + 1))
        path[y, x, 4:] = np.float16(bent)
    return path


def _nearest(sources, paths, t, height, width):
    """The sample that is seen at every pixel: own frame first, then depth, then index."""
    seen = {}
    for source, (offset, _, _, depth) in enumerate(sources):
        for row in range(height):
            for column in range(width):
                way = moved(paths[source][row, column], t - offset)
                x, y = column + way[0], row + way[1]
                z = float(valid(depth[row, column]))
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


UNIT = 1024


def published(color, samples, movers, *, line=False, nearest=False):
    """Taylor's two cycles: mean of all that is rounded to a pixel, and what was counted.

    `movers`: of each frame its colours and a function of column, row and share of the way to
    the other frame, which returns place [px] and depth there, or None where it is not seen.
    """
    height, width = color.shape[:2]
    total, count = np.zeros(color.shape), np.zeros((height, width))
    shares = np.linspace(0, 1, samples) if samples > 1 else np.zeros(1)
    for colors, mover in movers:
        for step, share in enumerate(shares):
            after = shares[min(step + 1, samples - 1)]
            best = {}
            for row in range(height):
                for column in range(width):
                    seen = mover(column, row, share)
                    if seen is None:
                        continue
                    start, depth = seen
                    way = mover(column, row, after, True)[0] - start if line else np.zeros(2)
                    points = max(1, int(np.ceil(np.abs(way).max())))
                    for i in range(points):
                        x, y = np.floor(start + way * i / points).astype(int)
                        if 0 <= x < width and 0 <= y < height:
                            part = (UNIT // points) / UNIT
                            best.setdefault((y, x), []).append((depth, row, column, part))
            for at, hits in best.items():
                for _, row, column, part in [min(hits)] if nearest else hits:
                    total[at] += part * colors[row, column]
                    count[at] += part
    mean = total / np.maximum(count, 1e-9)[..., None]
    return np.where(count[..., None] > 0, mean, color), count / (2 * samples)


def along(motion, depth, sign):
    """A mover for `published` along each pixel's path; `sign`: towards -1 or 1."""

    def move(column, row, share, _=False):
        z = depth[row, column]
        way = displacement(motion[row, column].astype(float), sign * share)
        return np.array([column, row]) + 0.5 + way, z if np.isfinite(z) and z > 0 else 1e30

    return move


def by_camera(depth, normal, here, there, facing=False):
    """A mover by cameras between `here` and `there`; `normal` in the world, 0 for none."""
    height, width = depth.shape
    eye, world_from_clip = np.linalg.inv(here.view_from_world), np.linalg.inv(here.clip_from_world)

    def place(column, row):
        x, y = (column + 0.5) / width * 2 - 1, 1 - (row + 0.5) / height * 2
        ends = [world_from_clip @ (x, y, z, 1.0) for z in (-0.5, 0.5)]
        ends = [end[:3] / end[3] for end in ends]
        axis, start = -eye[:3, 2], ends[0]
        way = ends[1] - ends[0]
        return start + way * (depth[row, column] - axis @ (start - eye[:3, 3])) / (axis @ way)

    def surface(column, row):
        if normal is not None:
            return normal[row, column]
        middle, tangents = place(column, row), []
        for i, j in ((1, 0), (0, 1)):
            sides = [
                (column + s * i, row + s * j, s)
                for s in (-1, 1)
                if 0 <= column + s * i < width and 0 <= row + s * j < height
            ]
            ways = [s * (place(x, y) - middle) for x, y, s in sides]
            tangents.append(min(ways, key=np.linalg.norm) if ways else np.zeros(3))
        n = np.cross(*tangents)
        return n if n @ (eye[:3, 3] - middle) > 0 else -n

    @cache
    def on_the_way(share):
        camera = here.toward(there, share)
        return camera, np.linalg.inv(camera.view_from_world)[:3, 3]

    def move(column, row, share, whatever=False):
        (camera, at), point = on_the_way(share), place(column, row)
        if facing and not whatever and surface(column, row) @ (at - point) < 0:
            return None
        clip = camera.clip_from_world @ (*point, 1.0)
        ndc = clip[:2] / clip[3]
        return np.array([(ndc[0] + 1) * width, (1 - ndc[1]) * height]) / 2, clip[3]

    return move
