"""The few motions that may reach a tile: where its searches start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import ScratchBuffer, TexturePool
from .active_tiles import grid_of, uniform


class TileMotions:
    """The candidate motions of every tile, from the clustered motions of the tiles around it."""

    def __init__(self, device: wgpu.GPUDevice, images: TexturePool):
        self._device, self._images = device, images
        self._max_displacement = ScratchBuffer(device)

    def candidates(self, size, count: int) -> wgpu.GPUTextureView:
        """The candidates of all tiles in `count` frames."""
        layers = int(wgsl.load("methods/gather/surface.wgsl").constant("CANDIDATE_LAYERS"))
        grid = grid_of(size)
        texture = self._images.texture("tile candidates", grid, "rgba32uint", layers * count)
        return self._images.view_of(texture, dimension="2d-array")

    def encode(self, encoder, inputs, index: int, front_surface, worklists, scattering):
        """Record the candidate motions of every tile in frame `index` of the inputs.

        `scattering`: gets its tiles to scatter, if any tile is crowded.
        """
        kernel = gpu.kernel(self._device, "methods/gather/tiles/tile_motions.wgsl")
        data = np.zeros((), kernel.source.dtype("SourceFrame"))
        data["offset"] = inputs.frames[index].offset
        data["first"] = index * int(kernel.source.constant("CANDIDATE_LAYERS"))
        source = uniform(self._device, "source", data)
        grid = grid_of(inputs.bindings.size)
        layers = int(kernel.source.constant("MOTION_LAYERS"))
        motions = self._images.texture("tile motions", grid, "rgba32float", layers)
        motions = self._images.view_of(motions, dimension="2d-array")
        no_motions = self._images.texture("no tile motions", (1, 1), "rgba32float")
        no_motions = self._images.view_of(no_motions, dimension="2d-array")
        candidates = self.candidates(inputs.bindings.size, len(inputs.frames))
        side = int(kernel.source.constant("COARSE"))
        coarse = -(-grid[0] // side), -(-grid[1] // side)
        boxes = self._images.view("coarse boxes", coarse, "rgba32float")
        no_boxes = self._images.view("no boxes", (1, 1), "rgba32float")
        for entry in ("clear", "cluster_motions", "coarsen", "gather_candidates"):
            reads, last = entry in ("coarsen", "gather_candidates"), entry == "gather_candidates"
            kernel.run(
                encoder,
                entry,
                replace(inputs.bindings, size=coarse if entry == "coarsen" else grid),
                source=source,
                front_surface=front_surface,
                tile_motions=motions if reads else no_motions,
                tile_motions_out=no_motions if reads else motions,
                tile_candidates=candidates,
                scattering=scattering,
                max_displacement=self._max_displacement.at_least(4),
                coarse_boxes=boxes if last else inputs.unbound,
                coarse_boxes_out=no_boxes if last else boxes,
                active_cells=worklists["active"],
                static_cells=worklists["static"],
            )
