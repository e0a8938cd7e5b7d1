"""The search: what is visible at every pixel and time, composited and averaged."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import wgpu

from ... import gpu
from ...gpu import wgsl
from ...gpu.textures import ScratchBuffer, TexturePool
from .layers.layers import layer_view
from .shading import Added
from .tiles.active_tiles import grid_of, uniform


class Search:
    """The passes that read layers and candidates and write the picture."""

    def __init__(
        self, device: wgpu.GPUDevice, images: TexturePool, *, confidence: bool, output: str
    ):
        self._device, self._images = device, images
        self._confidence, self._output = confidence, output
        self._blocks = ScratchBuffer(device)

    def encode(self, encoder, inputs, layers, starts, worklists, output, added: Added | None):
        """Record the classification of blocks, then all pixels.

        `starts`: of searches, the tiles' candidates and what is scattered. `added`: moving light.
        """
        timed = {"BOX_SHUTTER": inputs.even, "ADAPTIVE": inputs.auto}
        timed["FAR"] = any(abs(frame.offset) > 1 for frame in inputs.frames)
        timed["WEIGHTED"] = inputs.frame.weight is not None
        classify = gpu.kernel(self._device, "methods/gather/search/classify.wgsl", **timed)
        data = np.zeros((), classify.source.dtype("SourceFrames"))
        near = [frame.offset for frame in inputs.frames if abs(frame.offset) <= 1]
        far = [frame.offset for frame in inputs.frames[len(near) :]]
        data["offsets"][: len(near)], data["far_offsets"][: len(far)] = near, far
        data["count"], data["far_count"] = len(near), len(far)
        candidates, scattered = starts
        array = partial(self._images.view_of, dimension="2d-array")
        arrays = {name: array(texture) for name, texture in layers.items()}
        searched = {
            "sources": uniform(self._device, "sources", data),
            "surfaces": arrays.pop("surfaces"),
            "tile_candidates": candidates,
            "scattered": scattered,
        }
        wide, side, block, times = (
            int(classify.source.constant(n))
            for n in ("CELL_TILES", "TILE", "BLOCK", "TIMES_PER_WORD")
        )
        across, down = grid_of(inputs.bindings.size)
        blocks = -(-across // wide) * wide * side // block, down * side // block
        words = self._images.texture(
            "single-layer mask", blocks, "r32uint", -(-inputs.samples // times) + 1
        )
        mask = array(words)
        # Three lists: of plain blocks, of others, and of others in crowded tiles.
        size = (
            4 * -(-(blocks[0] * blocks[1] + int(classify.source.constant("CELLS_WORD"))) // 64) * 64
        )
        lists = {"buffer": self._blocks.at_least(3 * size), "offset": 0, "size": 3 * size}
        encoder.clear_buffer(lists["buffer"], 0, 3 * size)
        for entry, over in (("main", blocks), ("size_lists", (3 * classify.workgroup[0], 1))):
            classify.run(
                encoder,
                entry,
                replace(inputs.bindings, size=over),
                single_layer_mask=mask,
                active_cells=worklists["active"],
                lists=lists,
                **searched,
            )
        plain, others, crowded = (lists | {"offset": k * size, "size": size} for k in range(3))
        separated = worklists["separated"]
        differences = self._differences(encoder, inputs, layers["surfaces"], separated)
        for entry, cells, kind in (
            ("main", others, {}),
            ("main", crowded, {"CROWDED": True}),
            ("main", plain, {"PLAIN": True}),
            ("copy_static", worklists["static"], {"PLAIN": True}),
        ):
            for lit, groups in self._groups(encoder, inputs, cells, added):
                kernel = gpu.kernel(
                    self._device,
                    "methods/gather/search/resolve.wgsl",
                    {"Output": self._output, "mattes": layers["mattes"].format},
                    CONFIDENCE=self._confidence,
                    **kind,
                    MOVING_LIGHT=lit is not None,
                    **timed,
                )
                kernel.run(
                    encoder,
                    entry,
                    inputs.bindings,
                    groups,
                    worklist=cells,
                    single_layer_mask=mask,
                    second_differences=differences,
                    own_color=inputs.frame.color,
                    own_weight=inputs.frame.weight or inputs.unbound,
                    linear=inputs.linear,
                    output=output,
                    **self._light(lit),
                    **searched,
                    **arrays,
                )

    def _groups(
        self, encoder, inputs, cells: dict, added: Added | None
    ) -> list[tuple[Added | None, dict]]:
        """Workgroups of a pass over `cells`: with moving light, and without it where none moves."""
        if added is None:
            return [(None, cells)]
        kernel = gpu.kernel(self._device, "methods/gather/shading/choose.wgsl")
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.INDIRECT
        groups = self._device.create_buffer(label="groups", size=32, usage=usage)
        alone = replace(inputs.bindings, size=(1, 1))
        kernel.run(encoder, "main", alone, found=added.change_flags, worklist=cells, groups=groups)
        return [
            (one, {"buffer": groups, "offset": offset, "size": 12})
            for one, offset in ((added, 0), (None, 12))
        ]

    def _light(self, added: Added | None) -> dict:
        """Bindings of the search for moving light, or for none."""
        source = wgsl.load("methods/gather/search/moving_light.wgsl")
        nodes = np.zeros((), source.dtype("LightNodes"))
        if added is None:
            none = self._images.texture("no light", (1, 1), "rgba16float")
            layers = self._images.view_of(none, dimension="2d-array")
            changes = self._blocks.at_least(4)
        else:
            layers, times = added.layers.create_view(dimension="2d-array"), added.times
            changes = added.change_flags
            nodes["first"], nodes["step"], nodes["count"] = times.first, times.step, times.count
        return {
            "light_nodes": uniform(self._device, "light nodes", nodes),
            "added_light": layers,
            "light_changes": changes,
        }

    def _differences(self, encoder, inputs, surfaces, cells) -> wgpu.GPUTextureView:
        """Record the second differences of the frame's own colours."""
        differences = self._images.view("second differences", inputs.bindings.size, "rgba32uint")
        kernel = gpu.kernel(self._device, "methods/gather/search/cubic.wgsl")
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            cells,
            color=inputs.frame.color,
            front_surface=layer_view(self._images, surfaces, 0),
            second_differences=differences,
            worklist=cells,
        )
        return differences
