"""The search: the visible surface at every pixel and time, composited and averaged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import wgpu

from ... import gpu
from ...gpu.textures import ScratchBuffer, TexturePool
from ..contract import Inputs, View
from .shading import Added
from .tiles.active_tiles import grid_of


class Search:
    """The passes that read layers and candidates and write the picture."""

    def __init__(
        self, device: wgpu.GPUDevice, images: TexturePool, *, confidence: bool, output: str
    ):
        self._device, self._images = device, images
        self._confidence, self._output = confidence, output
        self._blocks = ScratchBuffer(device)

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        layers: Mapping[str, wgpu.GPUTexture],
        starts: tuple[View, gpu.BufferPart],
        worklists: Mapping[str, gpu.BufferPart],
        output: View,
        added: Added | None,
    ) -> None:
        """Record the classification of blocks, then all pixels.

        The static cells of `worklists` are copied, if there are any.
        `starts`: of searches, the tiles' candidates and scattered motions. `added`: moving light.
        """
        # All passes of the search read the layers and the starts of the same frames.
        near = [frame.offset for frame in inputs.frames if abs(frame.offset) <= 1]
        far = [frame.offset for frame in inputs.frames[len(near) :]]
        array = partial(self._images.view_of, dimension="2d-array")
        arrays = {name: array(texture) for name, texture in layers.items()}
        shared: dict[str, Any] = {
            "sources": {
                "offsets": near,
                "far_offsets": far,
                "count": len(near),
                "far_count": len(far),
            },
            "surfaces": arrays.pop("surfaces"),
            "tile_candidates": starts[0],
            "scattered": starts[1],
        }
        timed: dict[str, Any] = {
            "BOX_SHUTTER": inputs.even,
            "ADAPTIVE": inputs.auto,
            "FAR": bool(far),
            "WEIGHTED": inputs.frame.weight is not None,
        }
        # Blocks with one layer need no search through two, which most of them do not.
        active = worklists["active"]
        mask, lists = self._classify(encoder, inputs, active, shared, added, timed)
        differences = self._differences(encoder, inputs, layers["surfaces"], worklists["separated"])
        # The blocks are searched list by list, each with a kernel that does no more than it must.
        for entry, cells, kind, moving in _passes(lists, worklists.get("static"), added):
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
                own_weight=inputs.frame.weight,
                linear=inputs.linear,
                output=output,
                light_nodes=moving.times if moving else {},
                added_light=moving and moving.view,
                light_changes=moving and moving.change_flags,
                **shared,
                **arrays,
            )

    def _classify(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        active: gpu.BufferPart,
        shared: Mapping[str, Any],
        added: Added | None,
        timed: Mapping[str, Any],
    ) -> tuple[View, list[gpu.BufferPart]]:
        """Record which blocks have one layer at which times, and their lists: plain blocks, others,
        and others in crowded tiles; then the same of blocks near moving light."""
        kernel = gpu.kernel(
            self._device,
            "methods/gather/search/classify.wgsl",
            MOVING_LIGHT=added is not None,
            LIGHT_SCALE=added.scale if added else 1,
            **timed,
        )
        wide, side, block, times, head, count = map(
            kernel.source.integer,
            ("CELL_TILES", "TILE", "BLOCK", "TIMES_PER_WORD", "CELLS_WORD", "LISTS"),
        )
        across, down = grid_of(inputs.bindings.size)
        blocks = -(-across // wide) * wide * side // block, down * side // block
        words = self._images.texture(
            "single-layer mask", blocks, "r32uint", -(-inputs.samples // times) + 1
        )
        mask = self._images.view_of(words, dimension="2d-array")
        size = 4 * -(-(blocks[0] * blocks[1] + head) // 64) * 64
        lists = {"buffer": self._blocks.at_least(count * size), "offset": 0, "size": count * size}
        encoder.clear_buffer(lists["buffer"], 0, count * size)
        for entry, over in (("main", blocks), ("size_lists", (count * kernel.workgroup[0], 1))):
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                over,
                single_layer_mask=mask,
                active_cells=active,
                lists=lists,
                light_changes=added and added.change_flags,
                **shared,
            )
        return mask, [lists | {"offset": k * size, "size": size} for k in range(count)]

    def _differences(
        self,
        encoder: wgpu.GPUCommandEncoder,
        inputs: Inputs,
        surfaces: wgpu.GPUTexture,
        cells: gpu.BufferPart,
    ) -> View:
        """Record the second differences of the frame's own colours."""
        differences = self._images.view("second differences", inputs.bindings.size, "rgba32uint")
        color = inputs.frame.color
        kernel = gpu.kernel(self._device, "methods/gather/search/cubic.wgsl", {"color": color})
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            cells,
            color=color,
            front_surface=self._images.layer(surfaces, 0),
            second_differences=differences,
            worklist=cells,
        )
        return differences


def _passes(
    lists: Sequence[gpu.BufferPart], static: gpu.BufferPart | None, added: Added | None
) -> list[tuple[str, gpu.BufferPart, dict[str, Any], Added | None]]:
    """Entry points of resolve.wgsl: each with its list, its constants, and the light it follows."""
    plain, others, crowded, *lit = lists
    passes: list[tuple[str, gpu.BufferPart, dict[str, Any], Added | None]] = [
        ("main", others, {}, None),
        ("main", crowded, {"CROWDED": True}, None),
        ("main", plain, {"PLAIN": True}, None),
    ]
    if static:
        passes.append(("copy_static", static, {"PLAIN": True}, added))
    if added is not None:
        passes += [("main", lit[1], {}, added), ("main", lit[2], {"CROWDED": True}, added),
                   ("main", lit[0], {"PLAIN": True}, added)]  # fmt: skip
    return passes
