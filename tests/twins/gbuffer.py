"""A ray caster in double precision: every ray tries every surface of every body at exact poses."""

from dataclasses import dataclass

import numpy as np

FAR = 1e10
CLOSE = 1e-3  # of a ray's start: the surface it left
SHADE = 0.18
TAU = 2 * np.pi


@dataclass
class Seen:
    """The hits of all rays of (..., 3)."""

    depth: np.ndarray  # along the ray, FAR: nothing
    body: np.ndarray  # index into scene.bodies, -1: nothing
    at: np.ndarray  # in the body's own space
    surface: np.ndarray  # normal there


def see(scene, size, seconds, fps=24.0):
    """depth, normal, object_id, color and motion (to_prev, to_next [px]) of every pixel."""
    origin, direction = rays(scene, size, seconds)
    seen = meet(scene, seconds, origin, direction)
    there = seen.body >= 0
    motion = [
        _pixels(scene, size, seconds + k / fps, _then(scene, seen, direction, seconds + k / fps))
        - _pixels(scene, size, seconds, _then(scene, seen, direction, seconds))
        for k in (-1, 1)
    ]
    return {
        "depth": seen.depth,
        "normal": np.where(there[..., None], _normal(scene, seconds, seen, direction), 0),
        "object_id": seen.body + 1,
        "color": _radiance(scene, size, seconds, seen, origin, direction),
        "motion": np.concatenate(motion, axis=-1),
    }


def rays(scene, size, seconds):
    """Origins and directions (height, width, 3) through the pixels' middles, 1 long in depth."""
    width, height = size
    y, x = np.mgrid[:height, :width] + 0.5
    zoom = float(np.ravel(scene.camera.zoom(np.array([seconds])))[0])
    camera = scene.camera.world_from_camera(seconds)[0]
    right, up = (x - width / 2) / (height / 2) / zoom, (height / 2 - y) / (height / 2) / zoom
    direction = np.stack([right, up, -np.ones_like(right)], -1) @ camera[:3, :3].T
    return np.broadcast_to(camera[:3, 3], direction.shape), direction


def meet(scene, seconds, origin, direction) -> Seen:
    """The nearest hit of every ray."""
    shape = origin.shape[:-1]
    best = Seen(
        np.full(shape, FAR), np.full(shape, -1), np.zeros((*shape, 3)), np.zeros((*shape, 3))
    )
    for index, body in enumerate(scene.bodies):
        inverse = np.linalg.inv(body.world_from_body(seconds)[0])
        o = origin @ inverse[:3, :3].T + inverse[:3, 3]
        d = direction @ inverse[:3, :3].T
        for t, normal in SURFACES[body.shape](o, d):
            nearer = (t >= CLOSE) & (t < best.depth)
            best.depth = np.where(nearer, t, best.depth)
            best.body = np.where(nearer, index, best.body)
            best.at = np.where(nearer[..., None], o + np.nan_to_num(t)[..., None] * d, best.at)
            best.surface = np.where(nearer[..., None], normal, best.surface)
    return best


# ---- surfaces: where a ray meets each, NaN where it does not, and the normal there -------------


def _sphere(o, d):
    for t in _roots((d * d).sum(-1), (o * d).sum(-1), (o * o).sum(-1) - 1):
        yield t, o + np.nan_to_num(t)[..., None] * d


def _box(o, d):
    for axis in range(3):
        for side in (-1.0, 1.0):
            t, at, normal = _plane(o, d, axis, side)
            others = np.delete(at, axis, axis=-1)
            yield np.where((np.abs(others) <= 1).all(-1), t, np.nan), normal


def _cylinder(o, d):
    p, q = o[..., :2], d[..., :2]
    for t in _roots((q * q).sum(-1), (p * q).sum(-1), (p * p).sum(-1) - 1):
        at = o + np.nan_to_num(t)[..., None] * d
        yield np.where(np.abs(at[..., 2]) <= 1, t, np.nan), at * (1, 1, 0)
    for side in (-1.0, 1.0):
        t, at, normal = _plane(o, d, 2, side)
        yield np.where((at[..., :2] ** 2).sum(-1) <= 1, t, np.nan), normal


SURFACES = {"sphere": _sphere, "box": _box, "cylinder": _cylinder}


def _roots(a, b, c):
    """Both t with a t^2 + 2 b t + c = 0."""
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0))
    a = np.where(a == 0, 1e-300, a)
    with np.errstate(over="ignore"):
        return [np.where(square > 0, (-b + sign * root) / a, np.nan) for sign in (-1, 1)]


