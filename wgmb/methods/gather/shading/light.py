"""Light that moves, as an addition to a frame's colours at a few times of its exposure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import wgpu

from .... import gpu
from ....gpu import wgsl
from ....gpu.textures import ScratchBuffer, TexturePool
from .changes import SurfaceLight, View, changes, reduced, screen
from .flow import (
    LightFlow,
    flows,
    grids,
    planes,
    pyramid,
)
from .stage import FOLDER, GATES_SIZE, Stage
from .values import values

_LISTS = "doubtful", "changing", "beside", "near", "whole"  # of tiles: see near.wgsl
LONGEST = 480  # px of light along the longer side of an image, on what rests, at most
LEAST_NODES, MOST_NODES = 4, 8  # times of an exposure at which light is known,
NODES_PER_INTERVAL = 12  # as many in a frame interval within these bounds


@dataclass(frozen=True)
class LightTimes:
    """Times of the nodes: `first`, and from one to the next [frame intervals]."""

    first: float
    step: float
    count: int

    @classmethod
    def within(cls, opens: float, closes: float, samples: int) -> LightTimes:
        """The middles of as many equal parts of an exposure as there are samples, or nodes."""
        nodes = max(LEAST_NODES, math.ceil(NODES_PER_INTERVAL * (closes - opens)))
        count = min(samples, nodes, MOST_NODES)
        step = max(closes - opens, 1e-6) / count
        return cls(opens + 0.5 * step, step, count)

    def __iter__(self):
        return (self.first + i * self.step for i in range(self.count))


@dataclass(frozen=True)
class Kind:
    """One kind of light in up to three frames, by their offsets; 0 is the frame itself.

    `pulled`: reflections; else shadows. `albedo`: None is 1 everywhere. `by_color`: the light is
    the picture itself; `resting`: on surfaces that rest, see `scale_of`. No other kind comes with
    it.
    """

    pulled: bool
    frames: Mapping[int, SurfaceLight]
    albedo: View | None
    by_color: bool = False
    resting: bool = False


@dataclass(frozen=True)
class Added:
    """The addition: a layer for each node, then one for the previous frame and one for the next
    one.

    The alpha of a node says how sure its light is, from 0 to 1, if that is asked for; that of a
    neighbour, whether the surface is seen there.

    `change_flags`: a buffer whose first word is 1 if light changes anywhere; if not, the layers are
    undefined. The others are of tiles, see active.wgsl.

    `scale`: side of a pixel of the layers [px]. `resting`: they are shares of the colours of what
    rests.
    """

    layers: wgpu.GPUTexture
    view: View  # of all layers
    times: LightTimes
    change_flags: wgpu.GPUBuffer
    scale: int = 1
    resting: bool = False


class MovingLight:
    """The passes that find out where light was at other times."""

    def __init__(self, device: wgpu.GPUDevice, *, confidence: bool = True):
        """`confidence`: the alpha of nodes is told."""
        self._device, self._images = device, TexturePool(device)
        self._confidence = confidence
        self._pushed = {name: ScratchBuffer(device) for name in ("from_here", "from_there")}
        self._kept = {name: ScratchBuffer(device) for name in ("change flags", "gates", *_LISTS)}

    def encode(
        self, encoder, bindings, kinds: Sequence[Kind], times: LightTimes, weight: View | None
    ) -> Added:
        """Record all passes. `weight`: of every pixel (see PreparedFrame)."""
        resting = kinds[0].resting
        scale = scale_of(bindings.size) if resting else 1
        if resting:
            width, height = bindings.size
            less = gpu.FrameBindings.of_size(
                self._device, (-(-width // scale), -(-height // scale))
            )
            bindings = replace(less, groups=bindings.groups)
        tiles = math.prod(_tile_grid(bindings.size))
        sizes = {"change flags": 4 * (1 + tiles), "gates": GATES_SIZE}
        kept = {
            name: buffer.at_least(sizes.get(name, 16 * (3 + tiles // 4)))
            for name, buffer in self._kept.items()
        }
        for buffer in kept.values():
            encoder.clear_buffer(buffer)
        change_flags, gates = kept.pop("change flags"), kept.pop("gates")
        lists: dict[str, Any] = kept
        stage = Stage(
            self._device, self._images, encoder, bindings, "", False, False, {}, change_flags, lists
        )
        stages = [
            replace(
                stage,
                name="glossy" if kind.pulled else "diffuse",
                pulled=kind.pulled,
                resting=kind.resting,
            )
            for kind in kinds
        ]
        grid = _tile_grid(stage.size)
        for stage, kind in zip(stages, kinds, strict=True):
            screen(stage, kind.frames, scale)
        stage.run("near", "list_doubtful", size=grid, **lists)
        stage.run("near", "size_doubtful", size=(1, 1), **lists)
        if resting:
            kinds = [replace(one, frames=reduced(stage, one.frames, scale)) for one in kinds]
        changed = [
            changes(stage, kind.frames, kind.albedo, kind.by_color)
            for stage, kind in zip(stages, kinds, strict=True)
        ]
        stage.run("near", "main", size=grid, **lists)
        stage.run("near", "size_lists", size=(1, 1), **lists)
        gated = stage.gated(grids(stage.size), gates).gates
        earlier = None
        for stage, kind, by_side in zip(stages, kinds, changed, strict=True):
            stage = replace(stage, gates=gated)
            earlier = self._layers(stage, kind, by_side, times, weight, earlier)
        assert earlier is not None, "no kind of light"
        every = self._images.view_of(earlier, dimension="2d-array")
        return Added(earlier, every, times, change_flags, scale, resting)

    def _layers(
        self,
        stage: Stage,
        kind: Kind,
        changed: Mapping[int, View],
        times: LightTimes,
        weight: View | None,
        earlier: wgpu.GPUTexture | None,
    ) -> wgpu.GPUTexture:
        """Record the layers of one kind, added to the `earlier` ones."""
        present = values(stage, kind.frames[0], changed, kind.by_color)
        seen = {offset: (view, pyramid(stage, str(offset), view))
                for offset, view in present.items()}  # fmt: skip
        depth = kind.frames[0].depth
        surfaces = {
            "depth": depth,
            "planes": planes(stage, depth),
            "motion": kind.frames[0].motion,
        }
        found = flows(stage, seen, changed, surfaces, kind.by_color)
        if not stage.pulled:
            _carry(stage, present[0], found, times)
        result = self._images.texture(
            f"light {stage.name}", stage.size, "rgba16float", times.count + 2
        )
        pixels = 8 * stage.size[0] * stage.size[1]
        buffers: dict[str, Any] = {
            name: buffer.at_least(pixels) for name, buffer in self._pushed.items()
        }
        for buffer in buffers.values():
            stage.encoder.clear_buffer(buffer, 0, pixels)
        none = stage.none("rgba16float")
        constants: dict[str, float] = {
            "HAS_ALBEDO": kind.albedo is not None,
            "WEIGHTED": weight is not None,
            "ONTO": earlier is not None,
            "TOLD": self._confidence,
        }
        before, after = (changed.get(one, none) for one in (-1, 1))
        around, spare = (one("rgba32uint") for one in (partial(stage.texture, "range"), stage.none))
        compose = partial(
            stage.run,
            "compose",
            constants=constants,
            light_here=kind.frames[0].light,
            albedo=kind.albedo or none,
            weight=weight or none,
            after=after,
            **buffers,
        )
        for i, time in enumerate([*times, -1.0, 1.0]):
            side, share = (-1 if time < 0 else 1), min(abs(time), 1.0)
            entry = "main" if i < times.count else "add_neighbour"
            if side not in changed:
                entry = "rest" if i < times.count else "add_nothing"
            way = found.get(side, LightFlow(none, none))
            both = {"values": present[0], "values_there": present.get(side, none),
                    "flow": way.ahead, "flow_back": way.back}  # fmt: skip
            if entry == "main" and not kind.pulled:
                push = stage.uniform("push", "Push", time=share)
                stage.run("push", over="near", push=push, **both, **buffers)
            passes = [(entry, "near", around, spare)]
            if entry == "main":
                passes = [("begin", "beside", around, spare), (entry, "changing", around, spare)]
            if not i:
                passes.insert(0, ("find_range", "changing", spare, around))
            for one, over, range, range_out in passes:
                compose(
                    one,
                    over=over,
                    node=stage.uniform("compose", "Node", time=share),
                    before=changed.get(side, none) if entry == "add_neighbour" else before,
                    earlier=none if earlier is None else self._images.layer(earlier, i),
                    added=self._images.layer(result, i),
                    range=range,
                    range_out=range_out,
                    **both,
                )
        return result


def _carry(stage: Stage, darkness: View, ways: Mapping[int, LightFlow], times: LightTimes) -> None:
    """Record which tiles bodies carry their shadows into: they are added to those that change."""
    for side, way in ways.items():
        stage.run(
            "carry",
            over="near",
            halved=True,
            carry=stage.uniform("carry", "Carry", last=max(0.0, *(side * time for time in times))),
            values=darkness,
            flow=way.ahead,
            changing=stage.lists["changing"],
        )
    lists: dict[str, Any] = dict(stage.lists)
    replace(stage, gates={}).run("near", "size_lists", size=(1, 1), **lists)


def scale_of(size: tuple[int, int]) -> int:
    """Side of the squares of an image that stand for a pixel of light on what rests [px]."""
    scale = 2
    while max(size) > scale * LONGEST:
        scale *= 2
    return scale


def _tile_grid(size: tuple[int, int]) -> tuple[int, int]:
    """Tiles of the change flags across and down."""
    side = int(wgsl.load(f"{FOLDER}/active.wgsl").constant("LIGHT_TILE"))
    return -(-size[0] // side), -(-size[1] // side)
