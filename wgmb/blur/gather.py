"""Three-frame reconstruction: who is seen at every pixel and every time of the exposure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import wgpu

from .. import gpu, shader
from ..errors import InputError
from ..images import Images, Scratch

SHOWN = ("color", "confidence")
_STORED = 6  # storage textures of one pass: marks, both layers, their surfaces


class Gather:
    """Search, for every pixel and time, the samples of up to three frames that are there.

    A fixed-point search along curved paths starts from the pixel's own motion and from the
    few motions that reach its tile. Silhouettes are parted into two layers before, so that
    mixed pixels move as what they are made of; their shares are those of alpha before what is
    transparent, else those of mixed vectors. The nearest sample wins, the frame's own
    unless a neighbouring frame's is clearly nearer; where no frame saw what is there, the
    pixel's own path is followed.
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

    def __init__(self, device, *, output="rgba32float", show="color"):
        if show not in SHOWN:
            raise InputError(f"show must be one of {', '.join(SHOWN)}, got {show!r}")
        limit = "max-storage-textures-per-shader-stage"
        if device.limits[limit] < _STORED:
            raise InputError(
                f"gather writes {_STORED} textures in a pass, this device allows "
                f"{device.limits[limit]}: request it with required_limits={{{limit!r}: {_STORED}}}"
            )
        self._device, self._output, self._show = device, output, show
        self._images = Images(device)
        self._farthest, self._lists = Scratch(device), Scratch(device)
        self._mixed, self._needed, self._spare = (Scratch(device) for _ in range(3))
        self._everywhere: tuple[tuple[int, int], dict] | None = None
        self._colors: wgpu.GPUTexture | None = None
        self._made: dict[int, tuple] = {}  # what the layers at a place were made of

    def encode(self, encoder, inputs, output):
        """Record silhouettes and tiles of every frame, then the search."""
        size, frames = inputs.given.size, inputs.frames
        layers = self._layers(size, len(frames))
        places = self._places(frames, layers)
        lists = self._listed(encoder, inputs)
        for i, (frame, place) in enumerate(zip(frames, places, strict=True)):
            views = {
                "near_color": _layer(layers["colors"], 2 * place),
                "far_color": _layer(layers["colors"], 2 * place + 1),
                "near_path": _layer(layers["paths"], 2 * place),
                "far_path": _layer(layers["paths"], 2 * place + 1),
                "surface": _layer(layers["surfaces"], place),
            }
            if self._made.get(place) != _contents(frame):
                self._silhouettes(encoder, inputs, frame, views, lists)
                self._made.pop(place, None)
            if frame.token is not None:
                self._made[place] = _contents(frame)
            self._tiles(encoder, inputs, frame.offset, i, len(frames), views, lists)
        offsets = [frame.offset for frame in frames]
        self._search(encoder, inputs, offsets, places, layers, lists, output)

    def _places(self, frames, layers) -> list[int]:
        """Where the layers of the frames are, or are to be: what is there already stays."""
        if layers["colors"] is not self._colors:
            self._colors, self._made = layers["colors"], {}
        made = {contents: place for place, contents in self._made.items()}
        places = [made.get(_contents(frame)) for frame in frames]
        free = (place for place in range(layers["colors"].size[2] // 2) if place not in places)
        return [next(free) if place is None else place for place in places]

    def _listed(self, encoder, inputs) -> dict[str, dict]:
        """What needs work: the lists of gather_live.wgsl, by name."""
        kernel = gpu.kernel(self._device, "blur/gather_live.wgsl")
        grid = self._grid(inputs.given.size)
        words = -(-(grid[0] * grid[1] + int(kernel.source.constant("CELLS"))) // 64) * 64
        size = 4 * words * int(kernel.source.constant("LISTS"))
        lists = self._lists.at_least(size)
        encoder.clear_buffer(lists)
        data = np.zeros((), kernel.source.dtype("Survey"))
        data["words"] = words
        tiles = replace(inputs.given, size=grid)
        for frame in inputs.frames:
            data["offset"] = frame.offset
            own = {"source": self._uniform("survey", data), "motion": frame.motion, "lists": lists}
            kernel.run(encoder, "survey", tiles, **own)
        kernel.run(encoder, "near", tiles, **own)
        kernel.run(encoder, "list", replace(inputs.given, size=(grid[1], 1)), **own)
        return {
            name: {
                "buffer": lists,
                "offset": 4 * words * int(kernel.source.constant(name.upper())),
                "size": 4 * words,
            }
            for name in ("moving", "resting", "parted", "whole", "marked")
        }

    def _all(self, size) -> dict:
        """A list of all cells, in an order that spreads every stretch of it over the picture."""
        if self._everywhere is None or self._everywhere[0] != size:
            source = shader.load("blur/gather_listed.wgsl")
            strands, row, wide, side, strip = (
                int(source.constant(n)) for n in ("INTERLEAVE", "IN_A_ROW", "CELL", "TILE", "STRIP")
            )
            across, down = self._grid(size)
            across = -(-across // wide)
            rows = np.concatenate([np.arange(i, down, strands) for i in range(strands)])
            cells = (np.arange(across) + 65536 * rows[:, None]).ravel()
            head = min(cells.size, row), side // strip, -(-cells.size // row), cells.size
            spare = [0] * (-cells.size % 4)  # a struct's size is a multiple of 16 bytes
            data = np.array([*head, *cells, *spare], np.uint32)
            usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.INDIRECT
            buffer = self._device.create_buffer_with_data(label="all", data=data, usage=usage)
            self._everywhere = size, {"buffer": buffer, "offset": 0, "size": buffer.size}
        return self._everywhere[1]

    def _search(self, encoder, inputs, offsets, places, layers, lists, output):
        """Record which times of which blocks are plain, then all pixels."""
        count = len(offsets)
        timed = {"BOX_SHUTTER": inputs.even, "ADAPTIVE": inputs.auto}
        plain = gpu.kernel(self._device, "blur/gather_plain.wgsl", **timed)
        data = np.zeros((), plain.source.dtype("Sources"))
        data["offsets"][:count] = offsets
        data["places"][:count] = places
        data["count"] = count
        arrays = {k: t.create_view(dimension="2d-array") for k, t in layers.items()}
        searched = {
            "sources": self._uniform("sources", data),
            "paths": arrays.pop("paths"),
            "tiles": self._reaching(inputs.given.size, count),
        }
        wide, side, block, times = (
            int(plain.source.constant(n)) for n in ("CELL", "TILE", "BLOCK", "AT_ONCE")
        )
        across, down = self._grid(inputs.given.size)
        blocks = -(-across // wide) * wide * side // block, down * side // block
        words = self._images.texture("plain", blocks, "r32uint", -(-inputs.samples // times) + 1)
        bits = words.create_view(dimension="2d-array")
        given = replace(inputs.given, size=blocks)
        plain.run(encoder, "main", given, plain=bits, moving=lists["moving"], **searched)
        kernel = gpu.kernel(
            self._device,
            "blur/gather.wgsl",
            {"Output": self._output},
            WEIGHTED=inputs.weight is not None,
            CONFIDENCE=self._show == "confidence",
            **timed,
        )
        bends = self._bends(encoder, inputs, layers["paths"], places[0], lists["parted"])
        for entry, tiles in (("main", lists["moving"]), ("rest", lists["resting"])):
            kernel.run(
                encoder,
                entry,
                inputs.given,
                tiles,
                listed=tiles,
                plain=bits,
                bends=bends,
                own=inputs.color,
                own_weight=inputs.weight or inputs.none,
                linear=inputs.linear,
                output=output,
                **searched,
                **arrays,
            )

    def _bends(self, encoder, inputs, paths, place: int, parted) -> wgpu.GPUTextureView:
        """Record how the frame's own colours bend between pixels."""
        bends = self._images.view("bends", inputs.given.size, "rgba32uint")
        kernel = gpu.kernel(self._device, "blur/gather_bends.wgsl")
        kernel.run(
            encoder,
            "main",
            inputs.given,
            parted,
            color=inputs.color,
            near=_layer(paths, 2 * place),
            bends=bends,
            listed=parted,
        )
        return bends

    def _layers(self, size, count: int) -> dict[str, wgpu.GPUTexture]:
        """Two layers a frame, near and far, and what there is to know of both."""
        if self._colors is not None and self._colors.size[:2] == size:
            count = max(count, self._colors.size[2] // 2)
        color = gpu.texel(self._device, 4)
        return {
            "colors": self._images.texture("colors", size, color, 2 * count),
            "paths": self._images.texture("paths", size, "rgba32uint", 2 * count),
            "surfaces": self._images.texture("surfaces", size, "rgba32float", count),
        }

    def _grid(self, size) -> tuple[int, int]:
        """Tiles across and down a picture."""
        side = int(shader.load("blur/gather_tile.wgsl").constant("TILE"))
        return -(-size[0] // side), -(-size[1] // side)

    def _reaching(self, size, count: int) -> wgpu.GPUTextureView:
        layers = int(shader.load("blur/gather_tile.wgsl").constant("LAYERS"))
        texture = self._images.texture("reaching", self._grid(size), "rgba32float", layers * count)
        return texture.create_view(dimension="2d-array")

    def _silhouettes(self, encoder, inputs, frame, views, lists):
        """Record them for all that something moves near; for the whole frame if it is kept."""
        size = inputs.given.size
        needed = {"buffer": self._needed.at_least(16), "offset": 0, "size": 16}
        if frame.token is None:
            cells = {"whole": lists["whole"], "mark": lists["marked"], "split": lists["parted"]}
        else:
            cells = dict.fromkeys(("mark", "split"), self._all(size))
        passes: dict[str, tuple[dict | None, dict]] = {k: (c, c) for k, c in cells.items()}
        passes |= {"count": (None, cells["split"]), "part": (needed, cells["split"])}
        kernel = gpu.kernel(
            self._device,
            "blur/gather_silhouettes.wgsl",
            {"Color": gpu.texel(self._device, 4)},
            WEIGHTED=frame.weight is not None,
        )
        marks = self._images.view("marks", size, "r32uint")
        idle = self._images.view("no marks", size, "r32uint")
        mixed = self._mixed.at_least(4 + 4 * size[0] * size[1])
        encoder.clear_buffer(mixed, 0, 4)
        for entry, (groups, listed) in passes.items():
            marking = entry == "mark"
            kernel.run(
                encoder,
                entry,
                inputs.given if groups else replace(inputs.given, size=(1, 1)),
                groups,
                listed=listed,
                color=frame.color,
                motion=frame.motion,
                depth=frame.depth,
                weight=frame.weight or inputs.none,
                marked=idle if marking else marks,
                marks=marks if marking else idle,
                mixed=mixed,
                needed=needed if entry == "count" else self._spare.at_least(16),
                **views,
            )

    def _tiles(self, encoder, inputs, offset: int, index: int, count: int, views, lists):
        kernel = gpu.kernel(self._device, "blur/gather_tiles.wgsl")
        data = np.zeros((), kernel.source.dtype("Source"))
        data["offset"] = offset
        data["first"] = index * int(kernel.source.constant("LAYERS"))
        source = self._uniform("source", data)
        grid, held = self._grid(inputs.given.size), int(kernel.source.constant("HELD"))
        contents = self._images.texture("contents", grid, "rgba32float", held)
        contents = contents.create_view(dimension="2d-array")
        idle = self._images.texture("no contents", (1, 1), "rgba32float")
        idle = idle.create_view(dimension="2d-array")
        reaching = self._reaching(inputs.given.size, count)
        wide = int(kernel.source.constant("WIDE"))
        coarse = -(-grid[0] // wide), -(-grid[1] // wide)
        boxes = self._images.view("wide boxes", coarse, "rgba32float")
        no_boxes = self._images.view("no boxes", (1, 1), "rgba32float")
        for entry in ("clear", "local", "widen", "reach"):
            reads, last = entry in ("widen", "reach"), entry == "reach"
            kernel.run(
                encoder,
                entry,
                replace(inputs.given, size=coarse if entry == "widen" else grid),
                source=source,
                near=views["near_path"],
                content=contents if reads else idle,
                contents=idle if reads else contents,
                reaching=reaching,
                farthest=self._farthest.at_least(4),
                wide_box=boxes if last else inputs.none,
                wide_boxes=no_boxes if last else boxes,
                moving=lists["moving"],
                resting=lists["resting"],
            )

    def _uniform(self, name: str, data: np.ndarray) -> wgpu.GPUBuffer:
        return self._device.create_buffer_with_data(
            label=name, data=data, usage=wgpu.BufferUsage.UNIFORM
        )


def _contents(frame) -> tuple[object, bool]:
    """What the layers of a frame are made of: its pixels, with weights or without."""
    return frame.token, frame.weight is not None


def _layer(texture: wgpu.GPUTexture, index: int) -> wgpu.GPUTextureView:
    return texture.create_view(dimension="2d", base_array_layer=index, array_layer_count=1)
