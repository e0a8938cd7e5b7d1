"""The stages of a picture's motion as passes, recorded into one encoder; nothing is read back.

States are textures of to_prev, to_next [px of their level] (rgba32float).
"""

from __future__ import annotations

import math
from dataclasses import replace

import wgpu

from ... import gpu
from ...gpu import wgsl
from .choice import choose
from .levels import FOLDER, KEPT, STATE, Levels

_FINER = {"MEDIAN": 2, "RADIUS": 2}, {"MEDIAN": 1, "RADIUS": 3}  # of refine.wgsl, on both levels


class DenseStages(Levels):
    """Passes for pictures of one size, with their textures; all are made once.

    Pictures have a place by their number: a picture and its neighbours have three. The commands of
    each place are recorded once, and played for every picture that has it.
    """

    def __init__(self, device: wgpu.GPUDevice, size: tuple[int, int]):
        super().__init__(device, size)
        self._tapes = gpu.Tapes()
        self._tables = self.buffer("tables", 4 * _constant("summary", "TABLES", "BINS"))
        self._list, self._groups_of_blocks = (
            self.buffer(struct, wgsl.load(f"{FOLDER}/unfit.wgsl").dtype(struct).itemsize)
            for struct in ("List", "Groups")
        )

    def add(self, encoder: wgpu.GPUCommandEncoder, number: int, picture: wgpu.GPUTextureView):
        """Record the pyramid of a linear picture."""

        def record(tape: gpu.Tape) -> None:
            self._add(tape, number, picture)

        self._tapes.play(encoder, self.frame(self.size), number % KEPT, (picture,), record)

    def _add(self, encoder: gpu.Tape, number: int, picture: wgpu.GPUTextureView) -> None:
        turn, none = self.turn(number, False, False), self.images.view("none", (1, 1), STATE)
        blank = self.array("blank", (1, 1))
        for level, size in enumerate(self.sizes):
            finer = self.array(f"level {level - 1}", self.sizes[level - 1]) if level else blank
            self.run(
                encoder, "levels", "reduce" if level else "write_grey", size, turn=turn,
                picture=none if level else picture, finer=finer,
                output=self.array(f"level {level}", size),
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
        turn, place = self.turn(number, has_prev, has_next), number % KEPT
        motion, order = self.images.texture(f"motion {place}", self.size, STATE), None
        if depth:
            order = self.images.texture(f"depth {place}", self.size, "r32float")

        def record(tape: gpu.Tape) -> None:
            self._find(tape, turn, has_prev and has_next, motion, order)

        self._tapes.play(encoder, self.frame(self.size), (turn.uid, depth), (), record)
        return motion, order

    def _find(
        self,
        encoder: gpu.Tape,
        turn: wgpu.GPUBuffer,
        has_both: bool,
        motion: wgpu.GPUTexture,
        order: wgpu.GPUTexture | None,
    ) -> None:
        dense = self._dense(encoder, turn)
        begin = self._measured(encoder, turn, dense)
        state = self._searched(encoder, turn, begin)
        middle = self._raised(encoder, turn, state)
        found = self.images.view_of(motion)
        choose(self, encoder, turn, has_both, dense, middle, found)
        if order is not None:
            self.run(
                encoder, "depth", "main", self.size, turn=turn, motion=found,
                small=begin, summary=self.summary, output=self.images.view_of(order),
            )  # fmt: skip

    def _dense(self, encoder: gpu.Tape, turn: wgpu.GPUBuffer) -> wgpu.GPUTextureView:
        """Motion by dense inverse search, from coarse to fine."""
        images = self.images
        motion = images.view("still", (1, 1), STATE)  # never written, so it is 0
        stride, across, down = (_constant("patches", n) for n in ("STRIDE", "ACROSS", "DOWN"))
        for level, size in reversed(list(enumerate(self.sizes))):
            columns, rows = (-(-n // stride) + 1 for n in size)
            patches = images.view(f"patches {level}", (columns, 2 * rows), STATE)
            levels, coarser = self.level(level), motion
            motion = images.view(f"dense {level}", size, STATE)
            self.run(
                encoder, "patches", "search", size, (-(-columns // across), 2 * -(-rows // down)),
                turn=turn, levels=levels, coarser=coarser, output=patches,
            )  # fmt: skip
            self.run(
                encoder, "densify", "main", size,
                turn=turn, levels=levels, patches=patches, output=motion,
            )  # fmt: skip
        return motion

    def _measured(
        self, encoder: gpu.Tape, turn: wgpu.GPUBuffer, dense: wgpu.GPUTextureView
    ) -> wgpu.GPUTextureView:
        """Motion on the small level; how well it fits, and what most of it is, are kept."""
        size = self.sizes[self.small]
        begin = self.images.view("begin", size, STATE)
        encoder.clear_buffer(self._tables)
        self.run(
            encoder, "measure", "main", size, turn=turn, levels=self.level(self.small),
            motion=dense, begin=begin, fits=self.images.view("fits", size, STATE),
            tables=self._tables,
        )  # fmt: skip
        self.run(
            encoder, "summarize", "main", size, (2, 1), begin=begin,
            tables=self._tables, output=self.summary,
        )  # fmt: skip
        return begin

    def _searched(
        self, encoder: gpu.Tape, turn: wgpu.GPUBuffer, begin: wgpu.GPUTextureView
    ) -> wgpu.GPUTextureView:
        """The state of the small level, with the ways of blocks where they fit better."""
        images, size = self.images, self.sizes[self.small]
        spacing = _constant("summary", "SPACING")
        cells = max(1, size[0] // spacing), max(1, size[1] // spacing)
        ways, levels = images.view("ways", cells, STATE), self.level(self.small)
        bound = {"turn": turn, "levels": levels, "summary": self.summary, "output": ways}
        encoder.clear_buffer(self._groups_of_blocks)
        unfit, frame = gpu.kernel(self.device, f"{FOLDER}/unfit.wgsl"), self.frame(size)
        unfit.run(
            encoder, "main", replace(frame, size=cells), list=self._list,
            groups=self._groups_of_blocks, fits=images.view("fits", size, STATE), **bound,
        )  # fmt: skip
        blocks = gpu.kernel(self.device, f"{FOLDER}/blocks.wgsl")
        groups = {"buffer": self._groups_of_blocks, "offset": 0}
        blocks.run(encoder, "search", frame, groups, list=self._list, **bound)
        state, areas = images.view("spread", size, STATE), images.view("areas", size, "r32float")
        self.run(
            encoder, "spread", "main", size,
            turn=turn, levels=levels, begin=begin, ways=ways, output=state, areas=areas,
        )  # fmt: skip
        return self._refined(encoder, turn, self.small, state)

    def _raised(
        self, encoder: gpu.Tape, turn: wgpu.GPUBuffer, state: wgpu.GPUTextureView
    ) -> wgpu.GPUTextureView:
        """The state of the middle level."""
        size = self.sizes[self.middle]
        raised = self.images.view("raised", size, STATE)
        self.run(
            encoder, "raise", "main", size, turn=turn, levels=self.level(self.middle),
            small=self.level(self.small), state=state, output=raised,
        )  # fmt: skip
        return self._refined(encoder, turn, self.middle, raised, 1)

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
        areas = self.images.view("areas", self.sizes[self.small], "r32float")
        kernel.run(
            encoder, "main", self.frame(size),
            turn=turn, levels=self.level(level), state=state, areas=areas, output=output,
        )  # fmt: skip
        return output


def _constant(file: str, *names: str) -> int:
    """The product of constants of a shader."""
    source = wgsl.load(f"{FOLDER}/{file}.wgsl")
    return math.prod(int(source.constant(name)) for name in names)
