"""The search: what is visible at every pixel and time, composited and averaged."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import wgpu

from ... import gpu
from ...gpu import wgsl
from ...gpu.textures import ScratchBuffer, TexturePool
from .shading import Added
from .tiles.active_tiles import grid_of, uniform


class Search:
    """The passes that read layers and candidates and write the picture."""

    def __init__(
        self, device: wgpu.GPUDevice, images: TexturePool, *, confidence: bool, output: str
    ):
        self._device, self._images = device, images
        self._confidence, self._output = confidence, output
        self._blocks, self._no_changes = ScratchBuffer(device), ScratchBuffer(device)

    def encode(self, encoder, inputs, layers, starts, worklists, output, added: Added | None):
        """Record the classification of blocks, then all pixels.

        The static cells of `worklists` are copied, if there are any.
        `starts`: of searches, the tiles' candidates and what is scattered. `added`: moving light.
        """
        timed = {"BOX_SHUTTER": inputs.even, "ADAPTIVE": inputs.auto}
        timed["FAR"] = any(abs(frame.offset) > 1 for frame in inputs.frames)
        timed["WEIGHTED"] = inputs.frame.weight is not None
        classify = gpu.kernel(
            self._device,
            "methods/gather/search/classify.wgsl",
            MOVING_LIGHT=added is not None,
            LIGHT_SCALE=added.scale if added else 1,
            **timed,
        )
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
        # Lists of plain blocks, of others, of others in crowded tiles; the same near moving light.
        size = (
            4 * -(-(blocks[0] * blocks[1] + int(classify.source.constant("CELLS_WORD"))) // 64) * 64
        )
        count = int(classify.source.constant("LISTS"))
        lists = {"buffer": self._blocks.at_least(count * size), "offset": 0, "size": count * size}
        encoder.clear_buffer(lists["buffer"], 0, count * size)
        light = {one: self._light(one) for one in (None, added)}
        changes = light[added]["light_changes"]
        for entry, over in (("main", blocks), ("size_lists", (count * classify.workgroup[0], 1))):
            classify.run(
                encoder,
                entry,
                replace(inputs.bindings, size=over),
                single_layer_mask=mask,
                active_cells=worklists["active"],
                lists=lists,
                light_changes=changes,
                **searched,
            )
        plain, others, crowded, *lit = (
            lists | {"offset": k * size, "size": size} for k in range(count)
        )
        separated = worklists["separated"]
        differences = self._differences(encoder, inputs, layers["surfaces"], separated)
        passes = [
            ("main", others, {}, None),
            ("main", crowded, {"CROWDED": True}, None),
            ("main", plain, {"PLAIN": True}, None),
        ]
        if static := worklists.get("static"):
            passes.append(("copy_static", static, {"PLAIN": True}, added))
        if added is not None:
            passes += [("main", lit[1], {}, added), ("main", lit[2], {"CROWDED": True}, added),
                       ("main", lit[0], {"PLAIN": True}, added)]  # fmt: skip
        for entry, cells, kind, moving in passes:
            kernel = gpu.kernel(
                self._device,
                "methods/gather/search/resolve.wgsl",
                {"Output": self._output, "mattes": layers["mattes"].format},
                CONFIDENCE=self._confidence,
                **kind,
                MOVING_LIGHT=moving is not None,
                LIGHT_SCALE=moving.scale if moving else 1,
                RESTING=moving is not None and moving.resting,
                **timed,
            )
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                cells,
                worklist=cells,
                single_layer_mask=mask,
                second_differences=differences,
                own_color=inputs.frame.color,
                own_weight=inputs.frame.weight or inputs.unbound,
                linear=inputs.linear,
                output=output,
                **light[moving],
                **searched,
                **arrays,
            )

    def _light(self, added: Added | None) -> dict:
        """Bindings of the search for moving light, or for none."""
        source = wgsl.load("methods/gather/search/moving_light.wgsl")
        nodes = np.zeros((), source.dtype("LightNodes"))
        if added is None:
            none = self._images.texture("no light", (1, 1), "rgba16float")
            layers = self._images.view_of(none, dimension="2d-array")
            changes = self._no_changes.at_least(4)
        else:
            layers, times = added.view, added.times
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
        texels = {"color": gpu.stored(inputs.frame.color)}
        kernel = gpu.kernel(self._device, "methods/gather/search/cubic.wgsl", texels)
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            cells,
            color=inputs.frame.color,
            front_surface=self._images.layer(surfaces, 0),
            second_differences=differences,
            worklist=cells,
        )
        return differences
