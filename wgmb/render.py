"""Rendering of scenes with motion blur, for `wgmb render` and the viewer."""

from __future__ import annotations

import math
import threading
import time as clock
from collections.abc import Callable
from contextlib import contextmanager
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from . import gpu
from .errors import InputError
from .frame import Frame
from .gpu.textures import TexturePool
from .gpu.timing import Clock
from .gpu_frame.views import FrameViews
from .methods.contract import reach_of
from .pipeline.blur import Blur
from .scene.gbuffer import MOST_LOOPS, MOST_RAYS, SceneOnGpu
from .scene.scene import Scene

_BUSY = 0.1  # seconds of GPU work handed over at once, so that Ctrl-C is heard
Progress = Callable[[int, int], None]
"""Called with the samples done and their total."""


class Render:
    """Renders a scene with motion blur; keeps its GPU resources between images.

    `size` (width, height) [px]; `fps`: frames per second, over 0 to 100000, which define the frame
    interval; `antialias`: antialiasing of the sharp images for image methods, in rays per pixel
    side, 1 to 8. Several threads may call one Render: they take turns.
    """

    def __init__(
        self,
        scene: Scene,
        blur: Blur,
        *,
        size: tuple[int, int] = (640, 360),
        fps: float = 24.0,
        antialias: int = 3,
    ):
        gpu.check_size(blur.device, *size)
        if not 0 < fps <= 100_000:
            raise InputError(f"`fps` must be over 0 and at most 100000, got {fps}")
        if not 1 <= antialias <= MOST_RAYS:
            raise InputError(f"`antialias` must be 1 to {MOST_RAYS}, got {antialias}")
        self.scene, self.blur, self.size, self.fps, self.antialias = (
            scene,
            blur,
            size,
            fps,
            antialias,
        )
        self._lock = threading.RLock()
        self._images = TexturePool(blur.device)
        self._token = blur.device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)
        self._moment: tuple[Any, ...] = ()
        self._spans: dict[tuple[float, float], SceneOnGpu] = {}
        self._pictures: dict[int, dict[str, Any]] = {}
        self._lights: dict[int, dict[str, wgpu.GPUTexture]] = {}

    def __call__(
        self, time: float, number: int = 0, progress: Progress | None = None
    ) -> NDArray[np.float32]:
        """The blurred frame whose instant is `time` [s]: (height, width, 4) float32, linear."""
        with self._working():
            output = self._images.texture("output", self.size, self.blur.output)
            self.draw(output.create_view(), time, number, progress=progress)
            return self._images.download(self.blur.device.create_command_encoder(), output)

    @contextmanager
    def _working(self):
        """One thread at a time; wgpu's errors become ours."""
        with self._lock, gpu.reported(self.size):
            yield

    def with_confidence(
        self, time: float, number: int = 0
    ) -> tuple[NDArray[np.float32], dict[str, NDArray[np.float32]]]:
        """Return the blurred frame at `time` [s] and its confidence; see Blur.with_confidence."""
        names = self.blur.confidence
        with self._working():
            textures = [
                self._images.texture(name, self.size, self.blur.output)
                for name in ("output", "confidence")
            ]
            output, sure = (t.create_view() for t in textures)
            self.draw(output, time, number, confidence=sure)
            create = self.blur.device.create_command_encoder
            picture, told = (self._images.download(create(), t) for t in textures)
        return picture, dict(zip(names, np.moveaxis(told, 2, 0), strict=True))

    def draw(
        self,
        output: wgpu.GPUTextureView,
        time: float,
        number: int = 0,
        *,
        blur: Blur | None = None,
        confidence: wgpu.GPUTextureView | None = None,
        progress: Progress | None = None,
        timing: Clock | None = None,
    ) -> None:
        """Draw the blurred frame into your texture of `size` and the blur's `output` format.

        `blur`: used instead of the Render's own, on the same device. Blurs of the same time share
        the sharp images. `confidence`: a texture like the output, for image methods with
        confidence. `timing`: clock for the passes.
        """
        blur = blur or self.blur
        if "progress" in blur.method.uses:
            self.refine(output, time, number, blur=blur, progress=progress, timing=timing)
            return
        if "scene" in blur.method.needs:
            encoder = blur.device.create_command_encoder(label="scene")
            blur.encode_scene(
                encoder, self.on_gpu(time, blur), output, number=number, timing=timing
            )
            gpu.submit(blur.device, encoder)
            return
        seen = {k: self._see(time, number, k, blur, timing) for k in _offsets(blur)}
        encoder = blur.device.create_command_encoder(label="blur")
        blur.encode(
            encoder,
            seen[0],
            output,
            prev=seen.get(-1),
            next=seen.get(1),
            prev_prev=seen.get(-2),
            next_next=seen.get(2),
            number=number,
            confidence=confidence,
            timing=timing,
        )
        gpu.submit(blur.device, encoder)

    def refine(
        self,
        output: wgpu.GPUTextureView,
        time: float,
        number: int = 0,
        *,
        done: int = 0,
        seconds: float = math.inf,
        blur: Blur | None = None,
        progress: Progress | None = None,
        timing: Clock | None = None,
    ) -> int:
        """Add samples to the `done` so far, for about `seconds`; returns the new total.

        For methods that need a scene. `output` holds the mean of all samples so far.
        """
        blur = blur or self.blur
        on_gpu, count = self.on_gpu(time, blur), 1
        most = max(1, MOST_LOOPS // on_gpu.loops)
        end = clock.perf_counter() + seconds
        while done < blur.samples:
            count = min(count, most, blur.samples - done)
            started = clock.perf_counter()
            encoder = blur.device.create_command_encoder(label=f"samples {done}")
            blur.encode_scene(
                encoder, on_gpu, output, progress=(done, count), number=number, timing=timing
            )
            gpu.submit(blur.device, encoder)
            blur.device.queue.read_buffer(self._token)  # waits
            now = clock.perf_counter()
            done += count
            if progress:
                progress(done, blur.samples)
            if now >= end:
                break
            share = min(_BUSY, end - now) / max(now - started, 1e-4)
            count = max(1, min(2 * count, int(count * share)))
        return done

    def passes(
        self, time: float, number: int = 0, timing: Clock | None = None
    ) -> dict[str, wgpu.GPUTexture]:
        """Return the sharp image, depth and motion at `time` [s]; valid until the next time.

        "color", "depth" [scene units], "normal", "object" (0: none), and "motion": to_prev,
        to_next [px].
        """
        here = self._see(time, number, 0, self.blur, timing)
        textures = self._pictures[0]
        if "motion" not in textures:
            motion = self._images.texture("motion", self.size, "rgba32float")
            encoder = self.blur.device.create_command_encoder(label="motion")
            self.blur.encode_motion(encoder, here, motion.create_view(), number)
            gpu.submit(self.blur.device, encoder)
            textures["motion"] = motion
        return {name: textures[name] for name in ("color", "depth", "normal", "object", "motion")}

    def frame(self, time: float, number: int = 0, *, light: bool = False) -> Frame:
        """The sharp picture at `time` [s] with its depth, normals, object indices and motion.

        `light`: with passes of light too, which scenes with a backdrop have not.
        """
        arrays: dict[str, np.ndarray] = {}
        passes: dict[str, Any] = {}
        with self._working():
            camera = self._see(time, number, 0, self.blur).camera
            for name in ("color", "depth", "normal", "object"):
                encoder = self.blur.device.create_command_encoder(label="download")
                arrays[name] = self._images.download(encoder, self._pictures[0][name])
            if light:
                for name, texture in self._light(time, number, 0, self.blur).items():
                    encoder = self.blur.device.create_command_encoder(label="download")
                    passes[name] = self._images.download(encoder, texture)[..., :3].copy()
        return Frame(
            arrays["color"],
            depth=arrays["depth"][..., 0],
            normal=np.ascontiguousarray(arrays["normal"][..., :3]),
            object_id=arrays["object"][..., 0],
            camera=camera,
            number=number,
            **passes,
        )

    def sharp(self, time: float) -> NDArray[np.float32]:
        """The sharp picture at `time` [s]: (height, width, 4) float32, linear."""
        if not self.scene.has_volumes:
            return self.frame(time).color
        still = Blur("volume", shutter=0, device=self.blur.device)
        return Render(self.scene, still, size=self.size, fps=self.fps)(time)

    def _see(
        self, time: float, number: int, offset: int, blur: Blur, timing: Clock | None = None
    ) -> FrameViews:
        """The picture `offset` frames from the moment."""
        on_gpu = self.on_gpu(time, blur)
        if offset not in self._pictures:
            encoder = blur.device.create_command_encoder(label="render")
            bindings, name = blur.frame_bindings(self.size, number), f"frame {offset}"
            watched = timing.watch(encoder) if timing else encoder
            drawn = on_gpu.encode(watched, bindings, self._images, name, float(offset))
            gpu.submit(blur.device, encoder)
            self._pictures[offset] = {**drawn, "camera": on_gpu.reprojections(offset)}
        seen = self._pictures[offset]
        lit = {}
        if abs(offset) <= 1 and "diffuse_light" in blur.method.uses:
            lit = self._light(time, number, offset, blur, timing)
        view = self._images.view_of
        return FrameViews(
            color=view(seen["color"]),
            depth=view(seen["depth"]),
            normal=view(seen["normal"]),
            object_id=view(seen["object"]),
            camera=seen["camera"],
            diffuse_light=view(lit["diffuse_light"]) if lit else None,
            diffuse_color=view(lit["diffuse_color"]) if lit else None,
        )

    def _light(
        self, time: float, number: int, offset: int, blur: Blur, timing: Clock | None = None
    ) -> dict[str, wgpu.GPUTexture]:
        """The passes of light `offset` frames from the moment, by their names in Frame."""
        on_gpu = self.on_gpu(time, blur)
        if offset not in self._lights:
            encoder = blur.device.create_command_encoder(label="light")
            bindings, name = blur.frame_bindings(self.size, number), f"frame {offset}"
            watched = timing.watch(encoder) if timing else encoder
            self._lights[offset] = on_gpu.encode_light(
                watched, bindings, self._images, name, float(offset)
            )
            gpu.submit(blur.device, encoder)
        return self._lights[offset]

    def on_gpu(self, time: float, blur: Blur | None = None) -> SceneOnGpu:
        """Return the scene on the GPU for the time span that the blur reads around `time` [s]."""
        blur = blur or self.blur
        if not np.isfinite(time):
            raise InputError(f"`time` must be finite, got {time}")
        moment = (time, id(self.scene), self.size, self.fps, self.antialias)
        if moment != self._moment:
            self._moment, self._spans, self._pictures, self._lights = moment, {}, {}, {}
        opens, closes = blur.shutter.span
        delay = max(map(abs, blur.shutter.delay)) / 2
        most = max(_offsets(blur))
        span = min(opens, -most) - delay, max(closes, most) + delay
        if span not in self._spans:
            self._spans[span] = SceneOnGpu(
                blur.device,
                self.scene,
                size=self.size,
                time=time,
                fps=self.fps,
                span=span,
                antialias=self.antialias,
            )
        return self._spans[span]


def _offsets(blur: Blur) -> tuple[int, ...]:
    """The frames that the method is given [frame intervals]."""
    reach = reach_of(blur.method)
    return tuple(sorted(range(-reach, reach + 1), key=abs))
