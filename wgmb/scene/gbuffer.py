"""A scene on the GPU: its bodies, where they are over a span of time, and pictures of instants."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..camera import Camera, Reprojections
from ..errors import InputError
from ..gpu import wgsl
from ..gpu.textures import TexturePool
from .bodies import SHAPES
from .scene import Scene

ROWS = 257  # poses between which the GPU interpolates
MOST_RAYS = 8  # a side, for antialiasing
MOST = 1e15  # coordinates and zooms: the square of a number must fit into f32
MOST_LOOPS = 32_768  # turns of a shader's loops: lavapipe ends them all at twice that, silently
_BAND = 1 << 24  # turns of loops in a dispatch: a tenth of a second on two cores without a GPU


class SceneOnGpu:
    """A scene's buffers for one picture: group 1, bindings 0 to 2, of wgsl/scene/trace.wgsl."""

    def __init__(
        self,
        device: wgpu.GPUDevice,
        scene: Scene,
        *,
        size: tuple[int, int],
        time: float,
        fps: float,
        span: tuple[float, float],
        antialias: int,
    ):
        """`time` of the frame [s]; `span` of interest around it [frame intervals]."""
        self.device, self.size, self.time, self.fps = device, size, time, fps
        self.original = scene
        self.scene = scene = scene.solid(time)
        n = len(scene.bodies)
        source = wgsl.load("scene/trace.wgsl")
        # Of one ray and its shadow: both sift, then meet, all bodies.
        rings = sum(b.shape == "ring" for b in scene.bodies)
        self.loops = 4 * n + n // 16 + 4 + 2 * rings * source.integer("RING_STEPS")
        if n > (most := source.constant("MOST_BODIES")):
            raise InputError(f"a scene has at most {most} bodies, got {n}")
        self.antialias, self.span = antialias, span
        self._last: tuple[float, dict[str, Any]] | None = (
            None  # an instant, and what is bound for it
        )
        self.constants = {"RINGS": rings > 0, "BACKDROP": scene.backdrop is not None}

    @cached_property
    def resources(self) -> dict[str, wgpu.GPUBuffer | wgpu.GPUTextureView]:
        """Buffers and textures to bind for all of the span, created on first use."""
        first, step = self._rows
        return self._resources(first + step * np.arange(ROWS))

    @property
    def _rows(self) -> tuple[float, float]:
        """Time of the first row of poses, and from one to the next [frame intervals]."""
        first, last = self.span
        return first, max((last - first) / (ROWS - 1), 1e-6)

    def _instant(self, time: float) -> dict[str, wgpu.GPUBuffer | wgpu.GPUTextureView]:
        """The same for one instant [frame intervals]: its poses alone, as INSTANT has them."""
        if self._last is None or self._last[0] != time:
            first, step = self._rows
            x = np.clip((np.float32(time) - np.float32(first)) / np.float32(step), 0, ROWS - 1)
            row = min(int(x), ROWS - 2)
            rows = first + step * np.array([row, row + 1])
            self._last = time, self._resources(rows, np.float32(x - row))
        return self._last[1]

    def _resources(
        self, times: np.ndarray, after: np.float32 | None = None
    ) -> dict[str, wgpu.GPUBuffer | wgpu.GPUTextureView]:
        """For rows of poses at `times` [frame intervals]; `after`: the share of the second of two
        in the only row."""
        if self.scene.figure is not None:
            raise InputError(f"scene {self.scene.name!r} is flat: only method 'volume' draws it")
        scene, size, source = self.scene, self.size, wgsl.load("scene/trace.wgsl")
        first, step = self._rows
        moments = self.time + times / self.fps
        with np.errstate(all="ignore"):
            places = [body.world_from_body(moments) for body in scene.bodies]
            camera = _world_from_picture(scene, moments, size)
        _check_finite(camera, places)
        data = np.zeros((), source.dtype("Scene"))
        sun = np.array(scene.sun[:3]) / np.linalg.norm(scene.sun[:3])
        data["sun"], data["sky"] = (*sun, scene.sun[3]), scene.sky
        data["horizon"] = (*scene.horizon, 0)
        data["first"], data["step"], data["rows"] = first, step, ROWS
        data["bodies"] = len(scene.bodies)
        shapes = [b.shape for b in scene.bodies]
        data["spheres"], data["boxes"], data["cylinders"] = map(shapes.count, SHAPES[:3])
        if scene.backdrop is not None:
            scene.backdrop.fill(data["backdrop"])
        zoom = float(np.ravel(scene.camera.zoom(np.array([self.time])))[0])
        data["pixel"] = 2 / (zoom * size[1])
        data["rays"] = self.antialias
        for bounds, place in zip(data["bounds"], places, strict=False):
            bounds[:3] = _halves(*_bounds(place))
        poses = _poses(camera, places).astype(np.float32)
        if after is not None:
            poses = poses[:1] * (1 - after) + poses[1:] * after
        buffer = self.device.create_buffer_with_data
        return {
            "scene": buffer(label="scene", data=data, usage=wgpu.BufferUsage.UNIFORM),
            "bodies": gpu.constant(
                self.device, "bodies", _bodies(scene, source), wgpu.BufferUsage.STORAGE
            ),
            "poses": TexturePool(self.device).upload("poses", poses, "rgba32float"),
        }

    def encode(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        images: TexturePool,
        name: str,
        time: float,
    ) -> dict[str, wgpu.GPUTexture]:
        """Record the picture at `time` [frame intervals from this frame]; its textures."""
        antialias, bodies = self.antialias, len(self.scene.bodies)
        if self.loops * antialias * antialias > MOST_LOOPS:
            raise InputError(f"{bodies} bodies are too many for {antialias} x {antialias} rays")
        color = gpu.texel(self.device, 4)
        constants = self.constants | {"INSTANT": True, "CENTRED": antialias % 2 == 1}
        kernel = gpu.kernel(self.device, "scene/gbuffer.wgsl", {"Color": color}, **constants)
        formats = {
            "color": color,
            "depth": "r32float",
            "normal": "rgba32float",
            "object": "r32uint",
        }
        textures = {k: images.texture(f"{name} {k}", self.size, f) for k, f in formats.items()}
        views = {k: t.create_view() for k, t in textures.items()}
        self._run(encoder, kernel, bindings, time, views)
        return textures

    def encode_light(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: gpu.FrameBindings,
        images: TexturePool,
        name: str,
        time: float,
    ) -> dict[str, wgpu.GPUTexture]:
        """Record the passes of light at `time` [frame intervals from this frame].

        Returns their textures by their names in Frame.

        None of scenes with a backdrop, whose solids are shaded otherwise.
        """
        if self.scene.backdrop is not None:
            return {}
        kernel = gpu.kernel(self.device, "scene/light.wgsl", None, INSTANT=True, **self.constants)
        textures = {
            k: images.texture(f"{name} {k}", self.size, "rgba32float") for k in ("light", "albedo")
        }
        views = {k: t.create_view() for k, t in textures.items()}
        self._run(encoder, kernel, bindings, time, views)
        return {"diffuse_light": textures["light"], "diffuse_color": textures["albedo"]}

    def _run(
        self,
        encoder: wgpu.GPUCommandEncoder,
        kernel: gpu.Kernel,
        bindings: gpu.FrameBindings,
        time: float,
        views: dict[str, wgpu.GPUTextureView],
    ) -> None:
        """Record a kernel's dispatches, band by band."""
        resources, turns = self._instant(time), self.loops * self.antialias**2
        for top, band in kernel.bands(bindings.size, _BAND // turns):
            view = {"top": top}
            kernel.run(encoder, "main", bindings, band, view=view, **resources, **views)

    def reprojections(self, time: float = 0.0) -> Reprojections:
        """Camera and body motion around `time` [frame intervals from this frame]."""
        times = self.time + (time + np.array([-1.0, 0.0, 1.0])) / self.fps
        shot = self.scene.camera
        views = np.linalg.inv(shot.world_from_camera(times))
        clips = shot.clip_from_camera(times, self.size[0] / self.size[1])
        bodies = [body.world_from_body(times) for body in self.scene.bodies]
        prev, here, next_ = (
            Camera(clip @ view, view, {i + 1: places[k] for i, places in enumerate(bodies)})
            for k, (clip, view) in enumerate(zip(clips, views, strict=True))
        )
        return Reprojections(here, prev, next_)


def _bodies(scene: Scene, source: wgsl.WgslSource) -> np.ndarray:
    table = np.zeros(max(len(scene.bodies), 1), source.dtype("Body"))
    for i, body in enumerate(scene.bodies):
        row = table[i : i + 1]
        row["size"] = (*body.size, 0)
        row["color"], row["other"] = (
            (*body.color, body.emission),
            (*body.second_color, body.specular),
        )
        row["repeats"], row["object"] = body.repeats, i + 1
        row["pattern"] = source.constant(body.pattern)
    return table


def _bounds(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two corners of a box along the world's axes around a body at all its places (rows, 4, 4)."""
    middle, reach = place[:, :3, 3], np.abs(place[:, :3, :3]).sum(axis=-1)
    # Between two rows a body strays from both by less than they differ; the rest is rounding.
    margin = np.abs(np.diff(place, axis=0)).max() + 1e-4 + 1e-6 * np.abs(place).max()
    return (middle - reach).min(axis=0) - margin, (middle + reach).max(axis=0) + margin


def _halves(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(3,) uint32: both numbers as float16 in a word, the low one first, rounded outwards."""
    with np.errstate(over="ignore"):  # what is beyond a half's range is infinite
        halves = np.stack([low, high], axis=1).astype(np.float16)
    inward = np.stack([halves[:, 0] > low, halves[:, 1] < high], axis=1)
    outward = np.nextafter(halves, np.array([-np.inf, np.inf], np.float16))
    return np.where(inward, outward, halves).view(np.uint32)[:, 0]


def _world_from_picture(scene: Scene, times: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """(rows, 4, 4) from -1..1, y up, and 1: the ray's direction; from the origin: its start."""
    zoom = np.broadcast_to(scene.camera.zoom(times), times.shape)
    if not ((zoom > 1 / MOST) & (zoom < MOST)).all():
        raise InputError(f"the camera's zoom must be over 0, got {zoom.min():g} to {zoom.max():g}")
    lens = np.zeros((len(times), 4, 4))
    lens[:, 0, 0], lens[:, 1, 1] = size[0] / size[1] / zoom, 1 / zoom
    lens[:, 2, 2], lens[:, 3, 3] = -1, 1  # looking along -z
    return scene.camera.world_from_camera(times) @ lens


def _check_finite(camera: np.ndarray, places: list[np.ndarray]) -> None:
    for i, matrix in enumerate([camera, *places]):
        name = f"body {i}" if i else "the camera"
        if not np.abs(matrix).max() < MOST:  # NaN is not
            raise InputError(f"{name} must be finite and stay within {MOST:g} of the origin")


def _poses(camera: np.ndarray, places: list[np.ndarray]) -> np.ndarray:
    """(rows, 3 + 3 bodies, 4): rows of the picture into the world, of the world into bodies."""
    matrices = np.stack([camera, *map(np.linalg.inv, places)], axis=1)
    return matrices[:, :, :3].reshape(len(camera), -1, 4)
