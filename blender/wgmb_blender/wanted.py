"""The wishes of the user, and the report afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from .wgmb_worker.problem import ProblemError

Step = tuple[float, str]
"""The share that is done, 0..1, and what is being done."""

ERRORS = ProblemError, OSError, MemoryError
"""Errors that are told in a sentence; all others are faults of the add-on."""


@dataclass(frozen=True)
class Wanted:
    """The wishes of the user. `frames`: by default the scene's. `samples`: a number or "auto".

    `light`: "ON", "OFF" or "AUTO", follow light that moves over surfaces. `handles`: render the
    frames around those too. `overscan`: pixels. `composited`: blur what the compositor makes, not
    what it is given. `kept`: collections that stay sharp. `sharp`: where the sharp frames lie, as
    in the panel. `device`: a part of an adapter's name.
    """

    method: str = "gather"
    samples: int | str = 16
    frames: tuple[int, ...] | None = None
    light: str = "AUTO"
    handles: bool = True
    overscan: int = 0
    composited: bool = False
    kept: tuple[str, ...] = ()
    sharp: str = "//sharp/"
    device: str | None = None
    is_rendering: bool = True
    is_blurring: bool = True


@dataclass
class Report:
    """The result of a run: frames, those that failed and why, remarks, and files."""

    done: list[int] = field(default_factory=list)
    failed: dict[int, str] = field(default_factory=dict)
    skipped: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    @property
    def lines(self) -> list[str]:
        """The lines that the user reads, the most important last."""
        lines = list(dict.fromkeys(self.notes))
        if self.skipped:
            lines.append(f"{_count(self.skipped)} already there: Overwrite is off")
        lines += list(self.failed.values())
        if self.done or self.failed:
            lines.append(f"{_count(self.done)} blurred")
        return lines


def _count(frames: Sequence[int]) -> str:
    return "1 frame" if len(frames) == 1 else f"{len(frames)} frames"


def frames_of(scene: bpy.types.Scene, wanted: Wanted) -> list[int]:
    """The frames to blur."""
    if wanted.frames is not None:
        return list(dict.fromkeys(wanted.frames))
    return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))


def objects_of(collections: Sequence[str]) -> tuple[str, ...]:
    """The objects of collections, with those that they instance, by name."""
    names: dict[str, None] = {}
    ahead = [bpy.data.collections.get(name) for name in collections]
    missing = [name for name, one in zip(collections, ahead, strict=True) if one is None]
    if missing:
        raise ProblemError(f"Keep Sharp: there is no collection {missing[0]!r}")
    seen: set[str] = set()
    while ahead:
        collection = ahead.pop()
        if collection is None or collection.name_full in seen:
            continue
        seen.add(collection.name_full)
        for one in collection.all_objects:
            names[one.name] = None
            ahead.append(one.instance_collection)
    return tuple(names)
