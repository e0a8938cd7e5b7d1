"""The blur methods, each one WGSL file and one small class with a common interface."""

from __future__ import annotations

from collections.abc import Collection

from ..errors import InputError, did_you_mean
from .accumulate import Accumulate
from .distributed import Distributed
from .fusion import Fusion
from .gather import Gather
from .keywords import MethodName
from .reproject import Reproject
from .tap import Tap
from .tiles import Tiles
from .volume import Volume

_ALL = (Tap, Tiles, Gather, Fusion, Reproject, Volume, Accumulate, Distributed)
METHODS: dict[str, type] = {m.name: m for m in _ALL}
FRAME_METHODS = tuple(m.name for m in _ALL if "scene" not in m.needs)
"""Methods that blur frames; the others draw scenes."""


def check_method(name: object, known: Collection[str] = tuple(METHODS)) -> None:
    """InputError unless `name` is one of the `known` methods, which may be FRAME_METHODS."""
    if not isinstance(name, str) or name not in METHODS:
        hint = did_you_mean(name, known)
        raise InputError(f"unknown method {name!r}; available: {', '.join(known)}{hint}")
    if name not in known:
        raise InputError(f"method {name!r} draws built-in scenes; for frames: {', '.join(known)}")


def default_method(has: Collection[str]) -> MethodName:
    """Return the default method for these inputs: gather if they suffice, else tap."""
    return "gather" if Gather.needs <= {"color", *has} else "tap"
