"""Motion of every pixel as one texture, from vectors, from depth and matrices, or both."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..camera import Reprojections, Window
from ..gpu import wgsl
from .views import FrameViews, View

FILE = "gpu_frame/velocity.wgsl"
_BAND = 1 << 20  # pixels of a dispatch: a tenth of a second on two cores without a GPU


class VelocityPass:
    """Records gpu_frame/velocity.wgsl; keeps a buffer if `in_place`.

    `in_place`: matrices are written into one buffer, so that its bind groups stay. Only for callers
    that submit each recording before they make the next one.
    """

    def __init__(self, device: wgpu.GPUDevice):
        self._device = device
        self.in_place = False
        self._table: wgpu.GPUBuffer | None = None

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        frame: FrameViews,
        limited: bool,
        output: View,
    ) -> None:
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
        uniform, table, indices = self._matrices(bindings.size, frame.camera)
        for top, band in kernel.bands(bindings.size, _BAND):
            kernel.run(
                encoder,
                "main",
                bindings,
                band,
                velocity=uniform | {"top": top},
                to_prev=to_prev,
                to_next=frame.to_next,
                depth=frame.depth,
                object=frame.object_id,
                scale=frame.scale,
                reprojections=table,
                indices=indices,
                motion=output,
            )

    def _matrices(
        self, size: tuple[int, int], camera: Reprojections | None
    ) -> tuple[dict[str, Any], np.ndarray | wgpu.GPUBuffer, np.ndarray]:
        """Fields of the uniform, the matrices of all bodies, and the body of each object index."""
        dtype = wgsl.load(FILE).dtype("Reprojection")
        if camera is None:
            return {}, np.zeros(1, dtype), np.zeros(1, np.uint32)
        matrices = camera.matrices()
        table = np.zeros(len(matrices), dtype)
        # Row i of a matrix in numpy is column i in WGSL.
        table["prev"] = matrices[:, 0].transpose(0, 2, 1)
        table["next"] = matrices[:, 1].transpose(0, 2, 1)
        uniform = {"viewport": viewport_of(camera, size), "bodies": len(matrices)}
        return uniform, self._written(table) if self.in_place else table, camera.indices

    def _written(self, table: np.ndarray) -> wgpu.GPUBuffer:
        """The buffer that is written anew for every frame."""
        if self._table is None or self._table.size != table.nbytes:
            usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_DST
            self._table = self._device.create_buffer(
                label="reprojections", size=table.nbytes, usage=usage
            )
        gpu.before_writing(self._device)
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
