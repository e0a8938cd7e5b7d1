"""A scene through a method: what `wgmb render` and the viewer call."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from pathlib import Path

import numpy as np
import wgpu

from . import exr, gpu
from .errors import InputError
from .frame import Frame
from .gbuffer import MOST_LOOPS, MOST_RAYS, SceneOnGpu
from .images import Images
from .output import Output
from .pipeline import Blur
from .scene import Scene
from .source import Source

_BUSY = 0.1  # seconds of GPU work handed over at once, so that Ctrl-C is heard
Progress = Callable[[int, int], None]
"""Called with the samples done and their total."""


class Render:
    """A scene and a Blur, kept for many pictures.

    `size` (width, height) [px]; `fps`: frames per second, what the shutter's times refer to;
    `rays`: antialiasing of the pictures that image methods start from, rays a pixel's side.
    """

    def __init__(
        self,
        scene: Scene,
        blur: Blur,
        *,
        size: tuple[int, int] = (640, 360),
        fps: float = 24.0,
        rays: int = 3,
    ):
        gpu.check_size(blur.device, *size)
        if not 0 < fps <= 100_000:
            raise InputError(f"fps must be over 0 and at most 100000, got {fps}")
        if not 1 <= rays <= MOST_RAYS:
            raise InputError(f"rays must be 1 to {MOST_RAYS}, got {rays}")
        self.scene, self.blur, self.size, self.fps, self.rays = scene, blur, size, fps, rays
        self._images = Images(blur.device)
        self._token = blur.device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)

    def __call__(
        self, time: float, number: int = 0, progress: Progress | None = None
    ) -> np.ndarray:
        """(height, width, 4) float32, linear: the frame whose instant is `time` [s]."""
        on_gpu, blur = self.on_gpu(time), self.blur
        output = self._images.texture("output", self.size, blur.output)
        if "progress" in blur.method.uses:
            self._in_steps(on_gpu, output.create_view(), number, progress)
            return self._images.download(blur.device.create_command_encoder(), output)
        encoder = blur.device.create_command_encoder(label="render")
        if "scene" in blur.method.needs:
            blur.encode(encoder, size=self.size, output=output.create_view(), scene=on_gpu,
                        number=number)  # fmt: skip
            return self._images.download(encoder, output)
        seen = {k: self._see(encoder, on_gpu, number, k) for k in self._offsets}
        gpu.submit(blur.device, encoder)
        encoder = blur.device.create_command_encoder(label="blur")
        here = seen.pop(0)
        blur.encode(
            encoder,
            size=self.size,
            output=output.create_view(),
            number=number,
            neighbours=seen,
            **here,
        )
        return self._images.download(encoder, output)

    @property
    def _offsets(self) -> tuple[int, ...]:
        """The frames that the method is given [frame intervals]."""
        return (0, -1, 1) if "neighbours" in self.blur.method.uses else (0,)

    def _see(self, encoder, on_gpu: SceneOnGpu, number: int, offset: int) -> dict:
        """Record one frame's picture; what Blur.encode takes of it."""
        given = self.blur.given(self.size, number)
        name = f"frame {offset}"
        seen = on_gpu.encode(encoder, given, self._images, name, float(offset))
        return {
            "color": seen["color"].create_view(),
            "depth": seen["depth"].create_view(),
            "normal": seen["normal"].create_view(),
            "object_id": seen["object"].create_view(),
            "camera": on_gpu.reprojections(offset),
        }

    def sharp(self, time: float) -> np.ndarray:
        """(height, width, 4) float32, linear: the picture at `time` [s] without any blur."""
        if not self.scene.has_volumes:
            return self.frame(time).color
        return Render(
            self.scene, Blur("volume", shutter=0, device=self.blur.device),
            size=self.size, fps=self.fps,
        )(time)  # fmt: skip

    def frame(self, time: float, number: int = 0) -> Frame:
        """The sharp picture at `time` [s] with its depth, normals, object indices and motion."""
        on_gpu, blur = self.on_gpu(time), self.blur
        encoder = blur.device.create_command_encoder(label="render")
        seen = on_gpu.encode(encoder, blur.given(self.size, number), self._images, "frame", 0.0)
        arrays = {}
        for name, texture in seen.items():
            arrays[name] = self._images.download(encoder, texture)
            encoder = blur.device.create_command_encoder(label="download")
        return Frame(
            arrays["color"],
            depth=arrays["depth"][..., 0],
            normal=np.ascontiguousarray(arrays["normal"][..., :3]),
            object_id=arrays["object"][..., 0],
            camera=on_gpu.reprojections(),
            number=number,
        )

    def on_gpu(self, time: float) -> SceneOnGpu:
        """The scene around `time` [s], as far as this Blur looks."""
        if not np.isfinite(time):
            raise InputError(f"time must be finite, got {time}")
        opens, closes = self.blur.shutter.span
        delay = max(map(abs, self.blur.shutter.delay)) / 2
        most = max(self._offsets)
        span = min(opens, -most) - delay, max(closes, most) + delay
        return SceneOnGpu(
            self.blur.device,
            self.scene,
            size=self.size,
            time=time,
            fps=self.fps,
            span=span,
            rays=self.rays,
        )

    def _in_steps(self, on_gpu: SceneOnGpu, output, number: int, progress: Progress | None):
        """Submit the samples bit by bit, each bit about _BUSY seconds of work."""
        blur, done, count = self.blur, 0, 1
        most = max(1, MOST_LOOPS // on_gpu.loops)
        while done < blur.samples:
            count = min(count, most, blur.samples - done)
            started = clock.perf_counter()
            encoder = blur.device.create_command_encoder(label=f"samples {done}")
            blur.encode(encoder, size=self.size, output=output, scene=on_gpu,
                        progress=(done, count), number=number)  # fmt: skip
            gpu.submit(blur.device, encoder)
            blur.device.queue.read_buffer(self._token)  # waits
            took = clock.perf_counter() - started
            done += count
            count = max(1, min(2 * count, int(count * _BUSY / max(took, 1e-4))))
            if progress:
                progress(done, blur.samples)


def render_frames(
    render: Render,
    moments: dict[int, float],
    output: Output,
    sharp: bool,
    passes: bool,
    resume: bool,
    progress: Callable[[int, str], None] | None,
) -> int:
    """Render every moment into `output`; returns how many were there already (`resume`).

    `sharp`: without blur. `passes`: EXR with all that `wgmb blur` can use.
    """
    tell, skipped = progress or (lambda number, what: None), 0
    for number, time in moments.items():
        if resume and output.done(number, []):
            skipped += 1
            tell(number, "skipped")
            continue
        seen = render.frame(time, number) if sharp or passes else None
        result = seen.color if sharp and seen else render(time, number)
        source = (
            _with_passes(render, seen, number)
            if passes and seen
            else Source(number, Path(), None, {}, {})
        )
        output.write(result, source)
        tell(number, "done")
    output.close()
    return skipped


def _with_passes(render: Render, frame: Frame, number: int) -> Source:
    """A frame's passes as layers that sequence.py finds by their names."""
    motion = render.blur.motion(frame)
    assert frame.depth is not None and frame.normal is not None and frame.object_id is not None
    channels = {name: frame.color[..., i] for i, name in enumerate("RGBA")}
    channels |= {"Z": frame.depth, "object_id.X": frame.object_id}
    channels |= {f"normal.{c}": frame.normal[..., i] for i, c in enumerate("XYZ")}
    names = ("to_prev.x", "to_prev.y", "to_next.x", "to_next.y")
    channels |= {name: motion[..., i] for i, name in enumerate(names)}
    width, height = frame.size
    window = (0, 0, width - 1, height - 1)
    part = exr.Part("", channels, {}, window, window)
    return Source(number, Path(), exr.Exr(Path(), [part]), channels, {}, part=part)
