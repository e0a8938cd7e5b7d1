"""A frame with sliders: ipywidgets that draw the blurred frame whenever a value changes."""

from __future__ import annotations

import threading
import time
from typing import Any

import ipywidgets
import numpy as np
import wgpu

from ..errors import Error, InputError
from ..frame import Frame
from ..methods import METHODS, default_method
from ..pipeline.blur import Blur
from ..png import show
from ..threads import begin

MOST_DEGREES = 720
MOST_SAMPLES = 64


class Explorer(ipywidgets.VBox):
    """Widgets for method, shutter and samples over the blurred frame; see `explore`.

    A thread draws, one picture at a time and always of the latest values: a slider that is faster
    than the GPU leaves none waiting. `wait` returns when the picture shows them.
    """

    def __init__(
        self,
        frame: Frame,
        *,
        exposure: float = 0.0,
        device: wgpu.GPUDevice | str | None = None,
    ):
        able = [name for name, method in METHODS.items() if method.needs <= frame.has]
        if "motion" not in frame.has:
            raise InputError("no motion: pass to_next, to_prev, or depth and a camera")
        self._frame, self._exposure, self._device = frame.locked(), exposure, device
        self._blurs: dict[str, Blur] = {}
        self.method = ipywidgets.Dropdown(
            options=able, value=default_method(frame.has), description="method"
        )
        self.shutter = ipywidgets.FloatSlider(
            180, min=0, max=MOST_DEGREES, step=5, description="shutter", readout_format=".0f"
        )
        self.samples = ipywidgets.IntSlider(16, min=1, max=MOST_SAMPLES, description="samples")
        self.compare = ipywidgets.ToggleButton(False, description="as rendered")
        self.picture = ipywidgets.Image(format="png")
        self.status = ipywidgets.Label()
        rows = [self.method, self.shutter, self.samples, self.compare]
        super().__init__([ipywidgets.HBox(rows), self.picture, self.status])
        self._turn = threading.Condition()
        self._wanted = self._drawn = 0
        self._busy = False
        for widget in (self.method, self.shutter, self.samples, self.compare):
            widget.observe(self._ask, "value")
        self._ask()

    def wait(self, timeout: float = 60.0) -> None:
        """Return when the picture shows the values; TimeoutError after `timeout` seconds."""
        with self._turn:
            if not self._turn.wait_for(lambda: self._drawn == self._wanted, timeout):
                raise TimeoutError(f"no picture after {timeout:g} seconds")

    def _ask(self, _change: Any = None) -> None:
        with self._turn:
            self._wanted += 1
            if self._busy:
                return
            self._busy = True
        begin(self._draw, "wgmb.explore")

    def _draw(self) -> None:
        """Draw until the picture is that of the latest values."""
        while True:
            with self._turn:
                turn = self._wanted
                values = str(self.method.value), self.shutter.value, self.samples.value
                compare = self.compare.value
            try:
                began = time.perf_counter()
                image = self._frame.color if compare else self._blurred(*values)
                took = f"{1e3 * (time.perf_counter() - began):.0f} ms"
                self.picture.value = show(image, self._exposure).png
                self.status.value = "as rendered" if compare else took
            except Error as error:
                self.status.value = str(error)
            except BaseException:
                with self._turn:
                    self._busy, self._drawn = False, self._wanted
                    self._turn.notify_all()
                raise
            with self._turn:
                self._drawn = turn
                self._turn.notify_all()
                if turn == self._wanted:
                    self._busy = False
                    return

    def _blurred(self, method: str, degrees: float, samples: int) -> np.ndarray:
        key = f"{method} {samples}"
        if key not in self._blurs:
            for old in [k for k in self._blurs if k.split()[0] == method]:
                del self._blurs[old]
            self._blurs[key] = Blur(METHODS[method], samples=samples, device=self._device)
        blur = self._blurs[key]
        blur.shutter = degrees
        return blur(self._frame)
