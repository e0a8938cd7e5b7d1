"""Drawing beside the window, in a thread with a device of its own: the window never waits for it.

Without a GPU, passes of seconds run on the same processor as the panel. Here they run in the
driver's threads while the window goes on, each pass by itself, so that all is dropped at once when
something else is wanted. Images come as arrays of halves.

With a GPU, the window's own thread draws, by the same Renderer: there a pass takes milliseconds,
and images stay in the GPU's memory; this thread would bring each of them down and up again.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...gpu.textures import TexturePool
from ...threads import begin
from .composer import Image
from .frame_status import FrameStatus
from .portions import DroppedError, Portions
from .renderer import Renderer
from .request import Drawn, Request

_PLAYED = 1 / 24  # seconds that a frame may take while it plays
_POLL = 0.2  # seconds after which the thread looks whether it should end
_PAUSE = 0.03  # seconds between two looks at whether there is something to do
_HALF_MAX = 65504.0


@dataclass
class _Answer:
    """An answer of the thread to a request."""

    drawn: Drawn
    light: np.ndarray
    """The first image as it was drawn."""


class DrawThread:
    """Draws requests with a device of its own; `draw` returns the last answer at once.

    `news` is called in the thread when there is an answer.
    """

    def __init__(self, device: wgpu.GPUDevice, news: Callable[[], None] = lambda: None):
        self._news = news
        self._changed = threading.Condition()
        self._wanted: Request | None = None
        self._drawing: Request | None = None
        self._answer: _Answer | None = None
        self._failed: tuple[Request, Exception] | None = None
        self._taken: _Answer | None = None
        self._ended = False
        self._thread = begin(lambda: self._work(device), "drawing")

    # ---- of the window -------------------------------------------------------------------

    def draw(self, request: Request, now: float) -> Drawn | None:
        """The last answer, None before the first; `request` is worked on from now on.

        As long as there are no numbers for the inspector, they are the first image's light.
        The error of a request for the same picture is raised.
        """
        with self._changed:
            if request != self._wanted:
                self._wanted = request
                self._changed.notify()
            failed, answer = self._failed, self._answer
            self._failed = None
        if failed is not None and _alike(failed[0], request):
            raise failed[1]
        if answer is None:
            return None
        report = replace(answer.drawn.report, changed=answer is not self._taken)
        self._taken = answer
        return replace(
            answer.drawn, report=report, under=answer.drawn.under or {"light": answer.light}
        )

    @property
    def report(self) -> FrameStatus:
        """The last one."""
        return self._taken.drawn.report if self._taken else FrameStatus()

    @property
    def chromaticities(self) -> dict[str, Any]:
        """Of the picture shown, as an attribute of an EXR."""
        return self._taken.drawn.chromaticities if self._taken else {}

    def download(self) -> np.ndarray:
        """(height, width, channels) float32 of the first image."""
        return self._taken.light if self._taken else np.zeros((1, 1, 4), np.float32)

    def finished(self, seconds: float, antialias: int) -> None:
        """The window's frames say nothing about how long drawing takes."""

    def close(self) -> None:
        """Let the thread end after the pass that it is at."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    # ---- of the thread -------------------------------------------------------------------

    def _is_wanted(self) -> bool:
        """Return False once the window is closed, or wants another picture than a still one."""
        now, drawing = self._wanted, self._drawing
        if self._ended or now is None or drawing is None:
            return not self._ended
        return drawing.moving or drawing.full or now.picture == drawing.picture

    def _work(self, device: wgpu.GPUDevice) -> None:
        gpu.lower_priority()
        renderer = Renderer(device, Portions(device, self._is_wanted), _PLAYED)
        images = _Downloads(TexturePool(device))
        busy, last = False, ()
        while (request := self._next(busy)) is not None:
            started = time.perf_counter()
            try:
                drawn = renderer.draw(request, started)
                report, busy = drawn.report, drawn.report.busy
                reached = report.waiting, report.reference, report.measured, {*drawn.under}
                if not report.changed and (request, busy, *reached) == last:
                    time.sleep(_PAUSE)  # until the mouse is still, or motion is found
                    continue
                last = request, busy, *reached
                self._publish(images.answer(renderer, drawn))
                renderer.finished(time.perf_counter() - started, drawn.state.scene.antialias)
            except DroppedError:
                busy = True
            except Exception as error:  # which the window raises
                busy = False
                with self._changed:
                    self._failed = request, error
                self._news()
        renderer.choices.close()

    def _publish(self, answer: _Answer) -> None:
        with self._changed:
            self._answer = answer
        self._news()

    def _next(self, busy: bool) -> Request | None:
        """The request that is to be worked on; None: no more."""
        with self._changed:
            while not self._ended and (self._wanted is None or self._wanted == self._drawing):
                if busy:
                    break
                self._changed.wait(_POLL)
            self._drawing = self._wanted
            return None if self._ended else self._drawing


class _Downloads:
    """Images as arrays; one that has not changed is the same array."""

    def __init__(self, images: TexturePool):
        self._images = images
        self._kept: dict[str, tuple[tuple[Any, ...], np.ndarray]] = {}

    def answer(self, renderer: Renderer, drawn: Drawn) -> _Answer:
        """The drawing with its images as arrays."""
        first = renderer.first
        light = self._array("light", first)
        images = {}
        for slot, image in drawn.images.items():
            whole = light if image.stamp == first.stamp else self._array(slot, image)
            halves = self._halves(slot, image, whole)
            images[slot] = Image(None, image.kind, image.stamp, halves)
        return _Answer(replace(drawn, images=images), light)

    def _array(self, name: str, image: Image) -> np.ndarray:
        if name not in self._kept or self._kept[name][0] != image.stamp:
            assert image.texture is not None
            encoder = self._images.device.create_command_encoder(label="download")
            array = self._images.download(encoder, image.texture)
            self._kept[name] = image.stamp, array.astype(np.float32, copy=False)
        return self._kept[name][1]

    def _halves(self, slot: str, image: Image, array: np.ndarray) -> np.ndarray:
        """An image (height, width, 4) of half floats: shaders are compiled for one format."""
        name = f"{slot} as halves"
        if name not in self._kept or self._kept[name][0] != image.stamp:
            halves = np.zeros((*array.shape[:2], 4), np.float16)
            finite = np.where(np.isinf(array), array, np.clip(array, -_HALF_MAX, _HALF_MAX))
            halves[..., : array.shape[2]] = finite
            self._kept[name] = image.stamp, halves
        return self._kept[name][1]


def _alike(failed: Request, request: Request) -> bool:
    """Return True if the request that failed is still wanted, perhaps at another moment."""
    a, b = (replace(r.state, frame=0.0, playing=False) for r in (failed, request))
    return a == b
