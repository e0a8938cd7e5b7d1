"""Rosado's way, pixel by pixel: depth -> world position -> clip position elsewhere -> pixels."""

import numpy as np

from twins.tap import displacement

NEAREST = 1e-4  # of its distance: closer to the camera plane than this is behind it


def velocity(depth, ids, here, prev, next_, *, window, kind="planar", far=1e9):
    """to_prev, to_next of every pixel; cameras have clip_from_world, view_from_world, bodies."""
    height, width = depth.shape
    world_from_clip = np.linalg.inv(here.clip_from_world)
    out = np.zeros((height, width, 4))
    for y in range(height):
        for x in range(width):
            out[y, x] = _pixel(x, y, float(depth[y, x]), int(ids[y, x]), here, prev, next_,
                               world_from_clip, window, kind, far)  # fmt: skip
    return out


def combined(camera, vectors, nothing, *, added=False, scale=None, max_blur=None, span=(0, 0)):
    """Vectors before the camera's motion, or added to it; scaled; the streak limited."""
    out = np.array(camera, float)
    for y, x in np.ndindex(out.shape[:2]):
        if added:
            out[y, x] += vectors[y, x]
        elif not nothing[y, x]:
            out[y, x] = vectors[y, x]
        if scale is not None:
            out[y, x] *= scale[y, x]
        if max_blur is not None:
            times = np.linspace(*span, 401)[:, None]
            places = displacement(out[y, x], times)
            ends = places[[0, -1]]
            streak = max(np.hypot(*(places - end).T).max() for end in ends)
            out[y, x] *= min(1, max_blur / max(streak, 1e-6))
    return out


def _pixel(x, y, z, body, here, prev, next_, world_from_clip, window, kind, far):
    left, top, width, height = window
    ndc = np.array([2 * (x + 0.5 + left) / width - 1, 1 - 2 * (y + 0.5 + top) / height])
    orthographic = np.abs(here.clip_from_world[3, :3]).max() == 0
    nothing = not np.isfinite(z) or (
        kind == "planar" and (z >= far or (z <= 0 and not orthographic))
    )
    if nothing and orthographic:
        return np.zeros(4)
    point = _world(ndc, z, here, world_from_clip, kind, nothing)
    ways = []
    for there in (prev, next_):
        ways.append(
            None if there is None else _way(point, body, ndc, here, there, nothing, width, height)
        )
    back, ahead = ways
    if back is None and ahead is None:
        return np.zeros(4)
    if back is None:
        back = -ahead
    if ahead is None:
        ahead = -back
    return np.concatenate([back, ahead])


def _world(ndc, z, here, world_from_clip, kind, nothing):
    """Homogeneous world position; a direction (w = 0) where nothing is there."""
    if kind == "clip" and not nothing:
        return world_from_clip @ np.array([*ndc, z, 1.0])
    near, beyond = (world_from_clip @ np.array([*ndc, k, 1.0]) for k in (-0.5, 0.5))
    near, beyond = near / near[3], beyond / beyond[3]
    direction = beyond - near
    axis = -here.view_from_world[2]  # distance along the view axis, of a homogeneous point
    if nothing:
        return direction * np.sign(axis @ direction)
    return near + direction * (z - axis @ near) / (axis @ direction)


def _way(point, body, ndc, here, there, nothing, width, height):
    moved = point
    if not nothing and body in here.bodies and body in there.bodies:
        moved = there.bodies[body] @ np.linalg.inv(here.bodies[body]) @ point
    clip, own = there.clip_from_world @ moved, here.clip_from_world @ point
    if clip[3] / own[3] <= NEAREST:
        return None
    return (clip[:2] / clip[3] - ndc) * np.array([width, -height]) / 2
