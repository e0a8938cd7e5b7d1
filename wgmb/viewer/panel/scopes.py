"""Scopes of a picture: how bright its pixels are, all of them and column by column."""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu
from imgui_bundle import ImVec2, imgui

from ...color.primaries import REC709, luminance
from ...gpu import wgsl
from ...gpu.textures import TexturePool

_COMPOSE = wgsl.load("viewer/draw/compose.wgsl")
STOPS = _COMPOSE.integer("LOWEST"), _COMPOSE.integer("HIGHEST")
"""Range of the scopes and of false colours [stops from 1.0]."""
_BINS, _COLUMNS = 64, 240
_MOST = 480  # pixels a side that are looked at, evenly spaced: the window waits for it
_GRAPH = 240.0, 48.0, 64.0  # width of both; height of the histogram and of the waveform [px]


def histogram(light: np.ndarray) -> np.ndarray:
    """Share of the pixels (64,) by their luminance, over STOPS; darker and brighter ones at ends.

    `light`: (height, width, 3 or more), taken as Rec. 709.
    """
    bins = _bins(light)
    return (np.bincount(bins.ravel(), minlength=_BINS) / max(bins.size, 1)).astype(np.float32)


def waveform(light: np.ndarray) -> np.ndarray:
    """The same for 240 columns of the picture from left to right: (64, 240), bright ones first."""
    bins = _bins(light)
    width = bins.shape[1]
    columns = np.arange(width) * _COLUMNS // width
    if width < _COLUMNS:  # each of the 240 shows the pixel that it lies in
        columns = np.arange(_COLUMNS)
        bins = bins[:, columns * width // _COLUMNS]
    counts = np.bincount((bins * _COLUMNS + columns).ravel(), minlength=_BINS * _COLUMNS)
    table = counts.reshape(_BINS, _COLUMNS)[::-1]
    return (table / np.maximum(table.sum(axis=0), 1)).astype(np.float32)


def _bins(light: np.ndarray) -> np.ndarray:
    """The bin of each pixel that is looked at, (height, width)."""
    light = light[tuple(slice(None, None, -(-n // _MOST)) for n in light.shape[:2])]
    colors = light[..., :3] if light.shape[2] >= 3 else light[..., :1].repeat(3, axis=2)
    bright = np.nan_to_num(
        colors @ np.asarray(luminance(REC709), np.float32), posinf=2.0 ** STOPS[1]
    )
    stops = np.clip(np.log2(np.maximum(bright, 2.0 ** (STOPS[0] - 1))), *STOPS)
    share = (stops - STOPS[0]) / (STOPS[1] - STOPS[0])
    return np.minimum((share * _BINS).astype(int), _BINS - 1)


class Scopes:
    """The scopes of the picture that was looked at last; `backend`: ImGui's, with the device's."""

    def __init__(self, device: wgpu.GPUDevice, backend: Any):
        self._images, self._backend = TexturePool(device), backend
        self._light: np.ndarray | None = None
        self._shares: np.ndarray | None = None
        self._waveform: Any = None

    def look_at(self, light: np.ndarray | None) -> bool:
        """Take a picture, (height, width, 3 or more), None for none; True if it is another one."""
        if light is self._light:
            return False
        self._light, self._shares = light, None if light is None else histogram(light)
        if light is None:
            return True
        table = waveform(light)
        rgba = np.full((*table.shape, 4), 255, np.uint8)
        rgba[..., :3] = (255 * np.sqrt(np.minimum(4 * table, 1.0)))[..., None]
        view = self._images.upload("waveform", rgba, "rgba8unorm")
        if self._waveform is None:
            self._waveform = self._backend.register_texture(view)
        return True

    def show(self) -> None:
        """Draw them in the current window of ImGui."""
        if self._shares is None:
            return
        heights, (wide, high, tall) = np.sqrt(self._shares), _GRAPH
        imgui.plot_histogram(
            "##histogram", heights, scale_min=0.0, scale_max=float(heights.max()),
            graph_size=ImVec2(wide, high),
        )  # fmt: skip
        imgui.image(self._waveform, ImVec2(wide, tall))
        low, top = STOPS
        imgui.text_disabled(f"{low} to +{top} stops; below, from left to right")
