"""The blur methods, each one WGSL file and one small class with a common interface."""

from __future__ import annotations

from collections.abc import Collection

from ..errors import InputError, did_you_mean
from .accumulate import Accumulate
from .contract import Method
from .distributed import Distributed
from .fusion import Fusion
from .gather import Gather
from .keywords import MethodName
from .registry import Methods
from .reproject import Reproject
from .tap import Tap
from .tiles import Tiles
from .volume import Volume

METHODS = Methods((Tap, Tiles, Gather, Fusion, Reproject, Volume, Accumulate, Distributed))
"""The methods by name; see registry.py."""


def frame_methods() -> list[str]:
    """Names of the methods that blur frames; the others draw scenes."""
    return [name for name, method in METHODS.items() if "scene" not in method.needs]


def check_method(name: object, *, of_frames: bool = False) -> None:
    """InputError unless `name` is one of the methods, or of those that blur frames."""
    if not isinstance(name, str) or name not in METHODS:
        if isinstance(name, str) and name in METHODS.faults:
            raise InputError(METHODS.faults[name])
        known = frame_methods() if of_frames else list(METHODS)
        hint = did_you_mean(name, known)
        raise InputError(f"unknown method {name!r}; available: {', '.join(known)}{hint}")
    if of_frames:
        check_takes_frames(METHODS[name])


def check_takes_frames(method: type[Method]) -> None:
    """InputError if the method draws scenes."""
    if "scene" in method.needs:
        known = ", ".join(frame_methods())
        raise InputError(f"method {method.name!r} draws built-in scenes; for frames: {known}")


def default_method(has: Collection[str]) -> MethodName:
    """Return the default method for these inputs: gather if they suffice, else tiles."""
    return "gather" if Gather.needs <= {"color", *has} else "tiles"
