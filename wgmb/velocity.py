"""Motion of every pixel: vectors, or depth and matrices, or both -> one texture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import wgpu

from . import gpu, shader
from .cameras import Reprojections

FILE = "velocity.wgsl"
View = wgpu.GPUTextureView


@dataclass(frozen=True)
class Moving:
    """What is known of the motion: textures, and the matrices around the frame."""

    to_prev: View | None = None  # displacement [px] in x, y
    to_next: View | None = None
    motion: View | None = None  # both in one texture, instead of the two
    camera: Reprojections | None = None
    depth: View | None = None  # needed with camera
    object_id: View | None = None  # r32uint: rows of the camera's bodies
    scale: View | None = None  # multiplies the result
    object_motion: bool = False  # vectors leave the camera's motion out

    @property
    def has_vectors(self) -> bool:
        """Whether there are vectors, with a camera or without."""
        return any(v is not None for v in (self.to_prev, self.to_next, self.motion))

    @property
    def known(self) -> bool:
        """Whether anything says what moves."""
        return self.has_vectors or self.camera is not None

    @property
    def ready(self) -> bool:
        """Whether `motion` is already all there is to know."""
        return self.motion is not None and self.camera is None and self.scale is None


class VelocityPass:
    """Records wgsl/velocity.wgsl; keeps nothing but the device and two empty textures."""

    def __init__(self, device: wgpu.GPUDevice, none: View, no_object: View):
        self._device, self._none, self._no_object = device, none, no_object

    def encode(self, encoder, given: gpu.Given, moving: Moving, limited: bool, output: View):
        """Record `output` = to_prev, to_next [px] of every pixel."""
        paired = moving.motion is not None
        to_prev = moving.motion if paired else moving.to_prev
        with_camera = moving.camera is not None
        kernel = gpu.kernel(
            self._device,
            FILE,
            PREV=to_prev is not None,
            NEXT=moving.to_next is not None or paired,
            PAIRED=paired,
            CAMERA=with_camera,
            OBJECTS=with_camera and moving.object_id is not None,
            SCALED=moving.scale is not None,
            LIMITED=limited,
            ADDED=moving.object_motion,
        )
        uniform, table = self._matrices(given.size, moving.camera)
        kernel.run(
            encoder,
            "main",
            given,
            velocity=uniform,
            to_prev=to_prev or self._none,
            to_next=moving.to_next or self._none,
            depth=moving.depth or self._none,
            object=moving.object_id or self._no_object,
            scale=moving.scale or self._none,
            reprojections=table,
            motion=output,
        )

    def _matrices(self, size: tuple[int, int], camera: Reprojections | None):
        source = shader.load(FILE)
        data = np.zeros((), source.dtype("Velocity"))
        table = np.zeros(1, source.dtype("Reprojection"))
        if camera is not None:
            data["viewport"] = viewport_of(camera, size)
            matrices = camera.matrices()
            table = np.zeros(len(matrices), source.dtype("Reprojection"))
            data["bodies"] = len(matrices)
            # Row i of a matrix in numpy is column i in WGSL.
            table["prev"] = matrices[:, 0].transpose(0, 2, 1)
            table["next"] = matrices[:, 1].transpose(0, 2, 1)
        create = self._device.create_buffer_with_data
        return (
            create(label="velocity", data=data, usage=wgpu.BufferUsage.UNIFORM),
            create(label="reprojections", data=table, usage=wgpu.BufferUsage.STORAGE),
        )


def viewport_of(camera: Reprojections, size: tuple[int, int]) -> np.ndarray:
    """The Viewport of wgsl/common/camera.wgsl for an image of `size`."""
    source = shader.load("common/camera.wgsl")
    viewport = np.zeros((), source.dtype("Viewport"))
    x, y, width, height = camera.window or (0, 0, *size)
    viewport["display"], viewport["origin"] = (width, height), (x, y)
    viewport["far"] = camera.far if camera.depth_kind == "planar" else np.inf
    kind = "ORTHOGRAPHIC" if camera.here.orthographic else "PLANAR"
    viewport["depth_kind"] = source.constant("CLIP" if camera.depth_kind == "clip" else kind)
    return viewport
