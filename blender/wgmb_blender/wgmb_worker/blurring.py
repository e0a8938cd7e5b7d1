"""Sharp files to blurred ones, by wgmb.

A blurred file has the picture alone, or all that its sharp one has, with other pictures.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import wgmb
from wgmb.io import atomic, exr

from .problem import NoAdapterError, ProblemError, plain
from .recipe import COMPOSITE, MATTE, Exposure, Recipe, Setup, View


def shutter_of(exposure: Exposure) -> wgmb.Shutter:
    """The shutter of an exposure."""
    values = exposure.curve
    x = np.linspace(0, 1, len(values or ()))
    return wgmb.Shutter(
        exposure.degrees,
        phase=exposure.middle,
        curve="box" if values is None else lambda t: np.interp(t, x, values),
        rolling=exposure.rolling,
        rolling_duration=exposure.rolling_duration,
    )


def open_blur(setup: Setup) -> wgmb.Blur:
    """The blur; NoAdapterError where there is nothing to run it on."""
    options = {"shading": setup.shading} if setup.method == "gather" else {}
    try:
        return wgmb.Blur(
            setup.method,
            shutter=shutter_of(setup.exposure),
            samples=setup.samples,
            device=setup.device,
            **options,
        )
    except wgmb.DeviceError as error:
        raise NoAdapterError(
            "No Vulkan, Metal or DirectX 12 driver found; motion blur cannot run here "
            f"({plain(error)})"
        ) from None


class Blurring:
    """The frames of a recipe; each is read once, though it is a neighbour of two others."""

    def __init__(self, recipe: Recipe, blur: wgmb.Blur):
        self.recipe, self._blur = recipe, blur
        self._clips: dict[tuple[str, str], Any] = {}

    def one(self, number: int) -> dict[str, Any]:
        """Blur a frame: the file of each view, remarks, and whether anything moves in it."""
        recipe, notes, moves, files = self.recipe, [], False, []
        for view in recipe.views:
            results = {}
            for layer in recipe.layers:
                clip, source, frame = self._read(number, view, layer)
                moves |= bool(np.any(frame.motion))
                results[layer] = source, self._blur(frame)
                clip.forget(number - 1)
                if number in clip.cuts:
                    notes.append(f"Camera cut before frame {number}")
                notes += [f"Frame {n}: {text}" for text, on in clip.notes.items() for n in on]
            files.append(str(self._write(number, view, results)))
        return {"files": files, "notes": notes, "moves": moves}

    def preview(self, number: int, path: Path) -> None:
        """Blur the first picture of a frame into a numpy file: (height, width, 4) float32, linear
        light, the first row on top.
        """
        _, _, frame = self._read(number, self.recipe.views[0], self.recipe.layers[0])
        rgba = self._blur(frame)
        four = np.ones((*rgba.shape[:2], 4), np.float32)
        four[..., : rgba.shape[2]] = rgba
        np.save(path, self.recipe.picture.laid(four))

    def _read(self, number: int, view: View, layer: str) -> tuple[Any, Any, Any]:
        """The clip, the file and the frame of a picture."""
        path = self.recipe.sharp.path(number, view)
        if not path.is_file():
            raise ProblemError(f"Frame {number}: there is no {path}")
        clip = self._clip(view, layer)
        source = clip.source(number)
        if not any(name.endswith("Vector.X") for name in source.channels):
            raise ProblemError(f"Frame {number}: {path.name} has no Vector pass")
        return clip, source, self._frame(clip, source, number)

    def _frame(self, clip: Any, source: Any, number: int) -> Any:
        """The frame and those of its neighbours that were rendered with it."""
        frame = clip.with_neighbours(source)
        there = self.recipe.rendered
        if there is not None:
            gone = {"prev": number - 1, "next": number + 1}
            gone = {name: None for name, n in gone.items() if n not in there}
            frame = replace(frame, **gone).locked() if gone else frame
        return frame

    def _clip(self, view: View, layer: str) -> Any:
        if (view.name, layer) not in self._clips:
            recipe = self.recipe
            kept = held_out(recipe, view, layer) if recipe.kept else ()
            self._clips[view.name, layer] = wgmb.Clip(
                recipe.sharp.pattern(view),
                passes=wgmb.Passes(
                    color=f"{layer}.Combined", vectors=wgmb.Vectors("blender"), holdout=kept
                ),
                skip_missing=True,
                cuts=",".join(map(str, recipe.cuts)) or None,
            )
        return self._clips[view.name, layer]

    def _write(self, number: int, view: View, results: dict[str, tuple[Any, np.ndarray]]) -> Path:
        recipe, laid = self.recipe, self.recipe.picture.laid
        path = recipe.file(number, view)
        width, height = recipe.picture.result
        window = (0, 0, width - 1, height - 1)
        first, rgba = next(iter(results.values()))
        if not recipe.is_whole:
            planes = {c: laid(rgba[..., i]) for i, c in enumerate("RGBA"[: rgba.shape[2]])}
            part = exr.Part("", planes, {}, window, window)
            atomic.write_file(path, exr.encode(exr.Exr(path, [part]), "zips"))
            return path
        channels: dict[int, dict[str, np.ndarray]] = {}
        for i, part in enumerate(first.file.parts):
            channels[i] = {name: laid(plane) for name, plane in part.channels.items()}
        for source, rgba in results.values():
            for c, name in enumerate(source.color):
                part, stored = source.origin[name]
                place = next(i for i, one in enumerate(source.file.parts) if one is part)
                channels[place][stored] = laid(rgba[..., c])
        parts = [
            replace(part, channels=channels[i], data_window=window, display_window=window)
            for i, part in enumerate(first.file.parts)
        ]
        atomic.write_file(path, exr.encode(exr.Exr(path, parts), "zips"))
        return path


def held_out(recipe: Recipe, view: View, layer: str) -> tuple[str, ...]:
    """The masks of the objects that stay sharp, by the ids in the Cryptomatte of a layer.

    The ids are a hash of the names, so the first frame that lists an object tells for all.
    """
    ids: dict[str, str] = {}
    matte = ""
    for number in recipe.frames:
        path = recipe.sharp.path(number, view)
        if not path.is_file():
            continue
        for part in exr.read(path, header_only=True).parts:
            for name, manifest in _mattes(part.attributes):
                own = name.rpartition(".")
                if own[2] == MATTE[1] and (own[0] == layer or layer == COMPOSITE):
                    matte = matte or name
                    ids |= {k: v for k, v in manifest.items() if k in recipe.kept}
        if len(ids) == len(recipe.kept):
            break
    if not matte:
        raise ProblemError(
            f"Keep Sharp: the sharp frames have no Cryptomatte of objects in {layer}; render them "
            "again, or switch the pass on"
        )
    return tuple(f"{matte}=0x{id_}" for id_ in dict.fromkeys(ids.values()))


def _mattes(attributes: dict[str, Any]) -> Iterator[tuple[str, dict[str, str]]]:
    """The Cryptomattes of a file: name and ids by object."""
    for key, name in attributes.items():
        if key.startswith("cryptomatte/") and key.endswith("/name"):
            manifest = attributes.get(key.removesuffix("name") + "manifest", "{}")
            try:
                yield str(name), json.loads(manifest)
            except ValueError:
                raise ProblemError(f"The manifest of the Cryptomatte {name} is damaged") from None
