"""The live preview: the current frame blurred in the Image Editor, anew when a setting changes.

A timer of Blender's asks at every tick whether anything has changed. The other process blurs
meanwhile, so a slider that is dragged never waits; values in between are left out.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import job, running
from .comparison import PREVIEW, show
from .process import Process, lent
from .settings import wanted_of
from .wanted import ERRORS
from .wgmb_worker.problem import ProblemError, plain
from .wgmb_worker.recipe import told

_EVERY = 0.05  # seconds between two ticks
_steps: list[Iterator[str]] = []
_told: list[str] = []


def is_on() -> bool:
    """Return True while there is a preview."""
    return bool(_steps)


def text() -> str:
    """A line for the panel: what is shown, or why nothing is."""
    return _told[0] if _told and is_on() else ""


def begin(scene: bpy.types.Scene) -> bpy.types.Image:
    """Begin to show the current frame of a scene; returns the image."""
    end()
    _steps.append(_preview(scene))
    bpy.app.timers.register(tick, first_interval=0.0)
    return bpy.data.images.get(PREVIEW) or show(np.zeros((9, 16, 4), np.float32), PREVIEW)


def end() -> None:
    """End it; the image stays."""
    for steps in _steps:
        steps.close()
    _steps.clear()
    _told.clear()
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)


def tick() -> float | None:
    """Do a step; returns the seconds until the next one, None at the end."""
    if not _steps:
        return None
    try:
        line = next(_steps[0])
    except ReferenceError:  # the scene is gone
        _steps.clear()
        return None
    except BaseException:
        _steps.clear()
        raise
    if [line] != _told:
        _told[:] = [line]
        for manager in bpy.data.window_managers:
            running.redraw(manager)
    return _EVERY


def _preview(scene: bpy.types.Scene) -> Iterator[str]:
    """Yield a line about what is shown, forever."""
    line, shown = "", None
    with lent() as process, tempfile.TemporaryDirectory(prefix="wgmb_") as folder:
        try:
            while True:
                number = scene.frame_current
                try:
                    wanted = _described(scene, number, Path(folder))
                    if wanted != shown:
                        if shown and _is_rendered_anew(shown["times"], wanted["times"]):
                            process.ask("rest")
                        shown = wanted
                        yield from _shown(process, wanted, number, Path(folder), line)
                        line = f"Preview of frame {number}"
                except ERRORS as error:
                    line = plain(error)
                yield line
        finally:
            if not process.is_idle:
                process.close()  # before its folder goes


def _described(scene: bpy.types.Scene, number: int, folder: Path) -> dict[str, Any]:
    """All that the picture depends on: settings, and the times of the files."""
    setup, recipe = job.described(scene, wanted_of(scene), number, folder)
    times = {}
    for n in (number - 1, number, number + 1):
        with contextlib.suppress(OSError):
            times[n] = recipe.sharp.path(n, recipe.views[0]).stat().st_mtime_ns
    return {"setup": told(setup), "recipe": told(recipe), "times": times}


def _is_rendered_anew(before: dict[int, int], now: dict[int, int]) -> bool:
    return any(now.get(number) != time for number, time in before.items() if number in now)


def _shown(
    process: Process, wanted: dict[str, Any], number: int, folder: Path, line: str
) -> Iterator[str]:
    """Blur the frame and show it; ProblemError where it cannot be."""
    if number not in wanted["times"]:
        raise ProblemError(f"Frame {number} has no sharp file yet: Render and Blur makes it")
    path = folder / "preview.npy"
    words = {name: wanted[name] for name in ("setup", "recipe")}
    future: Future[None] = process.ask("preview", number=number, path=str(path), **words)
    while not future.done():
        yield line or f"Blurring frame {number}"
    future.result()
    show(np.load(path), PREVIEW)
    for manager in bpy.data.window_managers:
        running.redraw(manager, "IMAGE_EDITOR")


@persistent
def _end_before_loading(*_: object) -> None:
    end()


def register() -> None:
    """End the preview before another file is loaded."""
    bpy.app.handlers.load_pre.append(_end_before_loading)


def unregister() -> None:
    """End it, and forget about files."""
    end()
    bpy.app.handlers.load_pre.remove(_end_before_loading)
