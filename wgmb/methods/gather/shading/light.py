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
from ....gpu.textures import ScratchBuffer, TexturePool, Word
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
_COUNT = 4 * wgsl.load(f"{FOLDER}/active.wgsl").integer("LISTED")  # byte of a list's number
LONGEST = 480  # px of light along the longer side of an image, on static surfaces, at most
LEAST_NODES, MOST_NODES = 4, 8  # times of an exposure at which light is known,
NODES_PER_INTERVAL = 12  # as many in a frame interval within these bounds
SCREENED, MEASURED, FOLLOWED = 1, 2, 3
"""Steps of the passes: tiles are screened, changes are measured in those where light may differ,
and light is followed where it changes. Without an earlier step's finds, the next has no work."""


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
        self.finds: tuple[Word, ...] = ()
        """Of the frame that was recorded last, once it was run: the word `k` is not 0 if what step
        `k + 1` found is work for the next one."""

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        kinds: Sequence[Kind],
        times: LightTimes,
        weight: View | None,
        steps: int = FOLLOWED,
    ) -> Added | None:
        """Record the passes of the first `steps`; None if light is not followed.

        `weight`: of every pixel (see PreparedFrame).
        """
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
        kept: dict[str, Any] = {
            name: buffer.at_least(sizes.get(name, 16 * (3 + tiles // 4)))
            for name, buffer in self._kept.items()
        }
        for buffer in kept.values():
            encoder.clear_buffer(buffer)
        change_flags, gates = kept.pop("change flags"), kept.pop("gates")
        self.finds = (kept["doubtful"], _COUNT), (change_flags, 0)
        begun: set[str] = set()
        stages = [
            Stage(
                self._device,
                self._images,
                encoder,
                bindings,
                "glossy" if kind.pulled else "diffuse",
                pulled=kind.pulled,
                resting=kind.resting,
                change_flags=change_flags,
                lists=kept,
                begun=begun,
            )
            for kind in kinds
        ]
        whole, grid = stages[-1], _tile_grid(bindings.size)
        # Most light rests: a first look lists the tiles in which a neighbour may differ.
        for stage, kind in zip(stages, kinds, strict=True):
            screen(stage, kind.frames, scale)
        whole.run("near", "list_doubtful", size=grid, **kept)
        if steps == SCREENED:
            return None
        whole.run("near", "size_doubtful", size=(1, 1), **kept)
        # There the change to each neighbour is measured, and the tiles with one are listed.
        if resting:
            kinds = [replace(one, frames=reduced(whole, one.frames, scale)) for one in kinds]
        changed = [
            changes(stage, kind.frames, kind.albedo, kind.by_color)
            for stage, kind in zip(stages, kinds, strict=True)
        ]
        if steps == MEASURED:
            return None
        whole.run("near", "main", size=grid, **kept)
        whole.run("near", "size_lists", size=(1, 1), **kept)
        # Around these, light is followed to the times of the nodes; nowhere, if none changes.
        gated = whole.gated(grids(whole.size), gates).gates
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
        # Darkness of shadows, or levels of reflections, in all frames, and its flow between them.
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
        # A layer for each node, and two for the light of the neighbours themselves.
        result = self._images.texture(
            f"light {stage.name}", stage.size, "rgba16float", times.count + 2
        )
        pixels = 8 * stage.size[0] * stage.size[1]
        buffers: dict[str, Any] = {
            name: buffer.at_least(pixels) for name, buffer in self._pushed.items()
        }
        for buffer in buffers.values():
            stage.encoder.clear_buffer(buffer, 0, pixels)
        constants: dict[str, float] = {
            "HAS_ALBEDO": kind.albedo is not None,
            "WEIGHTED": weight is not None,
            "ONTO": earlier is not None,
            "TOLD": self._confidence,
        }
        bounds = stage.texture("range", "rgba32uint")
        compose = partial(
            stage.run,
            "compose",
            constants=constants,
            light_here=kind.frames[0].light,
            albedo=kind.albedo,
            weight=weight,
            after=changed.get(1),
            **buffers,
        )
        # For each node and each neighbour: shadows are pushed along their flow to its time, and
        # what arrives, or where reflections are pulled from, becomes an addition to the colours.
        for i, time in enumerate([*times, -1.0, 1.0]):
            side, share = (-1 if time < 0 else 1), min(abs(time), 1.0)
            entry = "main" if i < times.count else "add_neighbour"
            if side not in changed:
                entry = "rest" if i < times.count else "add_nothing"
            way = found.get(side)
            both = {"values": present[0], "values_there": present.get(side),
                    "flow": way and way.ahead, "flow_back": way and way.back}  # fmt: skip
            if entry == "main" and not kind.pulled:
                stage.run("push", over="near", push={"time": share}, **both, **buffers)
            passes: list[tuple[str, str, View | None, View | None]] = [
                (entry, "near", bounds, None)
            ]
            if entry == "main":
                passes = [("begin", "beside", bounds, None), (entry, "changing", bounds, None)]
            if not i:
                passes.insert(0, ("find_range", "changing", None, bounds))
            for one, over, read, written in passes:
                compose(
                    one,
                    over=over,
                    node={"time": share},
                    before=changed.get(side) if entry == "add_neighbour" else changed.get(-1),
                    earlier=None if earlier is None else self._images.layer(earlier, i),
                    added=self._images.layer(result, i),
                    range=read,
                    range_out=written,
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
            carry={"last": max(0.0, *(side * time for time in times))},
            values=darkness,
            flow=way.ahead,
            changing=stage.lists["changing"],
        )
    lists: dict[str, Any] = dict(stage.lists)
    replace(stage, gates={}).run("near", "size_lists", size=(1, 1), **lists)


def scale_of(size: tuple[int, int]) -> int:
    """Side of the squares of an image that share a pixel of light on static surfaces [px]."""
    scale = 2
    while max(size) > scale * LONGEST:
        scale *= 2
    return scale


def _tile_grid(size: tuple[int, int]) -> tuple[int, int]:
    """Tiles of the change flags across and down."""
    side = wgsl.load(f"{FOLDER}/active.wgsl").integer("LIGHT_TILE")
    return -(-size[0] // side), -(-size[1] // side)
