"""The analytic motion blur of turning volumes and its ray march, in float64 over all rays at once.

Everything is written as the article has it: arccos and arctan2, every step of every ray, normals
by differences, revolutions one by one. Angles are relative to the body in mid exposure.
"""

import math

import numpy as np

from wgmb.scene.volumes import OrbitingSphere

TURN = 2 * math.pi


def antiderivative(shutter, shares):
    """The shutter's integral at shares of the exposure, 0 before it, 1 after."""
    x = np.clip(shares, 0, 1)
    if shutter.curve == "box":
        return x
    if shutter.curve == "cosine":
        return x - np.sin(TURN * x) / TURN
    _, integral = shutter.integral(1 << 16)
    return np.interp(x, np.linspace(0, 1, len(integral)), integral)


def occupancy(shutter, theta, h, swept, published):
    """Share of the exposure during which the body, `swept` radians wide in it, covers theta."""
    if published:
        return _crossing(shutter, theta, h, swept)
    reach = math.ceil(swept / 2 / TURN) + 1
    return sum(_crossing(shutter, theta + TURN * k, h, swept) for k in range(-reach, reach + 1))


def _crossing(shutter, theta, h, swept):
    swept = max(swept, 3e-5)
    before, after = (antiderivative(shutter, e / swept + 0.5) for e in (theta - h, theta + h))
    return after - before


def disk_half_angle(r, a, orbit):
    with np.errstate(all="ignore"):
        q = (orbit**2 + r**2 - a**2) / (2 * r * orbit)
        return np.where(a <= 0, 0, np.arccos(np.clip(q, -1, 1)))


def spiric_half_angle(r, c, minor, major):
    with np.errstate(all="ignore"):
        s = minor**2 - major**2 - c**2 - r**2
        product = (s - 2 * major * c) * (s + 2 * major * c)
        q = np.sqrt(np.maximum(product, 0)) / (2 * major * r)
        return np.arccos(np.clip(q, 0, 1))


def wrapped(theta):
    return (theta + np.pi) % TURN - np.pi


def polar(volume, p, middle=0.0):
    """Radius, angle from the body `middle` seconds on, along its turning; third coordinate."""
    q = p - np.array(volume.centre)
    angle = volume.phase + volume.speed * middle
    if isinstance(volume, OrbitingSphere):
        u, v, third = q[..., 0], -q[..., 2], q[..., 1]
    else:
        u, v, third = q[..., 0], q[..., 1], q[..., 2]
    way = -1 if volume.speed < 0 else 1
    theta = way * wrapped(np.arctan2(v, u) - angle)
    return np.hypot(u, v), theta, third


def density(volume, p, shutter, fps, published=False):
    """Share of the exposure during which `volume` is at the points p (..., 3)."""
    opens, closes = shutter.span
    swept = abs(volume.speed) * (closes - opens) / fps
    r, theta, third = polar(volume, p, (opens + closes) / 2 / fps)
    if isinstance(volume, OrbitingSphere):
        a = np.sqrt(np.maximum(volume.radius**2 - third**2, 0))
        return occupancy(shutter, theta, disk_half_angle(r, a, volume.orbit), swept, published)
    h = spiric_half_angle(r, third, volume.minor_radius, volume.major_radius)
    parts = [occupancy(shutter, wrapped(theta + x), h, swept, published) for x in (0, np.pi)]
    always = h >= np.pi / 2
    return np.where(always, 1, np.minimum(sum(parts), 1) if published else sum(parts))


def pseudo_distance(volume, p, shutter, fps):
    """Whose differences are the normals."""
    opens, closes = shutter.span
    speed = 30 * abs(volume.speed) * (closes - opens) / fps
    if isinstance(volume, OrbitingSphere):
        r, theta, third = polar(volume, p, (opens + closes) / 2 / fps)
        u = np.clip((speed - 30) / 10, 0, 1)
        k = 2 * speed * u * u * (3 - 2 * u)
        theta = np.maximum(0, np.abs(theta) - 0.004 * (k + (0.037 * k) ** 3))
        x, z = r * np.cos(theta), r * np.sin(theta)
        return np.sqrt((x - volume.orbit) ** 2 + z**2 + third**2) - volume.radius
    centre = np.array(volume.centre)
    p = centre + volume.swell * (p - centre)
    r, theta, third = polar(volume, p, (opens + closes) / 2 / fps)
    minor, major = volume.minor_radius, volume.major_radius
    x, y = r * np.cos(theta), r * np.sin(theta)
    shell = np.abs(np.sqrt(r**2 + third**2) - major) - 0.3 * minor
    torus = np.hypot(np.hypot(x, third) - major, y) - minor
    a, b = 0.001 * speed - torus, 0.1 - shell
    h = np.maximum(0.1 - np.abs(a - b), 0) / 0.1
    return -(np.minimum(a, b) - h * h * 0.1 / 4)


def normals(volumes, p, shutter, fps):
    """Backward differences of the pseudo distances, mixed by `facing`, or by density."""
    blended = all(v.facing is not None for v in volumes)
    total = np.zeros(p.shape)
    for v in volumes:
        weight = 1.0 if v.facing is None else v.facing
        if not blended:
            weight = weight * v.opacity * density(v, p, shutter, fps)[..., None]
        here = pseudo_distance(v, p, shutter, fps)
        steps = [pseudo_distance(v, p - 0.001 * e, shutter, fps) for e in np.eye(3)]
        total += weight * np.stack([here - s for s in steps], axis=-1)
    return total / np.maximum(np.linalg.norm(total, axis=-1, keepdims=True), 1e-20)


