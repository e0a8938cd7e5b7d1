"""Three-frame reconstruction: who is seen at every pixel and every time of the exposure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import wgpu

from .. import gpu, shader
from ..errors import InputError
from ..images import Images, Scratch

SHOWN = ("color", "confidence")
_STORED = 7  # storage textures of one pass: marks, both layers, their surfaces and bends


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
    10 to 35 times as much as taps.
    """

    name = "gather"
    needs = frozenset({"color", "motion", "depth"})
    uses = frozenset({"neighbours"})
    adaptive = True
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
        self._contents, self._farthest = Scratch(device), Scratch(device)

    def encode(self, encoder, inputs, output):
        """Record silhouettes and tiles of every frame, then the search."""
        weighted = inputs.weight is not None
        frames = [(0, inputs.color, inputs.motion, inputs.depth, inputs.weight)]
        frames += [(n.offset, n.color, n.motion, n.depth, n.weight) for n in inputs.neighbours]
        layers = self._layers(inputs.given.size, len(frames))
        for i, frame in enumerate(frames):
            views = {
                "near_color": _layer(layers["colors"], 2 * i),
                "far_color": _layer(layers["colors"], 2 * i + 1),
                "near_path": _layer(layers["paths"], 2 * i),
                "far_path": _layer(layers["paths"], 2 * i + 1),
                "surface": _layer(layers["surfaces"], i),
                "bend": _layer(layers["bends"], i),
            }
            self._silhouettes(encoder, inputs, frame, views)
            self._tiles(encoder, inputs, frame[0], i, len(frames), views)
        kernel = gpu.kernel(
            self._device,
            "blur/gather.wgsl",
            {"Output": self._output},
            EVEN=inputs.even,
            AUTO=inputs.auto,
            WEIGHTED=weighted,
            CONFIDENCE=self._show == "confidence",
        )
        data = np.zeros((), kernel.source.dtype("Sources"))
        data["offsets"][: len(frames)] = [frame[0] for frame in frames]
        data["count"] = len(frames)
        arrays = {k: t.create_view(dimension="2d-array") for k, t in layers.items()}
        arrays["tiles"] = self._reaching(inputs.given.size, len(frames))
        kernel.run(
            encoder,
            "main",
            inputs.given,
            sources=self._uniform("sources", data),
            own=inputs.color,
            own_weight=inputs.weight or inputs.none,
            linear=inputs.linear,
            output=output,
            **arrays,
        )

    def _layers(self, size, count: int) -> dict[str, wgpu.GPUTexture]:
        """Two layers a frame, near and far, and what there is to know of both."""
        color = gpu.texel(self._device, 4)
        return {
            "colors": self._images.texture("colors", size, color, 2 * count),
            "paths": self._images.texture("paths", size, "rgba32uint", 2 * count),
            "surfaces": self._images.texture("surfaces", size, "rgba32float", count),
            "bends": self._images.texture("bends", size, "rgba32uint", count),
        }

    def _reaching(self, size, count: int) -> wgpu.GPUTextureView:
        source = shader.load("blur/gather_tile.wgsl")
        side, layers = (int(source.constant(n)) for n in ("TILE", "LAYERS"))
        grid = -(-size[0] // side), -(-size[1] // side)
        texture = self._images.texture("reaching", grid, "rgba32float", layers * count)
        return texture.create_view(dimension="2d-array")

    def _silhouettes(self, encoder, inputs, frame, views):
        _, color, motion, depth, weight = frame
        kernel = gpu.kernel(
            self._device,
            "blur/gather_silhouettes.wgsl",
            {"Color": gpu.texel(self._device, 4)},
            WEIGHTED=weight is not None,
        )
        marks = self._images.view("marks", inputs.given.size, "r32uint")
        idle = self._images.view("no marks", inputs.given.size, "r32uint")
        for entry in ("mark", "split"):
            marking = entry == "mark"
            kernel.run(
                encoder,
                entry,
                inputs.given,
                color=color,
                motion=motion,
                depth=depth,
                weight=weight or inputs.none,
                marked=idle if marking else marks,
                marks=marks if marking else idle,
                **views,
            )

    def _tiles(self, encoder, inputs, offset: int, index: int, count: int, views):
        kernel = gpu.kernel(self._device, "blur/gather_tiles.wgsl")
        side = int(kernel.source.constant("TILE"))
        across, down = (-(-n // side) for n in inputs.given.size)
        tiles = kernel.source.dtype("Tile").itemsize * across * down
        data = np.zeros((), kernel.source.dtype("Source"))
        data["offset"] = offset
        data["first"] = index * int(kernel.source.constant("LAYERS"))
        source = self._uniform("source", data)
        contents = self._contents.at_least(tiles)
        reaching = self._reaching(inputs.given.size, count)
        for entry in ("clear", "local", "reach"):
            kernel.run(
                encoder,
                entry,
                replace(inputs.given, size=(across, down)),
                source=source,
                near=views["near_path"],
                contents=contents,
                reaching=reaching,
                farthest=self._farthest.at_least(4),
            )

    def _uniform(self, name: str, data: np.ndarray) -> wgpu.GPUBuffer:
        return self._device.create_buffer_with_data(
            label=name, data=data, usage=wgpu.BufferUsage.UNIFORM
        )


def _layer(texture: wgpu.GPUTexture, index: int) -> wgpu.GPUTextureView:
    return texture.create_view(dimension="2d", base_array_layer=index, array_layer_count=1)
