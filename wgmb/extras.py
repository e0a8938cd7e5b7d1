"""Packages that only parts of wgmb need: the extra that installs each, and the error without it."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from importlib.util import find_spec

from .errors import InputError

EXTRAS = {
    "av": ("video", "PyAV"),
    "cv2": ("flow", "OpenCV"),
    "cyclopts": ("cli", "cyclopts"),
    "dask": ("cluster", "dask"),
    "distributed": ("cluster", "dask.distributed"),
    "flip_evaluator": ("compare", "flip-evaluator"),
    "glfw": ("view", "glfw"),
    "imageio": ("images", "imageio"),
    "ipywidgets": ("notebook", "ipywidgets"),
    "imgui_bundle": ("view", "imgui-bundle"),
    "opentimelineio": ("edit", "OpenTimelineIO"),
    "PIL": ("images", "Pillow"),
    "PyOpenColorIO": ("ocio", "OpenColorIO"),
    "pygfx": ("pygfx", "pygfx"),
    "rendercanvas": ("view", "rendercanvas"),
    "rich": ("cli", "rich"),
    "tifffile": ("images", "tifffile"),
}
"""The extra and the usual name of each package, by the name that Python imports."""


def is_installed(package: str) -> bool:
    """Return True if the package is there; it is not loaded."""
    if package in sys.modules:
        return sys.modules[package] is not None
    return find_spec(package) is not None


@contextlib.contextmanager
def needed_by(what: str, extra: str = "") -> Iterator[None]:
    """Import packages of extras within it; InputError names the extra where one is missing.

    `what`: who needs them, which begins the message. `extra`: if not the one in EXTRAS.
    """
    try:
        yield
    except ImportError as error:
        if not (why := reason(error, extra)):
            raise
        raise InputError(f"{what}: {why}") from None


def reason(error: ImportError, extra: str = "") -> str:
    """The package and extra to install, if an extra's package is missing or too old; else ""."""
    package = (error.name or "").partition(".")[0]
    if package not in EXTRAS:
        return ""
    of, name = EXTRAS[package]
    install = f"pip install 'wgmb[{extra or of}]'"
    if isinstance(error, ModuleNotFoundError):
        return f"{name} is not installed: {install}"
    if error.msg.startswith("cannot import name"):
        return f"{name} is too old for this: {install}"
    return ""  # a library of the system
