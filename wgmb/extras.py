"""Packages that only parts of wgmb need: the extra that installs each, and the error without it."""

from __future__ import annotations

import contextlib
import os
import platform
import shlex
import shutil
import sys
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from .errors import InputError


class Package(NamedTuple):
    """A package of an extra."""

    extra: str
    "The extra that installs it."
    name: str
    "Its usual name, for messages."
    index_name: str
    "Its name in the package index."


EXTRAS = {
    "av": Package("video", "PyAV", "av"),
    "cv2": Package("flow", "OpenCV", "opencv-python-headless"),
    "cyclopts": Package("cli", "cyclopts", "cyclopts"),
    "dask": Package("cluster", "dask", "dask"),
    "distributed": Package("cluster", "dask.distributed", "distributed"),
    "cryptography": Package("cluster", "cryptography", "cryptography"),
    "flip_evaluator": Package("compare", "flip-evaluator", "flip-evaluator"),
    "glfw": Package("view", "glfw", "glfw"),
    "imageio": Package("images", "imageio", "imageio"),
    "ipywidgets": Package("notebook", "ipywidgets", "ipywidgets"),
    "imgui_bundle": Package("view", "imgui-bundle", "imgui-bundle"),
    "numba": Package("bench", "numba", "numba"),
    "opentimelineio": Package("edit", "OpenTimelineIO", "opentimelineio"),
    "PIL": Package("images", "Pillow", "pillow"),
    "PyOpenColorIO": Package("ocio", "OpenColorIO", "opencolorio"),
    "pygfx": Package("pygfx", "pygfx", "pygfx"),
    "pytest": Package("testing", "pytest", "pytest"),
    "rendercanvas": Package("view", "rendercanvas", "rendercanvas"),
    "rich": Package("cli", "rich", "rich"),
    "tifffile": Package("images", "tifffile", "tifffile"),
    "vapoursynth": Package("vapoursynth", "VapourSynth", "vapoursynth"),
}
"""Every package of an extra, by the name that Python imports."""

WINGS = {"farm": "cluster", "hosts": "notebook", "lab": "compare", "perceive": "cli",
         "testing": "testing", "viewer": "view"}  # fmt: skip
"""Folders without which the rest of wgmb works, and the extra that each is for."""


def is_installed(package: str) -> bool:
    """Return True if the package is there; it is not loaded."""
    if package in sys.modules:
        return sys.modules[package] is not None
    return find_spec(package) is not None


def is_available(package: str) -> bool:
    """Return False if wgmb does without a package of EXTRAS on this system and Python."""
    from .requirements import is_excluded

    extra, _, name = EXTRAS[package]
    return not is_excluded(name, extra)


@contextlib.contextmanager
def needed_by(feature: str, extra: str = "") -> Iterator[None]:
    """Import packages of extras within it; InputError names the command that installs one.

    `feature`: who needs them, which begins the message. `extra`: if not the one in EXTRAS.
    """
    try:
        yield
    except ImportError as error:
        if not (why := reason(error, extra)):
            raise
        raise InputError(f"{feature}: {why}") from None


def reason(error: ImportError, extra: str = "") -> str:
    """The package or wing that is missing or too old and what installs it, or "".

    "" is for errors that are not about a package of an extra, nor about a wing of wgmb.
    """
    package, _, inner = (error.name or "").partition(".")
    if package == __package__ and (wing := inner.partition(".")[0]) in WINGS:
        return f"this copy of wgmb has no wgmb/{wing}; the extra {extra or WINGS[wing]} is for it"
    if package not in EXTRAS:
        return ""
    of, name, _ = EXTRAS[package]
    if isinstance(error, ModuleNotFoundError):
        if not is_available(package):
            here = f"Python {sys.version_info[0]}.{sys.version_info[1]} on {platform.machine()}"
            return f"{name} is not available for {here}"
        return f"{name} is not installed: {install_command(extra or of)}"
    if error.msg.startswith("cannot import name"):
        return f"{name} is too old for this: {install_command(extra or of)}"
    return ""  # a library of the system


def install_command(extra: str) -> str:
    """The command line that installs an extra into the environment that runs.

    In the `.venv` of a clone it is `./run setup EXTRA`; elsewhere pip's with the requirements that
    are not met, so that wgmb need not be in an index. Quoted for the shell of the system.
    """
    if run := _run_of_the_clone():
        return f"{run} setup {extra}"
    from .requirements import is_met, line, of_extra

    needed = of_extra(extra)
    named = [package.index_name for package in EXTRAS.values() if package.extra == extra]
    if lacking := [line(one) for one in needed.values() if not is_met(one)]:
        return _pip(lacking)
    own = [line(one) for name, one in needed.items() if name in named]
    if not own and not named:
        return f"the extra {extra} of wgmb has it"
    return _pip(["--force-reinstall", "--no-deps", *own] if own else named)  # files are damaged


def _run_of_the_clone() -> str:
    """The script `run` of the clone whose `.venv` runs, as it is called from here; else ""."""
    root = Path(__file__).parents[1]
    run, project = root / "run", root / "pyproject.toml"
    try:
        if os.name == "nt" or not os.path.samefile(sys.prefix, root / ".venv"):
            return ""
        if not run.is_file() or 'name = "wgmb"' not in project.read_text("utf-8"):
            return ""
        path = os.path.relpath(run)
    except OSError:
        return ""
    if path == "run":
        return "./run"
    return shlex.quote(str(run) if path.startswith(os.path.join("..", "..")) else path)


def _pip(requirements: Iterable[str]) -> str:
    """pip's line for the Python that runs, which need not have pip itself."""
    python = _quoted([_python()])
    words = _quoted(requirements)
    if is_installed("pip"):
        return f"{python} -m pip install {words}"
    if shutil.which("uv"):
        return f"uv pip install --python {python} {words}"
    return f"{python} -m ensurepip && {python} -m pip install {words}"


def _python() -> str:
    """The name of the Python that runs where a shell finds it by that name, else its path."""
    own = Path(sys.executable or "python")
    for name in ("python", "python3"):
        found = shutil.which(name)
        if found and Path(found).parent.resolve() == own.parent.resolve():
            return name
    return str(own)


def _quoted(words: Iterable[str]) -> str:
    if os.name == "nt":
        plain = [word.replace('"', "'") for word in words]
        return " ".join(f'"{word}"' if set(word) & set(" <>;&|^") else word for word in plain)
    return " ".join(map(shlex.quote, words))
