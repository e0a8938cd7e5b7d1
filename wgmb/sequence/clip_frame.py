"""A frame whose neighbours are read when they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

from ..frame import Frame

Load = Callable[[int], Frame | None]
"""Reads the frame before (-1) or after (1), of the same shot; None where there is none."""


class ClipFrame(Frame):
    """A frame of a Clip. `prev` and `next` are read when they are asked for, and not kept."""

    @classmethod
    def of(cls, frame: Frame, load: Load) -> ClipFrame:
        """The frame with neighbours that `load` reads."""
        made = object.__new__(cls)
        made.__dict__.update({k: v for k, v in vars(frame).items() if k not in ("prev", "next")})
        made.__dict__["_load"] = load
        return made

    def __repr__(self) -> str:
        alone = copy(self)
        alone.__dict__.pop("_load", None)  # nothing is read to be counted
        return Frame.__repr__(alone)


def _side(name: str, side: int) -> property:
    def read(frame: ClipFrame) -> Frame | None:
        own: dict[str, Any] = vars(frame)
        if name in own:
            return own[name]
        return own["_load"](side) if "_load" in own else None

    def put(frame: ClipFrame, other: Frame | None) -> None:
        vars(frame)[name] = other

    return property(read, put, doc=f"The frame {'before' if side < 0 else 'after'}, or None.")


for _name, _number in (("prev", -1), ("next", 1)):  # a property is found before what is stored
    setattr(ClipFrame, _name, _side(_name, _number))
