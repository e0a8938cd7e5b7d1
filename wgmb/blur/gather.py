"""Three-frame reconstruction: what is visible at every pixel and every time of the exposure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
import wgpu

from .. import gpu, shader
from ..errors import InputError
from ..images import Images, Scratch
from .options import MethodOptions

_STORED = 6  # storage textures of one pass: edge flags, both layers, their matte


class Gather:
    """Search, for every pixel and time, the samples of up to three frames that are there.

    Fixed-point iterative warping (Bowles et al., "Iterative Image Warping", 2012) of the frame and
    its neighbours (Yang et al., "Image-Based Bidirectional Scene Reprojection", 2011) along curved
    trajectories. It starts from the pixel's own motion and from the few candidate motions that
    reach its tile (after the tile maxima of McGuire et al. 2012 and Guertin et al. 2014).
    Silhouettes are separated into two layers before, foreground and background, so that mixed
    pixels move as what they are made of; their coverage is that of alpha in front of what is
    transparent, else that of filtered vectors. The nearest sample is visible, the frame's own
    unless a neighbouring frame's is clearly nearer; where no frame shows what is there, a tap
    follows the pixel's own trajectory.
    `show`: "confidence" gives, instead of colour, the share of times at which a sample was
    accepted, the share that neighbouring frames gave, the mean residual [px] and the share of
    times whose path left the picture, as r, g, b, a.

    Strong: the closest to the truth. What is hidden appears, blur goes over silhouettes.
    Artefacts: shading is that of one frame; what all three frames hide is guessed from its
    surroundings; what comes from more than 256 px away by a sample's time may be missed; costs
    10 to 26 times as much as taps.
    """

    name = "gather"
    needs = frozenset({"color", "motion", "depth"})
    uses = frozenset({"neighbours"})
    adaptive = True
    most_in_software = 512  # loops end there after 65,535 turns, all of a pixel together
    confidence = ("accepted", "disocclusion", "residual", "left")

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """What is shown."""

        show: Annotated[
            Literal["color", "confidence"], "the blurred picture, or how sure it is"
        ] = "color"

    def __init__(self, device, options: Options, *, output="rgba32float"):
        limit = "max-storage-textures-per-shader-stage"
        if device.limits[limit] < _STORED:
            raise InputError(
                f"gather writes {_STORED} textures in a pass, this device allows "
                f"{device.limits[limit]}: request it with required_limits={{{limit!r}: {_STORED}}}"
            )
        self._device, self._output, self._options = device, output, options
        self._images = Images(device)
        self._max_displacement, self._lists = Scratch(device), Scratch(device)
        self._edges, self._edge_groups, self._spare = (Scratch(device) for _ in range(3))
        self._everywhere: tuple[tuple[int, int], dict] | None = None
        self._colors: wgpu.GPUTexture | None = None
        self._made: dict[int, tuple] = {}  # what the layers in a slot were made of

    def encode(self, encoder, inputs, output):
        """Record layers and tile motions of every frame, then the search."""
        size, frames = inputs.given.size, inputs.frames
        layers = self._layers(size, len(frames))
        slots = self._slots(frames, layers)
        lists = self._worklists(encoder, inputs)
        for i, (frame, slot) in enumerate(zip(frames, slots, strict=True)):
            views = {
                "front_color": _layer(layers["layer_colors"], 2 * slot),
                "back_color": _layer(layers["layer_colors"], 2 * slot + 1),
                "front_surface": _layer(layers["surfaces"], 2 * slot),
                "back_surface": _layer(layers["surfaces"], 2 * slot + 1),
                "matte": _layer(layers["mattes"], slot),
            }
            if self._made.get(slot) != _contents(frame):
                self._separate(encoder, inputs, frame, views, lists)
                self._made.pop(slot, None)
            if frame.key is not None:
                self._made[slot] = _contents(frame)
            self._candidates(encoder, inputs, frame.offset, i, len(frames), views, lists)
        offsets = [frame.offset for frame in frames]
        self._resolve(encoder, inputs, offsets, slots, layers, lists, output)

    def _slots(self, frames, layers) -> list[int]:
        """Where the layers of the frames are, or are to be: what is there already stays."""
        if layers["layer_colors"] is not self._colors:
            self._colors, self._made = layers["layer_colors"], {}
        made = {contents: slot for slot, contents in self._made.items()}
        slots = [made.get(_contents(frame)) for frame in frames]
        free = (slot for slot in range(layers["layer_colors"].size[2] // 2) if slot not in slots)
        return [next(free) if slot is None else slot for slot in slots]

    def _worklists(self, encoder, inputs) -> dict[str, dict]:
        """Record which tiles are active; the worklists of gather_live.wgsl, by name."""
        kernel = gpu.kernel(self._device, "blur/gather_live.wgsl")
        grid = self._grid(inputs.given.size)
        words = -(-(grid[0] * grid[1] + int(kernel.source.constant("CELLS_WORD"))) // 64) * 64
        size = 4 * words * int(kernel.source.constant("SECTIONS"))
        lists = self._lists.at_least(size)
        encoder.clear_buffer(lists)
        data = np.zeros((), kernel.source.dtype("SourceFrame"))
        data["words"] = words
        tiles = replace(inputs.given, size=grid)
        for frame in inputs.frames:
            data["offset"] = frame.offset
            own = {"source": self._uniform("source", data), "motion": frame.motion, "lists": lists}
            kernel.run(encoder, "mark_active_tiles", tiles, **own)
        kernel.run(encoder, "find_distances", tiles, **own)
        kernel.run(encoder, "build_worklists", replace(inputs.given, size=(grid[1], 1)), **own)
        return {
            name: {
                "buffer": lists,
                "offset": 4 * words * int(kernel.source.constant(name.upper())),
                "size": 4 * words,
            }
            for name in ("active", "static", "separated", "motion_only", "flagged")
        }

    def _all(self, size) -> dict:
        """A worklist of all cells, their rows interleaved as by interleaved_row() of frame.wgsl."""
        if self._everywhere is None or self._everywhere[0] != size:
            source = shader.load("blur/gather_listed.wgsl")
            interleave, row, wide, side, strip = (
                int(source.constant(n))
                for n in ("INTERLEAVE", "GROUPS_PER_ROW", "CELL_TILES", "TILE", "STRIP_HEIGHT")
            )
            across, down = self._grid(size)
            across = -(-across // wide)
            rows = np.concatenate([np.arange(i, down, interleave) for i in range(interleave)])
            cells = (np.arange(across) + 65536 * rows[:, None]).ravel()
            head = min(cells.size, row), side // strip, -(-cells.size // row), cells.size
            spare = [0] * (-cells.size % 4)  # a struct's size is a multiple of 16 bytes
            data = np.array([*head, *cells, *spare], np.uint32)
            usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.INDIRECT
            buffer = self._device.create_buffer_with_data(label="all", data=data, usage=usage)
            self._everywhere = size, {"buffer": buffer, "offset": 0, "size": buffer.size}
        return self._everywhere[1]

    def _resolve(self, encoder, inputs, offsets, slots, layers, lists, output):
        """Record the classification of blocks, then all pixels."""
        count = len(offsets)
        timed = {"BOX_SHUTTER": inputs.even, "ADAPTIVE": inputs.auto}
        classify = gpu.kernel(self._device, "blur/gather_plain.wgsl", **timed)
        data = np.zeros((), classify.source.dtype("SourceFrames"))
        data["offsets"][:count] = offsets
        data["slots"][:count] = slots
        data["count"] = count
        arrays = {k: t.create_view(dimension="2d-array") for k, t in layers.items()}
        searched = {
            "sources": self._uniform("sources", data),
            "surfaces": arrays.pop("surfaces"),
            "tile_candidates": self._tile_candidates(inputs.given.size, count),
        }
        wide, side, block, times = (
            int(classify.source.constant(n))
            for n in ("CELL_TILES", "TILE", "BLOCK", "TIMES_PER_WORD")
        )
        across, down = self._grid(inputs.given.size)
        blocks = -(-across // wide) * wide * side // block, down * side // block
        words = self._images.texture(
            "single-layer mask", blocks, "r32uint", -(-inputs.samples // times) + 1
        )
        mask = words.create_view(dimension="2d-array")
        classify.run(
            encoder,
            "main",
            replace(inputs.given, size=blocks),
            single_layer_mask=mask,
            active_cells=lists["active"],
            **searched,
        )
        kernel = gpu.kernel(
            self._device,
            "blur/gather.wgsl",
            {"Output": self._output},
            WEIGHTED=inputs.frame.weight is not None,
            CONFIDENCE=self._options.show == "confidence",
            **timed,
        )
        separated = lists["separated"]
        differences = self._differences(encoder, inputs, layers["surfaces"], slots[0], separated)
        for entry, cells in (("main", lists["active"]), ("copy_static", lists["static"])):
            kernel.run(
                encoder,
                entry,
                inputs.given,
                cells,
                worklist=cells,
                single_layer_mask=mask,
                second_differences=differences,
                own_color=inputs.frame.color,
                own_weight=inputs.frame.weight or inputs.none,
                linear=inputs.linear,
                output=output,
                **searched,
                **arrays,
            )

    def _differences(self, encoder, inputs, surfaces, slot: int, cells) -> wgpu.GPUTextureView:
        """Record the second differences of the frame's own colours."""
        differences = self._images.view("second differences", inputs.given.size, "rgba32uint")
        kernel = gpu.kernel(self._device, "blur/gather_bends.wgsl")
        kernel.run(
            encoder,
            "main",
            inputs.given,
            cells,
            color=inputs.frame.color,
            front_surface=_layer(surfaces, 2 * slot),
            second_differences=differences,
            worklist=cells,
        )
        return differences

    def _layers(self, size, count: int) -> dict[str, wgpu.GPUTexture]:
        """The textures of all layers: front and back per frame, and one matte per frame."""
        if self._colors is not None and self._colors.size[:2] == size:
            count = max(count, self._colors.size[2] // 2)
        color = gpu.texel(self._device, 4)
        return {
            "layer_colors": self._images.texture("layer colors", size, color, 2 * count),
            "surfaces": self._images.texture("surfaces", size, "rgba32uint", 2 * count),
            "mattes": self._images.texture("mattes", size, "rgba32float", count),
        }

    def _grid(self, size) -> tuple[int, int]:
        """Tiles across and down an image."""
        side = int(shader.load("blur/gather_tile.wgsl").constant("TILE"))
        return -(-size[0] // side), -(-size[1] // side)

    def _tile_candidates(self, size, count: int) -> wgpu.GPUTextureView:
        layers = int(shader.load("blur/gather_tile.wgsl").constant("CANDIDATE_LAYERS"))
        grid = self._grid(size)
        texture = self._images.texture("tile candidates", grid, "rgba32float", layers * count)
        return texture.create_view(dimension="2d-array")

    def _separate(self, encoder, inputs, frame, views, lists):
        """Record the layers of a frame: where something moves near, or all if they are kept."""
        size = inputs.given.size
        groups = {"buffer": self._edge_groups.at_least(16), "offset": 0, "size": 16}
        if frame.key is None:
            cells = {
                "copy_motion_only": lists["motion_only"],
                "detect_edges": lists["flagged"],
                "write_single_layer": lists["separated"],
            }
        else:
            cells = dict.fromkeys(("detect_edges", "write_single_layer"), self._all(size))
        passes: dict[str, tuple[dict | None, dict]] = {k: (c, c) for k, c in cells.items()}
        edge_cells = cells["write_single_layer"]
        passes |= {"size_dispatch": (None, edge_cells), "separate_layers": (groups, edge_cells)}
        kernel = gpu.kernel(
            self._device,
            "blur/gather_silhouettes.wgsl",
            {"Color": gpu.texel(self._device, 4)},
            WEIGHTED=frame.weight is not None,
        )
        flags = self._images.view("edge flags", size, "r32uint")
        unbound = self._images.view("no edge flags", size, "r32uint")
        edges = self._edges.at_least(4 + 4 * size[0] * size[1])
        encoder.clear_buffer(edges, 0, 4)
        for entry, (indirect, worklist) in passes.items():
            detecting = entry == "detect_edges"
            kernel.run(
                encoder,
                entry,
                inputs.given if indirect else replace(inputs.given, size=(1, 1)),
                indirect,
                worklist=worklist,
                color=frame.color,
                motion=frame.motion,
                depth=frame.depth,
                weight=frame.weight or inputs.none,
                edge_flags=unbound if detecting else flags,
                edge_flags_out=flags if detecting else unbound,
                edges=edges,
                edge_groups=groups if entry == "size_dispatch" else self._spare.at_least(16),
                **views,
            )

    def _candidates(self, encoder, inputs, offset: int, index: int, count: int, views, lists):
        """Record the candidate motions of every tile in the frame that is `index` of `count`."""
        kernel = gpu.kernel(self._device, "blur/gather_tiles.wgsl")
        data = np.zeros((), kernel.source.dtype("SourceFrame"))
        data["offset"] = offset
        data["first"] = index * int(kernel.source.constant("CANDIDATE_LAYERS"))
        source = self._uniform("source", data)
        grid = self._grid(inputs.given.size)
        layers = int(kernel.source.constant("MOTION_LAYERS"))
        motions = self._images.texture("tile motions", grid, "rgba32float", layers)
        motions = motions.create_view(dimension="2d-array")
        no_motions = self._images.texture("no tile motions", (1, 1), "rgba32float")
        no_motions = no_motions.create_view(dimension="2d-array")
        candidates = self._tile_candidates(inputs.given.size, count)
        side = int(kernel.source.constant("COARSE"))
        coarse = -(-grid[0] // side), -(-grid[1] // side)
        boxes = self._images.view("coarse boxes", coarse, "rgba32float")
        no_boxes = self._images.view("no boxes", (1, 1), "rgba32float")
        for entry in ("clear", "cluster_motions", "coarsen", "gather_candidates"):
            reads, last = entry in ("coarsen", "gather_candidates"), entry == "gather_candidates"
            kernel.run(
                encoder,
                entry,
                replace(inputs.given, size=coarse if entry == "coarsen" else grid),
                source=source,
                front_surface=views["front_surface"],
                tile_motions=motions if reads else no_motions,
                tile_motions_out=no_motions if reads else motions,
                tile_candidates=candidates,
                max_displacement=self._max_displacement.at_least(4),
                coarse_boxes=boxes if last else inputs.none,
                coarse_boxes_out=no_boxes if last else boxes,
                active_cells=lists["active"],
                static_cells=lists["static"],
            )

    def _uniform(self, name: str, data: np.ndarray) -> wgpu.GPUBuffer:
        return self._device.create_buffer_with_data(
            label=name, data=data, usage=wgpu.BufferUsage.UNIFORM
        )


def _contents(frame) -> tuple[object, bool]:
    """What the layers of a frame are made of: its pixels, with weights or without."""
    return frame.key, frame.weight is not None


def _layer(texture: wgpu.GPUTexture, index: int) -> wgpu.GPUTextureView:
    return texture.create_view(dimension="2d", base_array_layer=index, array_layer_count=1)
