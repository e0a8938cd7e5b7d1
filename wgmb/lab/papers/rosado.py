"""Rosado's experiment: taps, the mask and the velocity buffer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...frame import Frame
from ...scene import builtin
from ...scene.bodies import Body, moving
from ...scene.scene import CameraPath, Scene
from ...shutter import Shutter
from ..cases import Candidate, SceneFrame, scene_case
from ..compare import Laboratory
from ..findings import about
from ..results import Plot, Report, Table

TAPS = (4, 8, 12, 16, 24, 32)


def rosado(lab: Laboratory, report: Report, size: tuple[int, int]) -> None:
    """Rosado's choices: the cost of a tap, camera-only or velocity buffer, with and without mask.

    A car-like box drives before a camera that follows it, while a ball crosses. Camera-only
    motion blurs the box, which should stay sharp; the chapter masks it; a velocity buffer
    knows that it stands still in the picture.
    """
    scene_frame = SceneFrame(_chase(), size=size)
    reference = Candidate("distributed", (("seed", 1),), 256)
    case = scene_case("chase", Shutter(180), reference, scene_frame, lab.device, lab.tell)
    candidates = [
        Candidate("tap", name="camera only", select=_camera_only),
        Candidate("tap", name="camera only, mask", select=lambda f: _camera_only(_masked(f))),
        Candidate("tap", name="velocity buffer"),
        Candidate("tap", name="velocity buffer, mask", select=_masked),
    ]
    lab.compare(report, case, candidates, TAPS)
    rows, curves = [], {}
    for c in candidates:
        entries = report.of(case.name, kind="samples", label=c.label)
        points = [(e.samples or 0, 1e3 * ((e.seconds or 0.0) - e.frame_seconds)) for e in entries]
        taps, times = np.array(points, float).T
        slope, start = np.polyfit(taps, times, 1)
        at = next(e for e in entries if e.samples == report.samples)
        rows.append([c.label, round(slope, 3), round(start, 2),
                     *(round(at.measures[m], 4) for m in ("flip", "psnr"))])  # fmt: skip
        curves[c.label] = points
    columns = ["motion", "a tap [ms]", "without taps [ms]", "FLIP", "PSNR"]
    note = f"{size[0]} x {size[1]}; a straight line through {min(TAPS)} to {max(TAPS)} taps."
    report.tables.append(Table("Costs and inputs of a tap", columns, rows, note))
    report.plots.append(Plot("Time against taps", "taps", "ms of the blur alone", curves, False))
    report.notes.append(about(rosado))


def _chase(speed: float = 9.0) -> Scene:
    """A box that a camera follows through the hall, and a ball that crosses."""
    hall = builtin.make("translation")
    box = Body("box", (0.4, 0.28, 0.5), moving((0, 0.35, -1.0), (speed, 0, 0)),
               (0.72, 0.10, 0.07), (0.9, 0.85, 0.75), "CHECKER", (3, 3))  # fmt: skip
    ball = Body("sphere", (0.4, 0.4, 0.4), moving((1.3, 1.2, -2.2), (-4, 0, 0)),
                (0.08, 0.45, 0.46), (0.9, 0.85, 0.75), "STRIPES", (12, 1))  # fmt: skip
    camera = CameraPath(lambda t: (speed * t, 1.3, 2.2), pitch=lambda t: -0.07 + 0 * t)
    return replace(hall, name="chase", bodies=(*hall.bodies, box, ball), camera=camera)


def _camera_only(frame: Frame) -> Frame:
    return replace(frame, object_id=None, prev=None, next=None)


def _masked(frame: Frame) -> Frame:
    """Keep the body that is seen in the middle, below: the box."""
    assert frame.object_id is not None
    height, width = frame.color.shape[:2]
    box = frame.object_id[int(0.72 * height), width // 2]
    holdout = (frame.object_id == box).astype(np.float32)
    return replace(frame, holdout=holdout, prev=None, next=None)
