"""The picture on the canvas of the window."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...gpu.textures import TexturePool, write
from ...threads import begin
from .composer import BLIT, Composer, View, clear, draw, pipeline, visible
from .place import overlap

_YIELDS = 5  # by how much the priority of composing is lower than the window's; drawing's by 10


class Screen:
    """Composes views, and paints the last one on a canvas."""

    def __init__(self, device: wgpu.GPUDevice, format: str):
        self._painter, self._composer = _Painter(device, format), Composer(device, "rgba16float")
        self._composed: View | None = None
        self.painted: View | None = None  # the view on the canvas

    def show(self, view: View) -> None:
        """Compose a view, if it is not the one that was composed last."""
        self._composer.compose(view)
        self._composed = view

    def paint(self, target: wgpu.GPUTexture) -> None:
        """Put the composed picture on the canvas's texture."""
        self._painter.paint(self._composer.texture, target)
        self.painted = self._composed

    @property
    def seconds(self) -> float:
        """Time that the last composing took."""
        return self._composer.seconds

    def picture(self) -> np.ndarray:
        """(height, width, 3) display values 0..1 of the view, the panel not in it."""
        return self._composer.picture()

    def values(self, x: float, y: float) -> np.ndarray | None:
        """(3,) display values 0..1 on the canvas at a place [px]; None outside the picture."""
        return self._composer.values(x, y)

    def close(self) -> None:
        """Nothing goes on beside the window."""


class ScreenThread:
    """A Screen whose views are composed in a thread with a device of its own.

    `paint` puts the last one that is ready on the canvas, whose textures need the usage COPY_DST;
    `news` is called in the thread when there is another one. Without a GPU, composing and compiling
    take longer than the panel can wait, and to draw a texel takes six times as long as to copy it.
    """

    def __init__(self, device: wgpu.GPUDevice, format: str, news: Callable[[], None]):
        self._device, self._format = device, format
        self._news, self._changed = news, threading.Condition()
        self._wanted: View | None = None
        self._ready: tuple[View, np.ndarray] | None = None
        self._images = TexturePool(device)
        self._picture: wgpu.GPUTexture
        self._written: np.ndarray | None = None  # what is in that texture
        self._failed: Exception | None = None
        self.painted: View | None = None  # the view on the canvas
        self._ended, self.seconds = False, 0.0
        beside = gpu.second_device(device)
        self._thread = begin(lambda: self._work(beside), "composing")

    def show(self, view: View) -> None:
        """Have a view composed next."""
        with self._changed:
            if self._failed is not None:
                raise self._failed
            self._wanted = view
            if self._ready is not None and self._ready[0].stamp == view.stamp:
                self._ready = view, self._ready[1]
            self._changed.notify_all()

    def paint(self, target: wgpu.GPUTexture) -> None:
        """Put the last view that is ready on the canvas's texture."""
        with self._changed:
            ready, wanted = self._ready, self._wanted
        if ready is None or wanted is None or ready[0].size != wanted.size:
            clear(self._device, target)
        if ready is not None:
            self.painted = ready[0]
            self._put(ready[1], target)

    def _put(self, texels: np.ndarray, target: wgpu.GPUTexture) -> None:
        """Copy the canvas's picture, from a texture that is written only when it changes.

        Most frames of the window are for its panel, and to write takes six times as long.
        """
        if texels is not self._written:
            height, width = texels.shape[:2]
            picture = self._images.texture("picture", (width, height), self._format)
            write(self._device, picture, texels)
            self._picture, self._written = picture, texels
        wide, high = (
            min(a, b) for a, b in zip(target.size[:2], self._picture.size[:2], strict=True)
        )
        encoder = self._device.create_command_encoder(label="picture")
        from_, to = {"texture": self._picture}, {"texture": target}
        encoder.copy_texture_to_texture(from_, to, (wide, high, 1))
        gpu.submit(self._device, encoder)

    def picture(self) -> np.ndarray:
        """(height, width, 3) display values 0..1 of the view shown last, the panel not in it."""
        with self._changed:
            self._changed.wait_for(self._is_current)
            if self._failed is not None:
                raise self._failed
            assert self._ready is not None
            view, texels = self._ready
        return visible(texels, overlap(view.place, view.area), self._format)

    def values(self, x: float, y: float) -> np.ndarray | None:
        """(3,) display values 0..1 on the canvas at a place [px]; None outside the picture."""
        texels = self._ready[1] if self._ready else np.zeros((0, 0, 4), np.uint8)
        if not (0 <= x < texels.shape[1] and 0 <= y < texels.shape[0]):
            return None
        return visible(texels, (int(x), int(y), 1, 1), self._format)[0, 0]

    def close(self) -> None:
        """Let the thread end."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        self._thread.join()

    def _is_current(self) -> bool:
        ready, wanted = self._ready, self._wanted
        at_end = self._ended or self._failed is not None
        return at_end or (ready is not None and wanted is not None and ready[0] is wanted)

    def _work(self, device: wgpu.GPUDevice) -> None:
        gpu.lower_priority(_YIELDS)
        try:
            composer = Composer(device, self._format, in_bands=True)
            while (view := self._next()) is not None:
                composer.compose(view)
                texels = composer.download()
                with self._changed:
                    if self._wanted is not None and self._wanted.stamp == view.stamp:
                        view = self._wanted  # which says more of the same picture
                    self._ready, self.seconds = (view, texels), composer.seconds
                    self._changed.notify_all()
                self._news()
        except Exception as error:  # which the window raises
            with self._changed:
                self._failed = error
                self._changed.notify_all()
            self._news()

    def _next(self) -> View | None:
        """The view that is wanted and not ready; None: no more."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._ended or (self._wanted is not None and not self._is_current())
            )
            return None if self._ended else self._wanted


class _Painter:
    """Copies a picture to a canvas, texel by texel."""

    def __init__(self, device: wgpu.GPUDevice, format: str):
        self._device = device
        self._pipeline: Any = pipeline(device, BLIT, format, "auto", {})

    def paint(self, picture: wgpu.GPUTexture, target: wgpu.GPUTexture) -> None:
        whole = 0, 0, target.size[0], target.size[1]
        draw(self._device, self._pipeline, 0, [picture.create_view()], target, whole)
