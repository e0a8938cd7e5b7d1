"""Motion of every pixel: vectors, or depth and matrices, or both -> one texture."""

from __future__ import annotations

import numpy as np
import wgpu

from . import gpu, shader
from .cameras import Reprojections

FILE = "velocity.wgsl"


class VelocityPass:
    """Records wgsl/velocity.wgsl; keeps nothing but the device."""

    def __init__(self, device: wgpu.GPUDevice):
        self.device = device

    def encode(
        self, encoder, given: gpu.Given, *, empty, motion, camera, object_motion, limited, **views
    ):
        """Record motion (to_prev, to_next) from those of `views` that are not None.

        views: to_prev, to_next, depth, object, scale; `empty` stands in for the others.
        """
        there = {name for name, view in views.items() if view is not None}
        kernel = gpu.kernel(
            self.device,
            FILE,
            PREV="to_prev" in there,
            NEXT="to_next" in there,
            CAMERA=camera is not None,
            OBJECTS=camera is not None and "object" in there,
            SCALED="scale" in there,
            LIMITED=limited,
            ADDED=object_motion,
        )
        uniform, table = self._matrices(given.size, camera)
        bound = {
            name: view or empty["object" if name == "object" else "float"]
            for name, view in views.items()
        }
        kernel.run(
            encoder, "main", given, velocity=uniform, reprojections=table, motion=motion, **bound
        )

    def _matrices(self, size: tuple[int, int], camera: Reprojections | None):
        source = shader.load(FILE)
        data = np.zeros((), source.dtype("Velocity"))
        table = np.zeros(1, source.dtype("Reprojection"))
        if camera is not None:
            x, y, width, height = camera.window or (0, 0, *size)
            data["display"], data["origin"] = (width, height), (x, y)
            data["far"] = camera.far if camera.depth_kind == "planar" else np.inf
            data["depth_kind"] = source.constant(_kind(camera))
            matrices = camera.matrices()
            table = np.zeros(len(matrices), source.dtype("Reprojection"))
            data["bodies"] = len(matrices)
            # Row i of a matrix in numpy is column i in WGSL.
            table["prev"] = matrices[:, 0].transpose(0, 2, 1)
            table["next"] = matrices[:, 1].transpose(0, 2, 1)
        create = self.device.create_buffer_with_data
        return (
            create(label="velocity", data=data, usage=wgpu.BufferUsage.UNIFORM),
            create(label="reprojections", data=table, usage=wgpu.BufferUsage.STORAGE),
        )


def _kind(camera: Reprojections) -> str:
    if camera.depth_kind == "clip":
        return "CLIP"
    return "ORTHOGRAPHIC" if camera.here.orthographic else "PLANAR"
