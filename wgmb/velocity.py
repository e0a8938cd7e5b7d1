"""Motion of every pixel as one texture, from vectors, from depth and matrices, or both."""

from __future__ import annotations

import numpy as np
import wgpu

from . import gpu
from .camera import Reprojections
from .frame_views import FrameViews, View
from .gpu import wgsl

FILE = "velocity.wgsl"


class VelocityPass:
    """Records wgsl/velocity.wgsl; keeps nothing but the device and two empty textures."""

    def __init__(self, device: wgpu.GPUDevice, none: View, no_object: View):
        self._device, self._none, self._no_object = device, none, no_object

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
        uniform, table, indices = self._matrices(bindings.size, frame.camera)
        kernel.run(
            encoder,
            "main",
            bindings,
            velocity=uniform,
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
            data["viewport"] = viewport_of(camera, size)
            matrices, indices = camera.matrices(), camera.indices
            table = np.zeros(len(matrices), source.dtype("Reprojection"))
            data["bodies"] = len(matrices)
            # Row i of a matrix in numpy is column i in WGSL.
            table["prev"] = matrices[:, 0].transpose(0, 2, 1)
            table["next"] = matrices[:, 1].transpose(0, 2, 1)
        storage = wgpu.BufferUsage.STORAGE
        return (
            gpu.constant(self._device, "velocity", data),
            gpu.constant(self._device, "reprojections", table, storage),
            gpu.constant(self._device, "indices", indices, storage),
        )


def viewport_of(camera: Reprojections, size: tuple[int, int]) -> np.ndarray:
    """The Viewport of wgsl/common/camera.wgsl for an image of `size`."""
    source = wgsl.load("common/camera.wgsl")
    viewport = np.zeros((), source.dtype("Viewport"))
    x, y, width, height = camera.window or (0, 0, *size)
    viewport["display"], viewport["origin"] = (width, height), (x, y)
    viewport["far"] = camera.far if camera.depth_kind == "planar" else np.inf
    kind = "ORTHOGRAPHIC" if camera.here.orthographic else "PLANAR"
    viewport["depth_kind"] = source.constant("CLIP" if camera.depth_kind == "clip" else kind)
    return viewport
