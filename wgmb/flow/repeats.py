"""The lead of the guide where the picture repeats or turns back."""

from __future__ import annotations

import wgpu

from .passes import STATES, Bindings, FlowPasses


def follow_guide(
    passes: FlowPasses,
    size: tuple[int, int],
    matched: Bindings,
    states: wgpu.GPUTexture,
    guide: wgpu.GPUTexture,
    back: list[wgpu.GPUTexture],
    coarser: wgpu.GPUTexture | None = None,
) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture]:
    """States, those of the guide where it leads; and the lead, for the sweeps on finer levels.

    `guide`: displacements that guide.py found; `back`: the same of the near frame and of the far
    one, to this frame, if they are on different sides. `coarser`: the lead of the coarser level,
    if there is one, which holds where no other is found. The given states are taken back.
    """
    constants = matched["constants"] | {"IS_COARSEST": coarser is None}
    found = passes.scratch(size, "r32uint", "found")
    none = passes.scratch((1, 1), "r32uint", "none found")
    output, lead = passes.take(size, STATES), passes.take(size, STATES)
    for entry, read, written in (("find", none, found), ("follow", found, none)):
        passes.run(
            "repeats.wgsl",
            entry,
            size,
            states=states,
            guide=guide,
            found=read,
            found_out=written,
            output=output,
            lead=lead,
            coarser_lead=guide if coarser is None else coarser,
            near_back=back[0] if back else guide,
            far_back=back[-1] if back else guide,
            **matched | {"constants": constants},
        )
    passes.give(states)
    return output, lead
