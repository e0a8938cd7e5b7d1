"""Sample reprojection: samples of up to three frames moved to every time of the exposure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
import wgpu

from .. import gpu
from ..camera import Camera, Reprojections
from ..errors import InputError
from ..gpu import wgsl
from ..gpu.textures import ScratchBuffer
from ..gpu_frame.velocity import viewport_of
from .contract import Inputs, PreparedFrame, View
from .five_positions import Bends
from .options import MethodOptions

Pair = tuple[Camera, Camera]
"""The camera of a frame, and that towards which its samples go."""
GOLDEN = (5**0.5 - 1) / 2
AT_ONCE = 64 << 20  # bytes of depths, or links: how many slices, or steps, are done together


class Reproject:
    """Every sample moves to its place at every time; the nearest one is seen.

    Taylor's "Fast Motion Blur through Sample Reprojection" with the extensions the paper suggests:
    a depth test in every time slice, moving objects, the GPU. `samples` are time slices.
    Samples come from the frame itself; holes between them are filled from the neighbouring
    frames, where there are any. Integer atomics alone decide what is seen: the same bits every run.
    `variant`: "published" is the paper's: the previous frame's samples go towards this frame's
    camera and back in `samples` steps, are rounded to pixels and counted without a depth test,
    so the exposure is the interval between the two whatever the shutter. Cameras are
    interpolated; where there are vectors, samples follow those. Colour is summed in fixed
    point of 64 bits: 0 to 262143 in steps of 1/16384, other values are clamped to that range, and
    60,000 samples on one pixel in a few steps do not overflow; more are not all counted.
    Refinements named in the paper are optional there. `facing`: a sample whose surface faces
    away from the interpolated camera is dropped; needs cameras; the surface is that of the
    normals, or of the depth. `depth_test`: of the samples that a step puts on one pixel only
    the nearest counts, the least number among equals. `splat`: "line" draws every sample from
    its place at a step to that at the next, each pixel having its share of the step.
    `show`: "count" gives the share of slices that reached a pixel (the paper's figure 4).

    Strong: blurs across silhouettes, reveals hidden surfaces, and many samples cost little more
    than few. Artefacts: ghosts where motion is fast relative to `samples`, edges displaced by up
    to a pixel, holes where no frame shows the surface.
    """

    name = "reproject"
    needs = frozenset({"color", "motion", "depth"})
    uses = frozenset({"neighbours", "normal"})
    bend = float(wgsl.load("common/path.wgsl").constant("MOST_BEND"))

    @dataclass(frozen=True, kw_only=True)
    class Options(MethodOptions):
        """The variant, and the extensions the paper suggests."""

        variant: Annotated[
            Literal["slices", "published"],
            "depth test in every time slice, or the paper's sample counting",
        ] = "slices"
        show: Annotated[
            Literal["color", "count"],
            "the blurred image, or the share of slices that reached a pixel",
        ] = "color"
        facing: Annotated[
            bool, "published: drop surfaces that face away from the interpolated camera"
        ] = False
        depth_test: Annotated[bool, "published: keep only the nearest sample per pixel"] = False
        splat: Annotated[
            Literal["point", "line"], "published: points, or lines between the steps"
        ] = "point"

        def __post_init__(self) -> None:
            super().__post_init__()
            published = self.facing or self.depth_test or self.splat != "point"
            if self.variant != "published" and published:
                raise InputError("`facing`, `depth_test` and `splat` need `variant='published'`")
            if self.depth_test and self.splat == "line":
                raise InputError(
                    "`depth_test` needs `splat='point'`, as a line has no single depth"
                )

    def __init__(self, device: wgpu.GPUDevice, options: Options, *, output: str = "rgba32float"):
        self._device, self._output, self._options = device, output, options
        self._nearest, self._winner = ScratchBuffer(device), ScratchBuffer(device)
        self._hits, self._open = ScratchBuffer(device), ScratchBuffer(device)
        self._means, self._counts = ScratchBuffer(device), ScratchBuffer(device)
        self._carries, self._links, self._heads = (ScratchBuffer(device) for _ in range(3))
        self._bends = Bends(device)

    def repeats(self, inputs: Inputs) -> bool:
        """See `Method`. The published variant reads cameras, and jitter depends on the number."""
        return self._options.variant != "published" and not inputs.jitter

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record three passes a source for several slices, or two for several steps."""
        record = self._published if self._options.variant == "published" else self._slices
        record(encoder, inputs, output)

    def _slices(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        sources = inputs.frames
        kernel = gpu.kernel(
            self._device,
            "methods/reproject.wgsl",
            {"Output": self._output},
            BOX_SHUTTER=inputs.even,
            WEIGHTED=inputs.frame.weight is not None,
            COUNTS=self._options.show == "count",
            FIVE_POSITIONS=len(sources) > 1,
        )
        # Paths through five positions, where there are neighbours to lead on.
        bends: list[View | None] = [None]
        if len(sources) > 1:
            bends = [*self._bends.encode(encoder, inputs, sources)]
        # As many slices at once as the buffers of depths may hold.
        width, height = inputs.bindings.size
        pixels = width * height
        bits = kernel.source.integer("BLOCK_BITS")
        blocks = ((width >> bits) + 1) * ((height >> bits) + 1)
        most = max(1, min(kernel.source.integer("SLICES"), AT_ONCE // (4 * pixels)))
        most = min(most, inputs.samples)
        shared = {
            "own": inputs.frame.color,
            "linear": inputs.linear,
            "nearest": self._nearest.at_least(4 * most * pixels),
            "winner": self._winner.at_least(4 * most * pixels),
            "hits": self._hits.at_least(4 * len(sources) * pixels),
            "open": self._open.at_least(4 * blocks),
            "means": self._means.at_least(16 * pixels),
            "counts": self._counts.at_least(4 * pixels),
            "output": output,
        }

        def run(entry: str, source: int, first: int, count: int) -> None:
            frame = sources[source]
            # All pixels share a slice's time, so jitter is the frame's: its next golden section.
            shift = inputs.jitter * (inputs.number * GOLDEN % 1 - 0.5)
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                chunk={
                    "first": first,
                    "count": count,
                    "source": source,
                    "offset": frame.offset,
                    "shift": shift,
                },
                color=frame.color,
                motion=frame.motion,
                depth=frame.depth,
                weight=frame.weight,
                bends=bends[source],
                **shared,
            )

        # In each slice a pixel shows the nearest of the frame's own samples. Only pixels that it
        # leaves open are filled from the neighbours.
        encoder.clear_buffer(shared["means"])
        encoder.clear_buffer(shared["counts"])
        for first in range(0, inputs.samples, most):
            for name in ("nearest", "winner", "open"):
                encoder.clear_buffer(shared[name])
            count = min(most, inputs.samples - first)
            for together in ([0], range(1, len(sources))):
                for entry in ("splat_depths", "splat_winners", "resolve"):
                    for source in together:
                        run(entry, source, first, count)
        run("finish", 0, 0, 0)

    def _published(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        camera: Reprojections | None = inputs.frame.camera if inputs.frame.by_camera else None
        pairs: list[Pair] = []
        if camera and camera.prev and camera.here.view_from_world is not None:
            pairs = [(camera.here, camera.prev), (camera.prev, camera.here)]
        if self._options.facing and not pairs:
            raise InputError(
                "facing needs the cameras of this and the previous frame with view_from_world, "
                "and no vectors"
            )
        # The paper's samples are those of this frame and of the previous one.
        prev = [n for n in inputs.frames[1:] if n.offset == -1]
        normals = inputs.frame.normal is not None and all(n.normal is not None for n in prev)
        kernel = gpu.kernel(
            self._device,
            "methods/reproject_published.wgsl",
            {"Output": self._output},
            CAMERA=bool(pairs),
            WEIGHTED=inputs.frame.weight is not None,
            COUNTS=self._options.show == "count",
            LINES=self._options.splat == "line",
            FACING=self._options.facing,
            NORMALS=normals,
            NEAREST_ONLY=self._options.depth_test,
        )
        # A link is a pixel and a step in 32 bits, which bounds the steps that are done together.
        width, height = inputs.bindings.size
        bits = (width - 1).bit_length(), (width - 1).bit_length() + (height - 1).bit_length()
        rows = kernel.source.integer("ROWS")
        most = max(
            1,
            min(rows - 1, 2 ** (32 - bits[1]) - 2, AT_ONCE // (4 * width * height), inputs.samples),
        )
        most = 1 if self._options.depth_test else most
        shared = {
            "own": inputs.frame.color,
            "heads": self._heads.at_least(4 * width * height),
            "links": self._links.at_least(4 * most * width * height),
            "sums": self._means.at_least(16 * width * height),
            "carries": self._carries.at_least(16 * width * height),
            "counts": self._counts.at_least(4 * width * height),
            "output": output,
        }
        encoder.clear_buffer(shared["heads"])

        def run(
            entry: str, source: PreparedFrame, steps: np.ndarray, pair: Pair | None,
            first: bool, last: bool,
        ) -> None:  # fmt: skip
            chunk: dict[str, Any] = {"bits": bits, "steps": max(len(steps) - 1, 0)}
            table = np.zeros(rows, kernel.source.dtype("Step"))
            table["time"][: len(steps)] = steps
            if camera and pair:
                way = replace(camera, here=pair[0], prev=None, next=pair[1])
                chunk |= _steps_between(way, inputs.bindings.size, np.abs(steps), table)
            kernel.run(
                encoder,
                entry,
                inputs.bindings,
                chunk=chunk | {"first": first, "last": last},
                steps=table,
                color=source.color,
                motion=source.motion,
                depth=source.depth,
                normal=source.normal if self._options.facing and normals else None,
                weight=source.weight,
                **shared,
            )

        # This frame's samples go back to the previous camera, and the previous frame's go ahead.
        sources = [inputs.frame, *prev]
        shares = np.linspace(0, 1, inputs.samples) if inputs.samples > 1 else np.zeros(1)
        jobs = []
        for k, source in enumerate(sources):
            times = (-1, 1)[k] * np.append(shares, shares[-1])  # what is one too many ends a line
            for i in range(0, inputs.samples, most):
                jobs.append((source, times[i : i + most + 1], pairs[k] if pairs else None))
        # Points are linked to lists, which are summed chunk by chunk; lines need no lists.
        if self._options.splat == "line":
            run("resolve", sources[0], shares[:0], None, True, False)
        for i, (source, steps, pair) in enumerate(jobs):
            if self._options.splat == "line":
                run("splat_lines", source, steps, pair, False, False)
            else:
                run("link", source, steps, pair, False, False)
                run("resolve", source, steps, pair, i == 0, i == len(jobs) - 1)
        if self._options.splat == "line":
            run("resolve", sources[0], shares[:0], None, False, True)


def _steps_between(
    cameras: Reprojections, size: tuple[int, int], shares: np.ndarray, table: np.ndarray
) -> dict[str, Any]:
    """Fields of a Chunk for the way from a camera to the next one; fills a row of `table` a share.

    The Step of a share has the camera that is so far on the way.
    """
    assert cameras.next is not None
    for row, share in zip(table, shares, strict=False):
        between = cameras.here.toward(cameras.next, share)
        row["clip_from_pixel"] = replace(cameras, next=between).matrices()[0, 1].T
        row["eye"] = _eye(between)
    return {
        "viewport": viewport_of(cameras, size),
        "world_from_pixel": cameras.world_from_pixel().T,
        "eye": _eye(cameras.here),
    }


def _eye(camera: Camera) -> np.ndarray:
    """A camera's place in the world, or the direction to it where it is orthographic."""
    assert camera.view_from_world is not None
    return np.linalg.inv(camera.view_from_world)[:, 2 if camera.orthographic else 3]
