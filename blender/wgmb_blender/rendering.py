"""Two ways to let Blender render: at once, or beside the window, which stays awake meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import bpy

from .wgmb_worker.problem import ProblemError, StoppedError

Render = Callable[..., Iterator[None]]
"""Called with a scene, a frame and the files to be written; without files, a whole film. A
generator that ends when they are there."""


def at_once(scene: bpy.types.Scene, number: int, paths: Sequence[Path]) -> Iterator[None]:
    """Render while everything else waits: the command line, and short work."""
    began = time.time()
    scene.frame_set(number)
    try:
        done = bpy.ops.render.render(scene=scene.name, **_what(paths))
    except RuntimeError as error:
        raise ProblemError(_sentence(error)) from None
    if "FINISHED" not in done:
        raise StoppedError("The rendering was stopped")
    _check(paths, began)
    yield from ()


def beside(scene: bpy.types.Scene, number: int, paths: Sequence[Path]) -> Iterator[None]:
    """Render as F12 does, in a job of its own; yields until it has ended."""
    began = time.time()
    ended: list[bool] = []
    hooks = (
        (bpy.app.handlers.render_complete, lambda *_: ended.append(True)),
        (bpy.app.handlers.render_cancel, lambda *_: ended.append(False)),
    )
    for handlers, hook in hooks:
        handlers.append(hook)
    try:
        scene.frame_set(number)
        bpy.ops.render.render("INVOKE_DEFAULT", scene=scene.name, **_what(paths))
        while not ended or bpy.app.is_job_running("RENDER"):
            yield
    except RuntimeError as error:
        raise ProblemError(_sentence(error)) from None
    finally:
        for handlers, hook in hooks:
            handlers.remove(hook)
    if not ended[-1]:
        raise StoppedError("The rendering was stopped")
    _check(paths, began)


def _what(paths: Sequence[Path]) -> dict[str, Any]:
    return {"write_still": True} if paths else {"animation": True}


def _check(paths: Sequence[Path], began: float) -> None:
    """ProblemError where a file is not there, or is an old one."""
    for path in paths:
        # A file system may count in steps of two seconds.
        if not path.is_file() or path.stat().st_mtime < began - 2:
            raise ProblemError(f"Blender did not write {path}")


def _sentence(error: RuntimeError) -> str:
    """Blender's reports, in one line."""
    lines = [line.removeprefix("Error: ").strip() for line in str(error).splitlines()]
    return "Blender: " + " ".join(line for line in lines if line)
