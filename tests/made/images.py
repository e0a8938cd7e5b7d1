"""Frames and cameras that the tests of several parts are about."""

import numpy as np

import wgmb
from wgmb import Camera


def crossing(size, offset, seed=0, wall=True, turns=False):
    """A box over a wall, both moving and textured, as a renderer with antialiasing sees it.

    Without the `wall`, over nothing, with the vectors of the middles of pixels. A box that `turns`
    moves within its outline, which rests, as the wall does.
    """
    rng = np.random.default_rng(seed)
    height, width = size
    fine = 4
    y, x = (np.mgrid[: height * fine, : width * fine] + 0.5) / fine
    waves = rng.normal(size=(2, 4, 3))
    # Of wall and box [px a frame].
    speeds = np.array([[0.0, 0.0], [-3.0, 0.6]] if turns else [[1.5, -0.5], [-14.0, 6.0]])
    depths = np.array([9.0, 4.0])
    bend = np.array([[0, 0], [0.5, 1.0]])
    way = [v * offset + b * offset**2 for v, b in zip(speeds, bend, strict=True)]
    left, down = (0.0, 0.0) if turns else way[1]
    box = (abs(x - width / 2 - left) < width / 6) & (abs(y - height / 2 - down) < height / 4)
    which = box.astype(int)
    color = np.zeros((*which.shape, 4))
    for k in (0, 1):
        px, py = x - way[k][0], y - way[k][1]
        tone = np.zeros((*x.shape, 3))
        for n in range(4):
            along = px * np.cos(n + k) + py * np.sin(n + k)
            tone += np.sin(0.3 * (n + 1) * along)[..., None] * waves[k, n]
        shade = np.concatenate([0.5 + 0.1 * tone, np.ones((*tone.shape[:2], 1))], axis=2)
        color[which == k] = shade[which == k]
    velocity = speeds + 2 * bend * offset
    vectors = np.concatenate([-velocity + bend, velocity + bend], axis=1)

    def mean(a):
        return a.reshape(height, fine, width, fine, -1).mean(axis=(1, 3)).astype("f4")

    depth, motion = depths[which][::fine, ::fine].astype("f4"), mean(vectors[which])
    if not wall:
        color[which == 0], depth[depth == depths[0]] = 0, np.inf
        motion = vectors[which][::fine, ::fine].astype("f4")
    return mean(color), motion, depth


def blades(size, offset):
    """Blades of grass, a pixel wide, each at a depth of its own, that go two ways."""
    height, width = size
    rng = np.random.default_rng(5)
    color, depth = np.zeros((height, width, 4)), np.full((height, width), 30.0)
    motion = np.zeros((height, width, 4))
    color[:] = 0.2, 0.1, 0.0, 1.0
    for _ in range(3 * width):
        x, top, z = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(2, 12)
        speed, tone = rng.choice((-6.0, 3.0)), rng.uniform(0, 1, 3)
        i, tip = int(x + speed * offset), int(top)
        if 0 <= i < width:
            shown = depth[tip:, i] > z
            color[tip:, i, :3][shown], depth[tip:, i][shown] = tone, z
            motion[tip:, i][shown] = -speed, 0, speed, 0
    return color.astype("f4"), motion.astype("f4"), depth.astype("f4")


def frame_of(sources):
    """The first of (color, motion, depth) with the other two before and after it."""
    own, prev, after = (wgmb.Frame(c, motion=m, depth=d) for c, m, d in sources)
    return wgmb.Frame(own.color, motion=own.motion, depth=own.depth, prev=prev, next=after)


def camera(position, yaw=0.0, pitch=0.0, roll=0.0, zoom=1.7, orthographic=False, bodies=None):
    """A camera looking along -z, turned by radians."""
    rx, ry, rz = (_turn(i, a) for i, a in enumerate((pitch, yaw, roll)))
    world_from_view = np.eye(4)
    world_from_view[:3, :3] = ry @ rx @ rz
    world_from_view[:3, 3] = position
    clip = np.array([[zoom / 1.5, 0, 0, 0], [0, zoom, 0, 0], [0, 0, -1.02, -0.2], [0, 0, -1, 0.0]])
    if orthographic:
        clip = np.array([[0.2, 0, 0, 0], [0, 0.3, 0, 0], [0, 0, -0.02, -1.0], [0, 0, 0, 1.0]])
    view = np.linalg.inv(world_from_view)
    return Camera(clip @ view, view, bodies or {})


def _turn(axis, angle):
    i, j = (axis + 1) % 3, (axis + 2) % 3
    m = np.eye(3)
    m[i, i] = m[j, j] = np.cos(angle)
    m[j, i], m[i, j] = np.sin(angle), -np.sin(angle)
    return m


def body(x, angle):
    m = np.eye(4)
    m[:3, :3] = 1.4 * _turn(1, angle)
    m[:3, 3] = x, 0.3, -6
    return m
