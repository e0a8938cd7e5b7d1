"""Difference between perceived videos and perceived nature, by shutter (Cusa 2022)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..charts import Chart
from ..cone import VIDEOS, Cone
from ..errors import InputError
from ..shutter import Shutter

TURN = 2 * math.pi


def difference(shutter: Shutter, speed: float, fps: float, cone: Cone | None = None) -> float:
    """Return the difference between a perceived video and perceived nature.

    A disk of radius 0.1 runs at `speed` [rad/s] on a circle of 0.2; `shutter` exposes its video of
    `fps` frames per second. Frames and windows are centred alike. Mean absolute difference of 0..1
    over the ring that the disk sweeps, at four times within a frame.
    """
    if not (math.isfinite(speed) and speed > 0):
        raise InputError(f"`speed` must be over 0 rad/s, got {speed}")
    if not (math.isfinite(fps) and fps > 0):
        raise InputError(f"`fps` must be over 0, got {fps}")
    cone = cone or Cone()
    r = (0.1 + 0.2 * (np.arange(40) + 0.5) / 40)[:, None]
    theta = (np.arange(720) + 0.5) / 720 * TURN
    half = np.arccos(np.clip((0.2**2 + r**2 - 0.1**2) / (0.4 * r), -1, 1))
    passes, frames = math.ceil(cone.memory * speed / TURN) + 2, math.ceil(cone.memory * fps) + 2
    total = 0.0
    for t in (np.arange(4) + 0.5) / 4 / fps:
        # The angle by which the disk has passed a place; up to 1 rad ahead is not yet passed.
        passed = (speed * t - theta + 1) % TURN - 1 + TURN * np.arange(passes)[:, None, None]
        nature = cone.step_response((passed + half) / speed) - cone.step_response(
            (passed - half) / speed
        )
        video = np.zeros((len(r), len(theta)))
        for k in range(1, -frames, -1):
            weight = cone.weights(t - k / fps, 1 / fps)
            around = (theta - speed * k / fps + math.pi) % TURN - math.pi
            video += weight * _exposed(shutter, around, half, speed / fps)
        total += float((np.abs(nature.sum(axis=0) - video) * r).mean() / r.mean())
    return total / 4


def _exposed(
    shutter: Shutter, theta: np.ndarray, half: np.ndarray | float, speed: float
) -> np.ndarray:
    """Share of the exposure that a disk, at angle 0 at the frame's instant, is at a place."""
    if shutter.degrees == 0:
        return (np.abs(theta) < half).astype(float)
    times, integral = shutter.integral()
    widest = np.max(half)
    reach = math.ceil(max(map(abs, shutter.span)) * speed / TURN) + 1
    total = np.zeros(np.broadcast_shapes(np.shape(theta), np.shape(half)))
    for edge in theta + TURN * np.arange(-reach, reach + 1)[:, None]:
        begin, end = (edge.min() - widest) / speed, (edge.max() + widest) / speed
        if end < times[0] or begin > times[-1]:  # it passes there at other times
            continue
        after, before = ((edge + side * half) / speed for side in (1, -1))
        total += np.interp(after, times, integral) - np.interp(before, times, integral)
    return total


def compare(fps: float, speeds: np.ndarray, cone: Cone | None = None) -> dict[str, list[float]]:
    """`difference` by name of the shutter (VIDEOS) at each speed [rad/s]."""
    return {
        name: [difference(shutter, float(speed), fps, cone) for speed in speeds]
        for name, shutter in VIDEOS.items()
    }


def best_shutter(speed: float, fps: float, cone: Cone | None = None) -> tuple[str, float]:
    """Return the VIDEOS shutter closest to perceived nature at `speed` [rad/s] and its distance."""
    found = compare(fps, np.array([speed]), cone)
    name = min(found, key=lambda name: found[name][0])
    return name, found[name][0]


def perception_charts(
    differences: Mapping[str, Sequence[float]], speeds: np.ndarray, fps: float
) -> tuple[Chart, Chart]:
    """Differences by shutter (`perceive.compare`) against speed [rad/s], and the small ones."""
    lines = {name: (speeds, np.asarray(values)) for name, values in differences.items()}
    title = f"perceived video and perceived nature, {fps:g} frames per second"
    axes = "speed [rad/s]", "difference"
    blurred = {name: line for name, line in lines.items() if name != "none"}
    return Chart(title, *axes, lines), Chart("with blur only", *axes, blurred)
