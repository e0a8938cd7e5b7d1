"""Where the picture repeats, or turns back, the smooth motion of the guide leads."""

from __future__ import annotations

import wgpu

from .passes import STATES, Passes


def follow_guide(
    passes: Passes,
    size: tuple[int, int],
    matched: dict,
    states: wgpu.GPUTexture,
    guide: wgpu.GPUTexture,
    back: list[wgpu.GPUTexture],
) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture]:
    """States, those of the guide where it leads; and the lead, for the sweeps on finer levels.

    `guide`: states that guide.py made; `back`: the same of the near frame and of the far one, to
    this frame, if they are on different sides. The given states are taken back.
    """
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
            near_back=back[0] if back else guide,
            far_back=back[-1] if back else guide,
            **matched,
        )
    passes.give(states)
    return output, lead
