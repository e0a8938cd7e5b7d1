"""A smaller size at which a picture is searched sooner, and the way back to its own size."""

from __future__ import annotations

import wgpu

from .passes import STATES, FlowPasses

DISPLAY = ("rgba8unorm", 1)


def reduced(
    passes: FlowPasses,
    picture: wgpu.GPUTextureView,
    size: tuple[int, int],
    less: tuple[int, int],
) -> tuple[wgpu.GPUTextureView, wgpu.GPUTexture]:
    """A linear picture at the smaller size, valid until the next one; its display values."""
    display = passes.take(size, DISPLAY)
    small, spare = passes.scratch(less, "rgba32float", "small"), passes.take((1, 1), DISPLAY)
    none = passes.scratch((1, 1), "rgba32float", "none small")
    passes.run("raising/reduce.wgsl", "reduce", less, picture=picture, small=small, display=spare)
    passes.run("raising/reduce.wgsl", "show", size, picture=picture, small=none, display=display)
    passes.give(spare)
    return small.create_view(), display


def raised(
    passes: FlowPasses,
    display: wgpu.GPUTexture,
    here: wgpu.GPUTexture,
    states: wgpu.GPUTexture,
    depth: wgpu.GPUTexture,
) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture]:
    """States and depth at the size of `display`; `here`: the features of the small picture."""
    size = display.size[0], display.size[1]
    output, depth_out = passes.take(size, STATES), passes.take(size, ("r32float", 1))
    passes.run(
        "raising/raise.wgsl",
        "main",
        size,
        display=display,
        here=here,
        states=states,
        depth=depth,
        output=output,
        depth_out=depth_out,
    )
    return output, depth_out
