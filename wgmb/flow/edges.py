"""Tiles of a picture beside edges of what moves, which alone are swept on a fine level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import wgpu

from ..gpu import wgsl
from .passes import FlowPasses

_ACROSS = 16  # tiles side by side in a dispatch
_OUTSIDE = 1 << 20  # tile of no picture


class SweptTiles(NamedTuple):
    """Tiles that a sweep is limited to."""

    places: wgpu.GPUBuffer  # of every tile, x and y, to the end of the last row of a dispatch
    across: int  # tiles in such a row
    grid: tuple[int, int]  # invocations of a dispatch, across and down


def tiles_at_edges(
    passes: FlowPasses, size: tuple[int, int], states: wgpu.GPUTexture
) -> SweptTiles:
    """The tiles of a level of `size` where the coarser level's `states` change."""
    source = wgsl.load("flow/edges/find.wgsl")
    tile, *workgroup = (int(source.constant(name)) for name in ("TILE", "WG_X", "WG_Y"))
    count = -(-size[0] // (2 * tile)), -(-size[1] // tile)
    marks = passes.scratch(count, "r32uint", "edges")
    passes.run("edges/find.wgsl", "main", count, states=states, output=marks)
    encoder = passes.device.create_command_encoder()
    found = np.argwhere(passes.images.download(encoder, marks)[..., 0])[:, ::-1]
    down = -(-len(found) // _ACROSS)
    places = np.full((max(down, 1) * _ACROSS, 2), _OUTSIDE, np.uint32)
    places[: len(found)] = found
    buffer = passes.tiles.at_least(places.nbytes)
    passes.device.queue.write_buffer(buffer, 0, places)
    return SweptTiles(buffer, _ACROSS, (_ACROSS * workgroup[0], down * workgroup[1]))
