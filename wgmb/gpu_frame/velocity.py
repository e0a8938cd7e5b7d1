"""Motion of every pixel as one texture, from vectors, from depth and matrices, or both."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import wgpu

from .. import gpu
from ..camera import Reprojections, Window
from ..gpu import wgsl
from .views import FrameViews, View

FILE = "gpu_frame/velocity.wgsl"
_BAND = 1 << 20  # pixels of a dispatch: a tenth of a second on two cores without a GPU


class VelocityPass:
    """Records gpu_frame/velocity.wgsl; keeps two empty textures, and `in_place` a buffer.

    `in_place`: matrices are written into one buffer, so that its bind groups stay. Only for callers
    that submit each recording before they make the next one.
    """

    def __init__(self, device: wgpu.GPUDevice, none: View, no_object: View):
        self._device, self._none, self._no_object = device, none, no_object
        self.in_place = False
        self._table: wgpu.GPUBuffer | None = None

    def encode(
        self,
        encoder,
        bindings: gpu.FrameBindings,
        frame: FrameViews,
        limited: bool,
        output: View,
    ):
        """Record `output` = to_prev, to_next [px] of every pixel."""
        paired = frame.motion is not None
        to_prev = frame.motion if paired else frame.to_prev
        with_camera = frame.camera is not None
        kernel = gpu.kernel(
            self._device,
            FILE,
            PREV=to_prev is not None,
            NEXT=frame.to_next is not None or paired,
            PAIRED=paired,
            CAMERA=with_camera,
            OBJECTS=with_camera and frame.object_id is not None,
            SCALED=frame.scale is not None,
            LIMITED=limited,
            ADDED=frame.object_motion,
        )
        data, table, indices = self._matrices(bindings.size, frame.camera)
        for top, band in kernel.bands(bindings, _BAND):
            data["top"] = top
            kernel.run(
                encoder,
                "main",
                band,
                velocity=gpu.constant(self._device, "velocity", data),
                to_prev=to_prev or self._none,
                to_next=frame.to_next or self._none,
                depth=frame.depth or self._none,
                object=frame.object_id or self._no_object,
                scale=frame.scale or self._none,
                reprojections=table,
                indices=indices,
                motion=output,
            )

    def _matrices(self, size: tuple[int, int], camera: Reprojections | None):
        source = wgsl.load(FILE)
        data = np.zeros((), source.dtype("Velocity"))
        table = np.zeros(1, source.dtype("Reprojection"))
        indices = np.zeros(1, np.uint32)
        if camera is not None:
            matrices, indices = camera.matrices(), camera.indices
            data["viewport"], data["bodies"] = viewport_of(camera, size), len(matrices)
            table = np.zeros(len(matrices), source.dtype("Reprojection"))
            # Row i of a matrix in numpy is column i in WGSL.
            table["prev"] = matrices[:, 0].transpose(0, 2, 1)
            table["next"] = matrices[:, 1].transpose(0, 2, 1)
        storage = wgpu.BufferUsage.STORAGE
        buffer = (
            self._written(table)
            if self.in_place and camera is not None
            else gpu.constant(self._device, "reprojections", table, storage)
        )
        return data, buffer, gpu.constant(self._device, "indices", indices, storage)

    def _written(self, table: np.ndarray) -> wgpu.GPUBuffer:
        """The buffer that is written anew for every frame."""
        if self._table is None or self._table.size != table.nbytes:
            usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_DST
            self._table = self._device.create_buffer(
                label="reprojections", size=table.nbytes, usage=usage
            )
        self._device.queue.write_buffer(self._table, 0, table)
        return self._table


def viewport_of(camera: Reprojections, size: tuple[int, int]) -> np.ndarray:
    """The Viewport of wgsl/common/camera.wgsl for an image of `size`; it cannot be written."""
    if camera.depth_kind == "clip":
        return _viewport(camera.window or (0, 0, *size), np.inf, "CLIP")
    kind = "ORTHOGRAPHIC" if camera.here.orthographic else "PLANAR"
    return _viewport(camera.window or (0, 0, *size), camera.far, kind)


@lru_cache(maxsize=16)
def _viewport(window: Window, far: float, kind: str) -> np.ndarray:
    source = wgsl.load("common/camera.wgsl")
    viewport = np.zeros((), source.dtype("Viewport"))
    x, y, width, height = window
    viewport["display"], viewport["origin"] = (width, height), (x, y)
    viewport["far"], viewport["depth_kind"] = far, source.constant(kind)
    viewport.flags.writeable = False
    return viewport
