"""Packages that only parts of wgmb need: the extra that installs each, and the error without it."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

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
    install = install_command(extra or of)
    if isinstance(error, ModuleNotFoundError):
        return f"{name} is not installed: {install}"
    if error.msg.startswith("cannot import name"):
        return f"{name} is too old for this: {install}"
    return ""  # a library of the system


def install_command(extra: str) -> str:
    """The command that installs an extra into the environment that runs, published or not.

    In the environment of a clone's `./run`, that is `./run setup EXTRA`; elsewhere pip with the
    packages of the extra, as far as wgmb's metadata tell them.
    """
    clone = Path(__file__).parents[1]
    if Path(sys.prefix) == clone / ".venv" and (clone / "run").is_file():
        return f"{_nearest(clone / 'run')} setup {extra}"
    packages = " ".join(map(shlex.quote, requirements(extra)))
    if not packages:  # wgmb was copied, not installed, as into a bundle for Blender
        return f"the extra {extra} of wgmb has it"
    found = shutil.which("python")
    is_same = found is not None and os.path.samefile(found, sys.executable)
    return f"{'python' if is_same else shlex.quote(sys.executable)} -m pip install {packages}"


def requirements(extra: str) -> list[str]:
    """The packages of an extra, such as "glfw>=2.10"; none where wgmb has no metadata."""
    found: list[str] = []
    with contextlib.suppress(metadata.PackageNotFoundError):
        for line in metadata.requires("wgmb") or []:
            package, _, condition = (part.strip() for part in line.partition(";"))
            if not re.search(rf"""extra == ['"]{extra}['"]""", condition):
                continue
            nested = re.fullmatch(r"wgmb\[(.*)\]", package)
            if nested:
                found += [text for name in nested[1].split(",") for text in requirements(name)]
            else:
                found.append(package)
    return list(dict.fromkeys(found))


def _nearest(path: Path) -> str:
    """A path as it is shorter to type: from the current folder, if it lies below, or whole."""
    with contextlib.suppress(ValueError, OSError):
        return f"./{path.relative_to(Path.cwd())}"
    return shlex.quote(str(path))