def _plane(o, d, axis, side):
    safe = np.where(d[..., axis] == 0, 1e-300, d[..., axis])
    with np.errstate(over="ignore"):
        t = np.clip((side - o[..., axis]) / safe, -1e30, 1e30)
    return t, o + t[..., None] * d, side * np.eye(3)[axis]


# ---- light ---------------------------------------------------------------------------------------


def _normal(scene, seconds, seen, direction):
    """Unit length, in the world, towards where the ray came from."""
    normal = np.zeros_like(seen.surface)
    for index, body in enumerate(scene.bodies):
        turned = seen.surface @ np.linalg.inv(body.world_from_body(seconds)[0][:3, :3])
        normal = np.where((seen.body == index)[..., None], turned, normal)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    away = (normal * direction).sum(-1, keepdims=True) > 0
    return np.where(away, -normal, normal)


def _radiance(scene, size, seconds, seen, origin, direction):
    view = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    high = np.clip(view[..., 1:2] / 0.6, 0, 1)
    high = high * high * (3 - 2 * high)
    sky = (1 - high) * scene.horizon + high * scene.sky[:3]

    normal = _normal(scene, seconds, seen, direction)
    there = seen.body >= 0
    sun = np.array(scene.sun[:3]) / np.linalg.norm(scene.sun[:3])
    at = origin + np.where(there, seen.depth, 0)[..., None] * direction
    blocked = (
        meet(scene, seconds, at + 4 * CLOSE * normal, np.broadcast_to(sun, at.shape)).body >= 0
    )
    lit = np.maximum(normal @ sun, 0) * np.where(blocked, SHADE, 1) * scene.sun[3]
    around = scene.sky[3] * (0.55 + 0.45 * (0.5 + 0.5 * normal[..., 1]))
    mirrored = view - 2 * (view * normal).sum(-1, keepdims=True) * normal
    shine = np.maximum(mirrored @ sun, 0) ** 40 * ~blocked * scene.sun[3]

    color = sky
    for index, body in enumerate(scene.bodies):
        share = _share(body, seen)[..., None]
        paint = (1 - share) * body.color + share * body.second_color
        own = paint * (lit + around + body.emission)[..., None] + (body.specular * shine)[..., None]
        color = np.where((seen.body == index)[..., None], own, color)
    return color


def _share(body, seen):
    """Of the second colour: 0 or 1, as a pattern is without any filter. Not for BRICKS."""
    at, side = seen.at, np.abs(seen.surface)
    if body.pattern == "PLAIN":
        return np.zeros(at.shape[:-1])
    u, v = _flat(at * body.size, side)
    if body.shape == "sphere":
        u = np.arctan2(at[..., 2], at[..., 0]) / TAU
        v = np.arcsin(np.clip(at[..., 1], -1, 1)) / TAU
    if body.shape == "cylinder":
        tube = side[..., 2] == 0
        u = np.where(tube, np.arctan2(at[..., 1], at[..., 0]) / TAU, u)
        v = np.where(tube, at[..., 2] * body.size[2], v)
    u, v = u * body.repeats[0], v * body.repeats[1]
    second = {
        "CHECKER": (u % 1 < 0.5) != (v % 1 < 0.5),
        "STRIPES": u % 1 >= 0.5,
        "DOTS": np.hypot(u % 1 - 0.5, v % 1 - 0.5) < 0.3,
    }
    return second[body.pattern].astype(float)


def _flat(p, side):
    """The two coordinates along the face that the normal stands on."""
    x, y = side[..., 0] == 1, side[..., 1] == 1
    u = np.where(x, p[..., 2], p[..., 0])
    v = np.where(y, p[..., 2], p[..., 1])
    return u, v


# ---- motion --------------------------------------------------------------------------------------


def _then(scene, seen, direction, seconds):
    """Homogeneous world positions at another time of what every ray met; the sky is far away."""
    point = np.concatenate([direction, np.zeros_like(direction[..., :1])], -1)
    for index, body in enumerate(scene.bodies):
        own = np.concatenate([seen.at, np.ones_like(seen.at[..., :1])], -1)
        moved = own @ body.world_from_body(seconds)[0].T
        point = np.where((seen.body == index)[..., None], moved, point)
    return point


def _pixels(scene, size, seconds, point):
    width, height = size
    zoom = float(np.ravel(scene.camera.zoom(np.array([seconds])))[0])
    seen = point @ np.linalg.inv(scene.camera.world_from_camera(seconds)[0]).T
    flat = seen[..., :2] / -seen[..., 2:3] * zoom * (height / 2)
    return np.stack([width / 2 + flat[..., 0], height / 2 - flat[..., 1]], -1)
