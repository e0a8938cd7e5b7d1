"""The run under way, for the panel, and the request that it stop."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass
class Run:
    """A run beside the window: the share that is done, 0..1, and what is being done."""

    share: float = 0.0
    text: str = ""
    is_stopping: bool = False


_now: list[Run] = []


def begin() -> Run:
    """Note that a run begins."""
    _now[:] = [Run()]
    return _now[0]


def end() -> None:
    """Note that it has ended."""
    _now.clear()


def now() -> Run | None:
    """The run beside the window, if there is one."""
    return _now[0] if _now else None


def redraw(manager: bpy.types.WindowManager, kind: str = "PROPERTIES") -> None:
    """Have editors of a kind drawn again, by default the panels."""
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type == kind:
                area.tag_redraw()
