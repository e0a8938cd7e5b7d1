"""The torusphere accelerator: an orbiting sphere becomes a turning torus, and that the sphere.

P. Cusa, "Motion Blur All the Way Down", 2022. Times are the page's iTime [s].
"""

from __future__ import annotations

import math

import numpy as np

from ..errors import InputError
from .scene import CameraPath, Scene
from .volumes import Backdrop, Instant, OrbitingSphere, Torus

TURN = 2 * math.pi
BEGIN = 25.0  # seconds of the animation that have passed at iTime 0
KAPPA = 0.38  # minor / major radius of the torus
CYCLE = math.log((1 + KAPPA) / KAPPA)  # sphere -> torus -> sphere, in remapped time
HALF = CYCLE / 2
WHIRL = TURN * round(30 / (0.015 * TURN))  # scale of the speeds: whole turns [rad/s]
ZOOM = math.log(64)  # of the ground's grids, in remapped time, until they repeat
DISTANCE = 2.4  # of the camera
EXPOSURE = 1 / 30  # seconds: two frames of 60 a second


def remapped(time: float) -> float:
    """The animation's own time, which lingers at the sphere and at the torus."""
    a = 0.015 * (time + BEGIN)
    s = 0.5 + 3.4 * math.pi * a / HALF
    return 1.7 * a + 0.06 * math.sin(s + 0.75 * math.sin(s + 0.5 * math.sin(s + 0.3 * math.sin(s))))


def _blend(x: float) -> float:
    """0 where there is only the sphere, 1 where there is only the torus."""
    y = 2 * (abs((x - HALF / 4) % CYCLE - HALF) / HALF - 0.5) + 0.5
    v = 2 * min(max(y, 0.0), 1.0) - 1
    return 0.5 + v / (v * v + 1)


def _turning(x: float) -> tuple[float, float]:
    """Speed [rad/s] and angle [rad] of a body whose phase is x."""
    if x % CYCLE < HALF:
        return 0.0, 0.0
    speed = 0.04 * WHIRL * (math.cos(TURN * x / CYCLE) + 1)
    angle = WHIRL * (math.sin(TURN * x / CYCLE) * CYCLE / TURN + x) / CYCLE
    return speed, angle % TURN


def instant(time: float) -> Instant:
    """Sphere, torus and backdrop at `time`."""
    x = remapped(time)
    sphere_phase, torus_phase = x % CYCLE, (x + HALF) % CYCLE
    (sphere_speed, sphere_angle), (torus_speed, torus_angle) = _turning(x), _turning(x + HALF)
    size = math.exp(-torus_phase)
    major = size / (1 + KAPPA)
    u = min(max(sphere_phase - HALF, 0.0), 0.2) - 0.1
    torus_share, torus_facing = _blend(x), _blend(x + 0.06)
    sphere = OrbitingSphere(
        radius=math.exp(-sphere_phase - HALF),
        orbit=(0.5 + 10 * u / (100 * u * u + 1)) * major,
        speed=sphere_speed,
        phase=sphere_angle,
        opacity=(1 - torus_share) * (1 + 0.00013 * sphere_speed**2),
        facing=1 - torus_facing,
    )
    torus = Torus(
        minor_radius=major * KAPPA,
        major_radius=major,
        speed=-torus_speed,
        phase=-torus_angle,
        opacity=torus_share * (1.5 + 0.00015 * torus_speed**2),
        facing=torus_facing,
        swell=max(1.0, 8 * (torus_phase - 0.76)),
    )
    parts = [k / 3 for k in range(3)]
    backdrop = Backdrop(
        grids=tuple(
            (7 * math.exp(-((x + ZOOM * p) % ZOOM)), (1 - math.cos(TURN * (p + x / ZOOM))) / 6)
            for p in parts
        ),
        strobe=(83 * time % TURN, 0.05 * (math.sin(2.2 + TURN * x / HALF) + 1)),
        bound=math.exp(-min(torus_phase, 5 * (CYCLE - (x - HALF) % CYCLE))),
        grain=round(1e3 * time) % 2**32,
    )
    return (sphere, torus), backdrop


def torusphere(cam_x: float = 0.0, cam_y: float = 0.0, density: str = "exact") -> Scene:
    """The loop of 50 s; `cam_x` turns the camera [rad], `cam_y` raises it, -1 to 0.75 [rad]."""
    if not -1 <= cam_y <= 0.75:
        raise InputError(f"cam_y must be -1 to 0.75, got {cam_y}")

    def turn(t: np.ndarray) -> np.ndarray:
        return 0.05 * t + 0.75 * math.pi + cam_x

    raised = 0.75 + cam_y
    x, y = DISTANCE * math.cos(raised), DISTANCE * math.sin(raised)
    shot = CameraPath(
        lambda t: (x * np.sin(turn(t)), y + 0 * t, x * np.cos(turn(t))),
        yaw=turn,
        pitch=lambda t: -raised + 0 * t,
        zoom=lambda t: 2 + 0 * t,
    )
    return Scene(
        "torusphere",
        (),
        shot,
        volumes=instant,
        density=density,
        exposure=(EXPOSURE, "cosine"),
        loop=50.0,
    )
