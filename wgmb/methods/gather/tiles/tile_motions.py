"""The few motions that may reach a tile: where its searches start."""

from __future__ import annotations

from collections.abc import Mapping

import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import ScratchBuffer, TexturePool
from ...contract import Inputs, View
from .active_tiles import grid_of


class TileMotions:
    """The candidate motions of every tile, from the clustered motions of the tiles around it."""

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool):
        self._device, self._images = device, images
        self._max_displacement = ScratchBuffer(device)

    def candidates(self, size: tuple[int, int], count: int) -> View:
        """The candidates of all tiles in `count` frames."""
        layers = wgsl.load("methods/gather/surface.wgsl").integer("CANDIDATE_LAYERS")
        grid = grid_of(size)
        texture = self._images.texture("tile candidates", grid, "rgba32uint", layers * count)
        return self._images.view_of(texture, dimension="2d-array")

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        index: int,
        front_surface: View,
        worklists: Mapping[str, gpu.BufferPart],
        scattering: gpu.BufferPart,
    ) -> None:
        """Record the candidate motions of every tile in frame `index` of the inputs.

        `scattering`: gets its tiles to scatter, if any tile is crowded.
        """
        kernel = gpu.kernel(self._device, "methods/gather/tiles/tile_motions.wgsl")
        first = index * kernel.source.integer("CANDIDATE_LAYERS")
        grid = grid_of(inputs.bindings.size)
        layers = kernel.source.integer("MOTION_LAYERS")
        motions = self._images.texture("tile motions", grid, "rgba32float", layers)
        motions = self._images.view_of(motions, dimension="2d-array")
        side = kernel.source.integer("COARSE")
        coarse = -(-grid[0] // side), -(-grid[1] // side)
        boxes = self._images.view("coarse boxes", coarse, "rgba32float")
        # First the motions within each tile, in few clusters, and their bounds over many tiles;
        # then the motions of the tiles around, as far as the bounds say that they reach.
        for entry in ("clear", "cluster_motions", "coarsen", "gather_candidates"):
            reads, last = entry in ("coarsen", "gather_candidates"), entry == "gather_candidates"
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                coarse if entry == "coarsen" else grid,
                source={"offset": inputs.frames[index].offset, "first": first},
                front_surface=front_surface,
                tile_motions=motions if reads else None,
                tile_motions_out=None if reads else motions,
                tile_candidates=self.candidates(inputs.bindings.size, len(inputs.frames)),
                scattering=scattering,
                max_displacement=self._max_displacement.at_least(4),
                coarse_boxes=boxes if last else None,
                coarse_boxes_out=None if last else boxes,
                active_cells=worklists["active"],
                static_cells=worklists["static"],
            )
