"""Sample reprojection: samples of up to three frames moved to every time of the exposure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import wgpu

from .. import gpu
from ..cameras import Camera, Reprojections
from ..errors import InputError
from ..images import Scratch
from ..velocity import view_of

GOLDEN = (5**0.5 - 1) / 2
FORMS = ("slices", "published")
SHOWN = ("color", "count")


class Reproject:
    """Every sample moves to its place at every time; the nearest one is seen.

    Taylor's "Fast Motion Blur through Sample Reprojection" with what he names as future work:
    a depth test in every time slice, moving objects, the GPU. `samples` are time slices.
    Samples come from the frame itself; what they leave open is filled from the neighbouring
    frames, where there are any. Integer atomics alone decide what is seen: the same bits every run.
    `form`: "published" is the paper's: the previous frame's samples go towards this frame's
    camera and back in `samples` steps, are rounded to pixels and counted without a depth test,
    so the exposure is the interval between the two whatever the shutter. Cameras are
    interpolated; where there are vectors, samples follow those. Colour is summed in fixed
    point: 0 to 262143 in steps of 1/16384, without overflow.
    `show`: "count" gives the share of slices that reached a pixel (his figure 4).

    Strong: blur goes over silhouettes, what is hidden appears, many samples cost little more
    quality loss than few. Artefacts: copies where motion is fast against `samples`, edges up
    to a pixel wide of their place, holes where no frame saw what is there.
    """

    name = "reproject"
    needs = frozenset({"color", "motion", "depth"})
    uses = frozenset({"neighbours"})

    def __init__(self, device, *, output="rgba32float", show="color", form="slices"):
        if form not in FORMS:
            raise InputError(f"form must be one of {', '.join(FORMS)}, got {form!r}")
        if show not in SHOWN:
            raise InputError(f"show must be one of {', '.join(SHOWN)}, got {show!r}")
        self._device, self._output, self._show, self._form = device, output, show, form
        self._nearest, self._winner = Scratch(device), Scratch(device)
        self._means, self._counts = Scratch(device), Scratch(device)
        self._carries = Scratch(device)

    def encode(self, encoder, inputs, output):
        """Record four passes a slice and source, or one a step."""
        record = self._published if self._form == "published" else self._slices
        record(encoder, inputs, output)

    def _slices(self, encoder, inputs, output):
        weighted = inputs.weight is not None
        kernel = gpu.kernel(
            self._device,
            "blur/reproject.wgsl",
            {"Output": self._output},
            WEIGHTED=weighted,
            COUNTS=self._show == "count",
        )
        pixels = inputs.given.size[0] * inputs.given.size[1]
        shared = {
            "own": inputs.color,
            "linear": inputs.linear,
            "nearest": self._nearest.at_least(4 * pixels),
            "winner": self._winner.at_least(4 * pixels),
            "means": self._means.at_least(16 * pixels),
            "counts": self._counts.at_least(4 * pixels),
            "output": output,
        }
        sources = [(0, inputs.color, inputs.motion, inputs.depth, inputs.weight)]
        sources += [(n.offset, n.color, n.motion, n.depth, None) for n in inputs.neighbours]
        # All pixels share a slice's time, so jitter is the frame's: its next golden section.
        shift = inputs.jitter * (inputs.number * GOLDEN % 1 - 0.5)
        times = inputs.shutter.sample_times(inputs.samples, shift)

        def run(entry: str, source: int, time: float, first: bool = False) -> None:
            offset, color, motion, depth, weight = sources[source]
            data = np.zeros((), kernel.source.dtype("Slice"))
            data["time"], data["offset"], data["source"] = time, offset, source
            data["first"] = first
            kernel.run(
                encoder,
                entry,
                inputs.given,
                slice=self._device.create_buffer_with_data(
                    label="slice", data=data, usage=wgpu.BufferUsage.UNIFORM
                ),
                color=color,
                motion=motion,
                depth=depth,
                weight=weight or (inputs.one if weighted else inputs.none),
                **shared,
            )

        for i, time in enumerate(times):
            run("clear", 0, time, first=i == 0)
            for entry in ("depths", "winners", "gather"):
                for source in range(len(sources)):
                    run(entry, source, time)
        run("finish", 0, 0.0)

    def _published(self, encoder, inputs, output):
        camera: Reprojections | None = inputs.camera
        ways: list[tuple[Camera, Camera]] = []
        if camera and camera.prev and camera.here.view_from_world is not None:
            ways = [(camera.here, camera.prev), (camera.prev, camera.here)]
        kernel = gpu.kernel(
            self._device,
            "blur/reproject_published.wgsl",
            {"Output": self._output},
            CAMERA=bool(ways),
            WEIGHTED=inputs.weight is not None,
            COUNTS=self._show == "count",
        )
        pixels = inputs.given.size[0] * inputs.given.size[1]
        shared = {
            "own": inputs.color,
            "sums": self._means.at_least(16 * pixels),
            "carries": self._carries.at_least(16 * pixels),
            "counts": self._counts.at_least(4 * pixels),
            "output": output,
        }
        here = (inputs.color, inputs.motion, inputs.depth, inputs.weight or inputs.one)

        def run(entry: str, source, time: float, way: tuple[Camera, Camera] | None) -> None:
            color, motion, depth, weight = source
            data = np.zeros((), kernel.source.dtype("Step"))
            data["time"] = time
            if camera and way:
                between = way[0].toward(way[1], abs(time))
                seen = replace(camera, here=way[0], prev=None, next=between)
                data["view"] = view_of(seen, inputs.given.size)
                data["clip_from_pixel"] = seen.matrices()[0, 1].T
            kernel.run(
                encoder,
                entry,
                inputs.given,
                step_=self._device.create_buffer_with_data(
                    label="step", data=data, usage=wgpu.BufferUsage.UNIFORM
                ),
                color=color,
                motion=motion,
                depth=depth,
                weight=weight,
                **shared,
            )

        cycles = [(here, -1)]
        for near in inputs.neighbours:
            if near.offset == -1:
                cycles.append(((near.color, near.motion, near.depth, inputs.one), 1))
        run("clear", here, 0, None)
        for k, (source, direction) in enumerate(cycles):
            for i in range(inputs.samples):
                share = i / max(inputs.samples - 1, 1)
                run("splat", source, direction * share, ways[k] if ways else None)
        run("resolve", here, 0, None)
