"""Properties set for a while, and put back as they were."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from typing import Any

import bpy

Change = tuple[Any, str, Any]
"""The owner of a property, its name and the value for a while."""

_PLAIN = {"BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"}
_FIRST = ("media_type", "file_format")  # setting one of them resets others of the same owner


def values_of(owner: Any) -> dict[str, Any]:
    """The plain properties of `owner` that can be set, those first that reset others."""
    names = [
        p.identifier for p in owner.bl_rna.properties if not p.is_readonly and p.type in _PLAIN
    ]
    names.sort(key=lambda name: _FIRST.index(name) if name in _FIRST else len(_FIRST))
    return {name: _value(owner, name) for name in names}


def put(owner: Any, values: dict[str, Any]) -> None:
    """Set properties, twice where the first time one has reset another that came before it."""
    for _ in range(2):
        for name, value in values.items():
            if _value(owner, name) != value:
                with contextlib.suppress(TypeError):  # what the file format does not have
                    setattr(owner, name, value)


@contextlib.contextmanager
def changed(changes: Iterable[Change]) -> Iterator[None]:
    """Set properties in their order; afterwards all are as they were before the first.

    Blender changes more than it is told to: a media type resets format, depth and colours
    (5.0), a file format the container of a film (4.2). So where an image format is changed,
    all of it and of the film's settings is remembered.
    """
    changes = list(changes)
    before: dict[int, tuple[Any, dict[str, Any]]] = {}
    for owner, name, _ in changes:
        if isinstance(owner, bpy.types.ImageFormatSettings):
            whole = [owner]
            if isinstance(owner.id_data, bpy.types.Scene):
                whole.append(owner.id_data.render.ffmpeg)
            for one in whole:
                before.setdefault(_key(one), (one, values_of(one)))
        else:
            values = before.setdefault(_key(owner), (owner, {}))[1]
            values.setdefault(name, _value(owner, name))
    try:
        for owner, name, value in changes:
            setattr(owner, name, value)
        yield
    finally:
        for owner, values in before.values():
            with contextlib.suppress(ReferenceError):  # it was removed meanwhile
                put(owner, values)


def _key(owner: Any) -> int:
    """Key of an owner: a scene's render settings lie where the scene does."""
    return hash((owner.as_pointer(), owner.bl_rna.identifier))


def _value(owner: Any, name: str) -> Any:
    value = getattr(owner, name)
    is_plain = isinstance(value, (bool, int, float, str, set))
    return value if is_plain else tuple(value)
