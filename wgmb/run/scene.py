"""Frames of a scene into files."""

from __future__ import annotations

from pathlib import Path

from ..frame import Frame
from ..io import exr
from ..output.output import Output
from ..render import Render
from ..sequence.frame_file import FrameFile
from .batch_report import Progress


def render_frames(
    render: Render,
    moments: dict[int, float],
    output: Output,
    sharp: bool,
    passes: bool,
    confidence: bool,
    resume: bool,
    progress: Progress | None,
) -> int:
    """Render every moment into `output`; returns how many were there already (`resume`).

    `sharp`: without blur. `passes`: EXR with all that `wgmb blur` can use. `confidence`: EXR
    with how sure the method is.
    """
    progress, skipped = progress or (lambda number, state: None), 0
    for number, time in moments.items():
        if resume and output.done(number):
            skipped += 1
            progress(number, "skipped")
            continue
        seen = render.frame(time, number, light=True) if passes else None
        planes = {}
        if confidence:
            result, planes = render.with_confidence(time, number)
        else:
            result = render.sharp(time) if sharp else render(time, number)
        source = (
            _with_passes(render, seen, number)
            if passes and seen
            else FrameFile(number, Path(), None, {}, {})
        )
        output.write(result, source, planes)
        progress(number, "done")
    output.close()
    return skipped


def _with_passes(render: Render, frame: Frame, number: int) -> FrameFile:
    """A frame's passes as layers that sequence/clip.py finds by their names."""
    motion = render.blur.motion(frame)
    assert frame.depth is not None and frame.normal is not None and frame.object_id is not None
    channels = {name: frame.color[..., i] for i, name in enumerate("RGBA")}
    channels |= {"Z": frame.depth, "object_id.X": frame.object_id}
    channels |= {f"normal.{c}": frame.normal[..., i] for i, c in enumerate("XYZ")}
    names = ("to_prev.x", "to_prev.y", "to_next.x", "to_next.y")
    channels |= {name: motion[..., i] for i, name in enumerate(names)}
    for layer, light in (("DiffDir", frame.diffuse_light), ("DiffCol", frame.diffuse_color)):
        if light is not None:
            channels |= {f"{layer}.{c}": light[..., i] for i, c in enumerate("RGB")}
    width, height = frame.size
    window = (0, 0, width - 1, height - 1)
    part = exr.Part("", channels, {}, window, window)
    file, origin = exr.Exr(Path(), [part]), {name: (part, name) for name in channels}
    return FrameFile(number, Path(), file, channels, {}, part=part, origin=origin)