def noise(width, height, grain):
    """The shader's two hashes of every pixel."""
    y, x = np.mgrid[:height, :width].astype(np.uint32)
    with np.errstate(over="ignore"):
        a, b = np.uint32(1664525), np.uint32(1013904223)
        x, y = (x + np.uint32(grain)) * a + b, y * a + b
        for _ in range(2):
            x = x + y * a
            y = y + x * a
            x, y = x ^ (x >> np.uint32(16)), y ^ (y >> np.uint32(16))
    return (x >> np.uint32(8)) / 2**24, (y >> np.uint32(8)) / 2**24


def smoothstep(a, b, x):
    u = np.clip((x - a) / (b - a), 0, 1)
    return u * u * (3 - 2 * u)


def grid_line_integral(x, side):
    cell = x / side
    return (np.floor(cell) + np.minimum(60 * side * (cell - np.floor(cell)), 1)) / 60


def picture(scene, time, shutter, fps, size):
    """(height, width, 3) display values: `scene` at `time` [s] through the method "volume"."""
    volumes, backdrop = scene.instant(time)
    published = scene.density == "published"
    width, height = size
    camera = scene.camera.world_from_camera(time)[0]
    zoom = float(np.ravel(scene.camera.zoom(np.array([time])))[0])
    eye, right, up, forward = camera[:3, 3], camera[:3, 0], camera[:3, 1], -camera[:3, 2]

    def ray(dx, dy):
        y, x = np.mgrid[:height, :width] + 0.5
        across = (x + dx - width / 2) / (height / 2) / zoom
        above = (height / 2 - y + dy) / (height / 2) / zoom
        return across[..., None] * right + above[..., None] * up + forward

    def unit(v):
        return v / np.linalg.norm(v, axis=-1, keepdims=True)

    direction, light = unit(ray(0, 0)), unit(np.array(backdrop.light))
    bound = backdrop.bound or max(math.dist((0, 0, 0), v.centre) + v.reach for v in volumes)
    columns = (np.arange(width) + 0.5) / width
    flicker = np.sin(backdrop.strobe[0] + np.pi * smoothstep(0.4, 0.6, columns)) + 1
    strobe = np.broadcast_to(1 - backdrop.strobe[1] * flicker, (height, width))
    hashes = noise(width, height, backdrop.grain)

    def cloud(p):
        each = [v.opacity * density(v, p, shutter, fps, published)[..., None] for v in volumes]
        total = sum(each)
        tinted = sum(d * np.array(v.color) for d, v in zip(each, volumes, strict=True))
        return total[..., 0], tinted / np.maximum(total, 1e-12)

    def along(origin, way, step, most, hash_):
        """Every step of every ray within the sphere that is searched."""
        b = (origin * way).sum(-1)
        root = b * b - ((origin**2).sum(-1) - bound**2)
        far = np.sqrt(np.maximum(root, 0))
        start = np.maximum(-b - far, 0) - step * hash_
        for i in range(most):
            t = start + i * step
            yield origin + t[..., None] * way, (root > 0) & (t <= -b + far)

    step = bound / 20
    light_of, cover, shaded = np.zeros((height, width, 3)), np.zeros((height, width)), 0
    for p, inside in along(eye, direction, step, 40, hashes[0]):
        total, color = cloud(p)
        d = np.clip(total * strobe * step / 0.05, 0, 1)
        alpha = np.where(
            inside & (d > 0.002) & (cover <= 0.95) & (shaded < 30), d * d / 2 * (1 - cover), 0
        )
        n = normals(volumes, p, shutter, fps)
        facing = (n * light).sum(-1, keepdims=True)
        gloss = (direction * (light - 2 * facing * n)).sum(-1, keepdims=True)
        look = color * (0.9 * np.maximum(facing, 0.05) + 0.05 * np.maximum(gloss, 0))
        light_of += alpha[..., None] * look
        cover = cover + alpha
        shaded = shaded + (alpha > 0)

    def ground(dx, dy):
        to = ray(dx, dy)
        with np.errstate(all="ignore"):
            return eye + to * ((backdrop.ground - eye[1]) / to[..., 1:2])

    down = direction[..., 1] < 0
    at = ground(0, 0)
    at = np.where(down[..., None], at, 0.0)
    footprint = np.maximum(*(np.abs(ground(*d) - at)[..., ::2] for d in ((1, 0), (0, 1))))
    footprint = np.where(down[..., None], np.maximum(footprint, 1e-6), 1.0)
    tint = np.array(backdrop.tint)
    color = np.zeros((height, width, 3)) + tint
    for side, weight in backdrop.grids:
        covered = [grid_line_integral(at[..., ::2] + k * footprint, side) for k in (-0.5, 0.5)]
        covered = (covered[1] - covered[0]) / footprint
        color += (weight * (1 - 0.6 * covered).prod(-1))[..., None]
    q = (at[..., ::2] ** 2).sum(-1)
    pool = 2 / (0.75 * q + 1) - 1.2 / (2.25 * q + 1)
    shadow = np.zeros((height, width))
    for p, inside in along(at, light, 2 * step, 20, hashes[1]):
        d = np.clip(cloud(p)[0] * 0.47 * strobe * 2 * step / 0.05, 0, 1)
        d = np.where(inside & (d > 0.002) & (shadow <= 0.95), 0.9 * d * d, 0)
        shadow = shadow + d * (1 - shadow)
    color = np.where(down[..., None], color * (pool * (1 - 0.7 * shadow))[..., None], tint)
    rise = direction[..., 1:2]
    near = 1 - smoothstep(0, 0.02, np.abs(rise) + 0.003)
    color = color + (0.7 * tint - color) * near
    color = color + (np.array([0, 0, 0.1]) - color) * smoothstep(0, 0.5, rise)
    return np.clip(color * (1 - cover[..., None]) + light_of, 0, 1)
