"""The stages of a picture's motion as passes, recorded into one encoder; nothing is read back.

States are textures of to_prev, to_next [px of their level] (rgba32float).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import wgpu

from ... import gpu
from ...gpu import wgsl
from ...gpu.textures import TexturePool
from ..dis.blocks import HALF, SMALL

FOLDER = "flow/dense"
COARSEST = 40  # px along the longer side of the coarsest level
KEPT = 3  # pictures: one and its neighbours
STATE = "rgba32float"
_FINER = {"MEDIAN": 2, "RADIUS": 2}, {"MEDIAN": 1, "RADIUS": 3}  # of refine.wgsl, on both levels


def sizes_of(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Width, height of every level: the picture's own, then sides of 40 px times 2, 4, ...."""
    longest = max(size)
    halvings = max(0, math.ceil(math.log2(longest / COARSEST)))
    sides = [COARSEST << k for k in reversed(range(halvings))]
    width, height = size
    return [size, *((_at(width, s, longest), _at(height, s, longest)) for s in sides)]


def _at(n: int, side: int, longest: int) -> int:
    """A side of `n` px in a picture whose `longest` side becomes `side`."""
    return max(1, round(n * side / longest))


class DenseStages:
    """Passes for pictures of one size, with their textures; all are made once.

    Pictures have a place by their number: a picture and its neighbours have three. The commands of
    each place are recorded once, and played for every picture that has it.
    """

    def __init__(self, device: wgpu.GPUDevice, size: tuple[int, int]):
        self.device, self.size, self.sizes = device, size, sizes_of(size)
        self.images, self._frame = TexturePool(device), gpu.SizeBindings(device)
        self._tapes = gpu.Tapes()
        self._small, self._middle = (
            next(k for k, s in enumerate(self.sizes) if max(s) <= longest or s == self.sizes[-1])
            for longest in (SMALL, HALF)
        )
        self._turns: dict[tuple[int, int, int], wgpu.GPUBuffer] = {}
        self._tables = self._buffer("tables", 4 * _constant("summary", "TABLES", "BINS"))
        self._list, self._groups_of_blocks, self._summary = (
            self._buffer(struct, wgsl.load(f"{FOLDER}/unfit.wgsl").dtype(struct).itemsize)
            for struct in ("List", "Groups", "Summary")
        )

    def add(self, encoder: wgpu.GPUCommandEncoder, number: int, picture: wgpu.GPUTextureView):
        """Record the pyramid of a linear picture."""

        def record(tape: gpu.Tape) -> None:
            self._add(tape, number, picture)

        self._tapes.play(encoder, self._frame(self.size), number % KEPT, (picture,), record)

    def _add(self, encoder: gpu.Tape, number: int, picture: wgpu.GPUTextureView) -> None:
        turn, none = self._turn(number, False, False), self.images.view("none", (1, 1), STATE)
        blank = self._array("blank", (1, 1))
        for level, size in enumerate(self.sizes):
            finer = self._array(f"level {level - 1}", self.sizes[level - 1]) if level else blank
            self._run(
                encoder, "levels", "reduce" if level else "write_grey", size, turn=turn,
                picture=none if level else picture, finer=finer,
                output=self._array(f"level {level}", size),
            )  # fmt: skip

    def find(
        self,
        encoder: wgpu.GPUCommandEncoder,
        number: int,
        has_prev: bool,
        has_next: bool,
        depth: bool,
    ) -> tuple[wgpu.GPUTexture, wgpu.GPUTexture | None]:
        """Record the motion of a picture that was added, as its neighbours were; and its depth.

        The textures are valid until those of `number` + KEPT are asked for.
        """
        turn, place = self._turn(number, has_prev, has_next), number % KEPT
        motion, order = self.images.texture(f"motion {place}", self.size, STATE), None
        if depth:
            order = self.images.texture(f"depth {place}", self.size, "r32float")

        def record(tape: gpu.Tape) -> None:
            self._find(tape, turn, motion, order)

        self._tapes.play(encoder, self._frame(self.size), (turn.uid, depth), (), record)
        return motion, order

    def _find(
        self,
        encoder: gpu.Tape,
        turn: wgpu.GPUBuffer,
        motion: wgpu.GPUTexture,
        order: wgpu.GPUTexture | None,
    ) -> None:
        dense = self._dense(encoder, turn)
        begin = self._measured(encoder, turn, dense)
        state = self._searched(encoder, turn, begin)
        middle = self._raised(encoder, turn, state)
        found = self.images.view_of(motion)
        self._choose(encoder, turn, dense, middle, found)
        if order is not None:
            self._run(
                encoder, "depth", "main", self.size, turn=turn, motion=found,
                small=begin, summary=self._summary, output=self.images.view_of(order),
            )  # fmt: skip

    def _dense(self, encoder: gpu.Tape, turn: wgpu.GPUBuffer) -> wgpu.GPUTextureView:
        """Motion by dense inverse search, from coarse to fine."""
        images = self.images
        motion = images.view("still", (1, 1), STATE)  # never written, so it is 0
        stride, across, down = (_constant("patches", n) for n in ("STRIDE", "ACROSS", "DOWN"))
        for level, size in reversed(list(enumerate(self.sizes))):
            columns, rows = (-(-n // stride) + 1 for n in size)
            patches = images.view(f"patches {level}", (columns, 2 * rows), STATE)
            levels, coarser = self._level(level), motion
            motion = images.view(f"dense {level}", size, STATE)
            self._run(
                encoder, "patches", "search", size, (-(-columns // across), 2 * -(-rows // down)),
                turn=turn, levels=levels, coarser=coarser, output=patches,
            )  # fmt: skip
            self._run(
                encoder, "densify", "main", size,
                turn=turn, levels=levels, patches=patches, output=motion,
            )  # fmt: skip
        return motion

    def _measured(
        self, encoder: gpu.Tape, turn: wgpu.GPUBuffer, dense: wgpu.GPUTextureView
    ) -> wgpu.GPUTextureView:
        """Motion on the small level; how well it fits, and what most of it is, are kept."""
        size = self.sizes[self._small]
        begin = self.images.view("begin", size, STATE)
        encoder.clear_buffer(self._tables)
        self._run(
            encoder, "measure", "main", size, turn=turn, levels=self._level(self._small),
            motion=dense, begin=begin, fits=self.images.view("fits", size, STATE),
            tables=self._tables,
        )  # fmt: skip
        self._run(
            encoder, "summarize", "main", size, (2, 1), begin=begin,
            tables=self._tables, output=self._summary,
        )  # fmt: skip
        return begin

    def _searched(
        self, encoder: gpu.Tape, turn: wgpu.GPUBuffer, begin: wgpu.GPUTextureView
    ) -> wgpu.GPUTextureView:
        """The state of the small level, with the ways of blocks where they fit better."""
        images, size = self.images, self.sizes[self._small]
        spacing = _constant("summary", "SPACING")
        cells = max(1, size[0] // spacing), max(1, size[1] // spacing)
        ways, levels = images.view("ways", cells, STATE), self._level(self._small)
        bound = {"turn": turn, "levels": levels, "summary": self._summary, "output": ways}
        encoder.clear_buffer(self._groups_of_blocks)
        unfit, frame = gpu.kernel(self.device, f"{FOLDER}/unfit.wgsl"), self._frame(size)
        unfit.run(
            encoder, "main", replace(frame, size=cells), list=self._list,
            groups=self._groups_of_blocks, fits=images.view("fits", size, STATE), **bound,
        )  # fmt: skip
        blocks = gpu.kernel(self.device, f"{FOLDER}/blocks.wgsl")
        groups = {"buffer": self._groups_of_blocks, "offset": 0}
        blocks.run(encoder, "search", frame, groups, list=self._list, **bound)
        state, areas = images.view("spread", size, STATE), images.view("areas", size, "r32float")
        self._run(
            encoder, "spread", "main", size,
            turn=turn, levels=levels, begin=begin, ways=ways, output=state, areas=areas,
        )  # fmt: skip
        return self._refined(encoder, turn, self._small, state)

    def _raised(
        self, encoder: gpu.Tape, turn: wgpu.GPUBuffer, state: wgpu.GPUTextureView
    ) -> wgpu.GPUTextureView:
        """The state of the middle level."""
        size = self.sizes[self._middle]
        raised = self.images.view("raised", size, STATE)
        self._run(
            encoder, "raise", "main", size, turn=turn, levels=self._level(self._middle),
            small=self._level(self._small), state=state, output=raised,
        )  # fmt: skip
        return self._refined(encoder, turn, self._middle, raised, 1)

    def _refined(
        self,
        encoder: gpu.Tape,
        turn: wgpu.GPUBuffer,
        level: int,
        state: wgpu.GPUTextureView,
        further: int = 0,
    ) -> wgpu.GPUTextureView:
        """Medians and steps of inverse search."""
        size = self.sizes[level]
        output = self.images.view(f"refined {further}", size, STATE)
        kernel = gpu.kernel(self.device, f"{FOLDER}/refine.wgsl", None, **_FINER[further])
        areas = self.images.view("areas", self.sizes[self._small], "r32float")
        kernel.run(
            encoder, "main", self._frame(size),
            turn=turn, levels=self._level(level), state=state, areas=areas, output=output,
        )  # fmt: skip
        return output

    def _choose(
        self,
        encoder: gpu.Tape,
        turn: wgpu.GPUBuffer,
        dense: wgpu.GPUTextureView,
        state: wgpu.GPUTextureView,
        output: wgpu.GPUTextureView,
    ) -> None:
        """The motion that costs less, in the whole picture."""
        images, size, levels = self.images, self.sizes[self._middle], self._level(self._middle)
        costs, along, chosen = (images.view(n, size, STATE) for n in ("costs", "along", "chosen"))
        areas = images.view("areas", self.sizes[self._small], "r32float")
        self._run(
            encoder, "compare", "main", size,
            turn=turn, levels=levels, motion=dense, state=state, areas=areas, output=costs,
        )  # fmt: skip
        self._run(encoder, "average", "along_x", size, costs=costs, output=along)
        self._run(encoder, "average", "choose", size, costs=along, output=chosen)
        self._run(
            encoder, "choose", "main", self.size, turn=turn, levels=self._level(0), small=levels,
            state=state, chosen=chosen, motion=dense, output=output,
        )  # fmt: skip

    def _run(
        self,
        encoder: gpu.Tape,
        file: str,
        entry: str,
        size: tuple[int, int],
        groups: tuple[int, int] | None = None,
        /,
        **bound: Any,
    ) -> None:
        """Record a pass over a picture of `size`, of so many `groups` if not one for each pixel."""
        kernel, frame = gpu.kernel(self.device, f"{FOLDER}/{file}.wgsl"), self._frame(size)
        if groups:
            many = (n * edge for n, edge in zip(groups, kernel.workgroup, strict=True))
            frame = replace(frame, size=tuple(many))
        kernel.run(encoder, entry, frame, **bound)

    def _turn(self, number: int, has_prev: bool, has_next: bool) -> wgpu.GPUBuffer:
        """The layers of a picture and its neighbours, of which the pyramid's levels have three."""
        here, before, after = (n % KEPT for n in (number, number - 1, number + 1))
        key = here, before if has_prev else here, after if has_next else here
        if key not in self._turns:
            layers = dict(zip(("here", "prev", "next"), key, strict=True))
            there = float(has_prev), float(has_next)
            made = gpu.uniform(self.device, f"{FOLDER}/turn.wgsl", "Turn", there=there, **layers)
            self._turns[key] = made
        return self._turns[key]

    def _level(self, level: int) -> wgpu.GPUTextureView:
        return self._array(f"level {level}", self.sizes[level])

    def _array(self, name: str, size: tuple[int, int]) -> wgpu.GPUTextureView:
        texture = self.images.texture(name, size, "r32float", KEPT)
        return self.images.view_of(texture, dimension="2d-array")

    def _buffer(self, name: str, size: int) -> wgpu.GPUBuffer:
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.INDIRECT
        return self.device.create_buffer(label=name, size=size, usage=usage)


def _constant(file: str, *names: str) -> int:
    """The product of constants of a shader."""
    source = wgsl.load(f"{FOLDER}/{file}.wgsl")
    return math.prod(int(source.constant(name)) for name in names)
