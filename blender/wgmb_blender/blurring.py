"""Frames blurred by the other process, ahead of the one that is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import bpy

from .process import Process
from .sharp import LIGHT_PASSES, PASSES
from .wgmb_worker.problem import ProblemError
from .wgmb_worker.recipe import COMPOSITE, MATTE, Recipe, Setup, View, told

_AHEAD = 2  # frames that are blurred, or wait to be, while one is written


class Blurring:
    """The frames of a recipe, one after the other."""

    def __init__(self, process: Process, setup: Setup, recipe: Recipe):
        self.process, self.recipe = process, recipe
        self._words = {"setup": told(setup), "recipe": told(recipe)}
        self._running: dict[int, Future[dict[str, Any]]] = {}

    def ask(self, number: int) -> Future[dict[str, Any]]:
        """The frame: its `files`, one of each view, `notes`, and whether anything `moves`."""
        for n in [n for n in self.recipe.frames if n >= number][: 1 + _AHEAD]:
            if n not in self._running:
                self._running[n] = self.process.ask("blur", number=n, **self._words)
        return self._running.pop(number)


def save_layers(
    process: Process,
    scene: bpy.types.Scene,
    files: Sequence[Path],
    composites: Sequence[Path] | None,
    targets: Sequence[Path],
) -> Iterator[Future[None]]:
    """Blurred files, of each view, as multilayer files; yields what is to be waited for.

    Passes that were only switched on for the blur are left out; depth and compression are those of
    the scene's output.
    """
    image = scene.render.image_settings
    if len(files) != len(targets):
        raise ProblemError(
            "Stereo frames as OpenEXR MultiLayer need Views Format: Individual in the output"
        )
    left_out = [
        (layer.name, name)
        for layer in scene.view_layers
        for switch, name in (*PASSES.items(), *LIGHT_PASSES.items(), MATTE)
        if not getattr(layer, switch)
    ]
    for i, (file, target) in enumerate(zip(files, targets, strict=True)):
        yield process.ask(
            "layers",
            file=str(file),
            composite=None if composites is None else str(composites[i]),
            path=str(target),
            left_out=left_out,
            is_half=image.color_depth == "16",
            codec=image.exr_codec,
        )


def both_halves(
    process: Process, recipe: Recipe, number: int, file: Path, view: View, layer: str, path: Path
) -> Future[None]:
    """Ask for a sharp frame and its blurred one, side by side in a numpy file."""
    return process.ask(
        "both",
        file=str(file),
        sharp=str(recipe.sharp.path(number, view)),
        layer=COMPOSITE if COMPOSITE in recipe.layers else layer,
        picture=told(recipe.picture),
        path=str(path),
    )
