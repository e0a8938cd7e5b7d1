"""The choice between the motions of dense inverse search and of blocks, place by place."""

from __future__ import annotations

import wgpu

from ... import gpu
from .levels import FOLDER, STATE, Levels


def choose(
    on: Levels,
    encoder: gpu.Tape,
    turn: wgpu.GPUBuffer,
    has_both: bool,
    dense: wgpu.GPUTextureView,
    state: wgpu.GPUTextureView,
    output: wgpu.GPUTextureView,
) -> None:
    """Record the cheaper motion at each place: `dense`, or `state` of the middle level.

    Unless the picture has both neighbours, places that the only one hides take the dominant
    motion.
    """
    size = on.sizes[on.middle]
    images, levels = on.images, on.level(on.middle)
    costs, along, chosen = (images.view(n, size, STATE) for n in ("costs", "along", "chosen"))
    areas = images.view("areas", on.sizes[on.small], "r32float")
    on.run(
        encoder, "choice/compare", "main", size,
        turn=turn, levels=levels, motion=dense, state=state, areas=areas, output=costs,
    )  # fmt: skip
    on.run(encoder, "choice/average", "along_x", size, costs=costs, output=along)
    on.run(encoder, "choice/average", "choose", size, costs=along, output=chosen)
    hidden = None if has_both else _hidden(on, encoder, turn, dense, state, chosen)
    gpu.kernel(on.device, f"{FOLDER}/choice/choose.wgsl", None, ALONE=not has_both).run(
        encoder, "main", on.frame(on.size), turn=turn, levels=on.level(0),
        small=levels, state=state, chosen=chosen, motion=dense, hidden=hidden, output=output,
    )  # fmt: skip


def _hidden(
    on: Levels,
    encoder: gpu.Tape,
    turn: wgpu.GPUBuffer,
    dense: wgpu.GPUTextureView,
    state: wgpu.GPUTextureView,
    chosen: wgpu.GPUTextureView,
) -> wgpu.GPUTextureView:
    """Places of the middle level that another place hides in the only neighbour."""
    size = on.sizes[on.middle]
    images, levels = on.images, on.level(on.middle)
    leads, hidden = images.view("leads", size, STATE), images.view("hidden", size, STATE)
    encoder.clear_buffer(on.arrivals)
    on.run(
        encoder, "choice/arrivals", "main", size, turn=turn, levels=levels, motion=dense,
        state=state, chosen=chosen, output=leads, arrivals=on.arrivals,
    )  # fmt: skip
    small = images.view("begin", on.sizes[on.small], STATE)
    on.run(
        encoder, "choice/hidden", "main", size, turn=turn, levels=levels, leads=leads,
        arrivals=on.arrivals, small=small, summary=on.summary, output=hidden,
    )  # fmt: skip
    return hidden
