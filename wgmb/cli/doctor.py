"""`wgmb doctor`: what runs here, and whether it blurs, as text for a report of a fault."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import numpy as np

from .. import gpu
from .._version import __version__
from ..errors import DeviceError, Error
from ..extras import EXTRAS, install_command
from ..frame import Frame
from ..pipeline import Blur
from ..shutter import Shutter
from .exit_codes import DONE, NO_DEVICE, SOME_FAILED
from .spelling import as_options
from .terminal import out

CORE = ("wgpu", "numpy", "OpenEXR", "fileseq")
VARIABLES = (
    "WGMB_ADAPTER", "OCIO", "VK_DRIVER_FILES", "VK_ICD_FILENAMES", "WGPU_BACKEND_TYPE",
    "LP_NUM_THREADS", "DISPLAY", "WAYLAND_DISPLAY", "XDG_SESSION_TYPE",
)  # fmt: skip
"""Environment variables that change what wgmb does; others are not shown."""
REMEDY = "no GPU can be used; a driver for Vulkan helps, on Debian and Ubuntu without a GPU too: "
REMEDY += "apt-get install libvulkan1 mesa-vulkan-drivers"
_PATIENCE = 60  # seconds for the imports of all extras
_IMPORTS = """
import importlib, json, sys, warnings
warnings.simplefilter("ignore")
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
        why = ""
    except BaseException as error:
        why = f"{type(error).__name__}: {error}"
    sys.__stdout__.write(json.dumps([name, why]) + chr(10))
    sys.__stdout__.flush()
"""


def doctor() -> int:
    """Describe this installation and test one blur, as text to paste into a report.

    The exit code is 0 if the blur is right.

    Example: wgmb doctor
    """
    for line in (*_versions(), *_environment(), *_extras()):
        out(line)
    lines, code = _blur()
    for line in (*_adapters(), *lines):
        out(line)
    return code


def _versions() -> Iterator[str]:
    core = ", ".join(f"{name} {_version(name) or 'missing'}" for name in CORE)
    yield f"wgmb {__version__}, Python {platform.python_version()}, {core}"
    try:
        system = platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError):
        system = platform.platform()
    yield f"system: {system}, {platform.machine()}, {os.cpu_count()} cores"
    yield f"installed in {_without_home(Path(__file__).parents[1])}"


def _environment() -> Iterator[str]:
    for name in VARIABLES:
        if value := os.environ.get(name):
            yield f"{name}={_without_home(value)}"


def _extras() -> Iterator[str]:
    """A line for each extra: its packages, and what is wrong with them."""
    packages: dict[str, list[str]] = {}
    for package, (extra, _) in EXTRAS.items():
        packages.setdefault(extra, []).append(package)
    faults = _import_faults([name for name in EXTRAS if _version(name)])
    for extra, names in packages.items():
        told = [f"{EXTRAS[name][1]} {_version(name) or 'missing'}" for name in names]
        missing = [name for name in names if not _version(name)]
        remedy = f" ({install_command(extra)})" if missing else ""
        yield f"extra {extra}: {', '.join(told)}{remedy}"
        for name in names:
            if why := faults.get(name):
                yield f"  {EXTRAS[name][1]} cannot be imported: {_without_home(why)}"


def _version(package: str) -> str:
    """The version of the distribution that brings a package; "" if there is none."""
    for distribution in _DISTRIBUTIONS.get(package, (package,)):
        try:
            return metadata.version(distribution)
        except metadata.PackageNotFoundError:
            continue
    return ""


_DISTRIBUTIONS = {
    "cv2": ("opencv-python-headless", "opencv-python", "opencv-contrib-python"),
    "flip_evaluator": ("flip-evaluator",),
    "imgui_bundle": ("imgui-bundle",),
    "opentimelineio": ("OpenTimelineIO",),
    "PIL": ("pillow",),
    "PyOpenColorIO": ("opencolorio",),
}
"""Distributions whose name is not that of their package."""


def _import_faults(packages: list[str]) -> dict[str, str]:
    """Faults of installed packages by name, from imports in a process of their own."""
    line = [sys.executable, "-c", _IMPORTS, *packages]
    try:
        done = subprocess.run(line, capture_output=True, text=True, timeout=_PATIENCE)
        said = done.stdout
    except subprocess.TimeoutExpired as error:
        said = (error.stdout or b"").decode("utf-8", "replace")
    tried = dict(json.loads(row) for row in said.splitlines() if row.startswith("["))
    untried = [name for name in packages if name not in tried]
    if untried:
        tried[untried[0]] = "Python ends, or hangs, while it is imported"
    return {name: why for name, why in tried.items() if why}


def _adapters() -> Iterator[str]:
    try:
        chosen = gpu.choose_adapter().summary
    except DeviceError:
        chosen = None
    for i, adapter in enumerate(gpu.adapters()):
        mark = "*" if adapter.summary == chosen else " "
        yield f"{mark} adapter {i}: {adapter.summary}; driver {adapter.info['description']}"


def _blur() -> tuple[list[str], int]:
    """Lines about a test blur, and the exit code: an edge that moves 16 px becomes a ramp of 8."""
    x = np.arange(64) + 0.5
    edge = np.repeat((x > 32).astype(np.float32)[None, :, None], 36, axis=0).repeat(3, axis=2)
    motion = np.full((36, 64, 2), (16.0, 0.0), np.float32)
    begun = time.perf_counter()
    try:
        blurred = Blur("tap", shutter=Shutter(180), samples=16)(Frame(edge, motion))
    except DeviceError as error:
        return [f"test blur: {as_options(str(error))}", REMEDY], NO_DEVICE
    except Error as error:
        return [f"test blur: {error}"], SOME_FAILED
    took = time.perf_counter() - begun
    off = float(np.abs(blurred[..., :3] - np.clip((x - 28) / 8, 0, 1)[None, :, None]).max())
    if not off <= 1 / 16:
        return [f"test blur: wrong by up to {off:.3f}, at most {1 / 16:.3f} is right"], SOME_FAILED
    return [f"test blur: right, {took:.2f} s with the start of the GPU"], DONE


def _without_home(text: object) -> str:
    """A text without the name of the user's folder."""
    home = str(Path.home())
    return str(text).replace(home, "~") if len(home) > 1 else str(text)
