"""Pixels that are not found again take over the state of the surface they belong to."""

from __future__ import annotations

import wgpu

from .passes import STATES, Bindings, FlowPasses
from .views import Views


def mend(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    views: Views,
    states: wgpu.GPUTexture,
    neighbours: dict[int, tuple[Views, wgpu.GPUTexture]],
) -> wgpu.GPUTexture:
    """States of a frame, those that lead astray replaced.

    `neighbours`: views and states of the frames directly beside it, by their numbers.
    """
    near_views, near = neighbours[views.near]
    sides = {"near": near_views.leads_by(views.here)}
    far = near
    if len(views.neighbours) == 2:
        far_views, far = neighbours[views.neighbours[1]]
        sides["far"] = far_views.leads_by(views.here)
    lost = passes.scratch(size, "r32uint", "lost")
    none = passes.scratch((1, 1), "r32uint", "none lost")
    output = passes.take(size, STATES)
    for entry, read, written in (("find_lost", none, lost), ("mend", lost, none)):
        passes.run(
            "mend.wgsl",
            entry,
            size,
            others=passes.uniform("mend.wgsl", "Others", **sides),
            states=states,
            near_states=near,
            far_states=far,
            lost=read,
            lost_out=written,
            output=output,
            **matched,
        )
    return output
