"""`wgmb doctor`: versions, GPUs and a test of a blur, as text for a report of a fault."""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

from ... import interpreter
from ..._version import __version__
from ...errors import DeviceError, Error
from ...extras import EXTRAS, install_command, is_available, is_installed
from ...requirements import version_of
from ..exit_codes import DONE, NO_DEVICE, SOME_FAILED
from ..spelling import as_options
from ..terminal import out

CORE = ("wgpu", "numpy", "OpenEXR", "fileseq", "packaging")
VARIABLES = (
    "WGMB_ADAPTER", "OCIO", "VK_DRIVER_FILES", "VK_ADD_DRIVER_FILES", "VK_ICD_FILENAMES",
    "VK_LOADER_DRIVERS_SELECT", "VK_LOADER_DRIVERS_DISABLE", "MESA_VK_DEVICE_SELECT", "DRI_PRIME",
    "CUDA_VISIBLE_DEVICES", "WGPU_BACKEND_TYPE", "WGPU_LIB_PATH", "LP_NUM_THREADS",
    "LD_LIBRARY_PATH", "PYTHONPATH", "DISPLAY", "WAYLAND_DISPLAY", "XDG_SESSION_TYPE",
)  # fmt: skip
"""Environment variables that change wgmb's behaviour; others are not shown."""
REMEDY = "no GPU can be used; a driver for Vulkan helps, on Debian and Ubuntu without a GPU too: "
REMEDY += "apt-get install libvulkan1 mesa-vulkan-drivers"
_PATIENCE = 60  # seconds for the imports of all extras, in processes of their own
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
    for line in (*_versions(), *_environment(), *_extras(), *_methods()):
        out(line)
    lines, code = _blur()
    for line in (*_adapters(), *lines):
        out(line)
    return code


def _versions() -> Iterator[str]:
    core = ", ".join(f"{name} {version_of(name) or 'missing'}" for name in CORE)
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
            if name == "DISPLAY":  # of another machine, it begins with that one's name
                value = value[max(value.rfind(":"), 0) :]
            yield f"{name}={_without_home(value)}"


def _extras() -> Iterator[str]:
    """A line for each extra: its packages, and their faults."""
    packages: dict[str, list[str]] = {}
    for name, package in EXTRAS.items():
        packages.setdefault(package.extra, []).append(name)
    faults = _import_faults([name for name in EXTRAS if is_installed(name)])
    for extra, names in packages.items():
        told = [f"{EXTRAS[name].name} {_version(name) or _why_not(name)}" for name in names]
        missing = [name for name in names if not _version(name) and is_available(name)]
        remedy = f" ({_without_home(install_command(extra))})" if missing else ""
        yield f"extra {extra}: {', '.join(told)}{remedy}"
        for name in names:
            if why := faults.get(name):
                yield f"  {EXTRAS[name].name} cannot be imported: {_without_home(why)}"


def _methods() -> Iterator[str]:
    """A line for each method that another package brings; main() tells which cannot be used."""
    try:
        from ...methods import METHODS
    except Exception:  # of a library, which the blur tells
        return
    for name in METHODS:
        if package := METHODS.packages.get(name):
            yield f"method {name}: of {package}"


def _version(package: str) -> str:
    """The version of a package of an extra; "" if it is missing."""
    if not is_installed(package):
        return ""
    names = (EXTRAS[package].index_name, *_OTHERS.get(package, ()))
    return next(filter(None, map(version_of, names)), "of unknown version")


def _why_not(package: str) -> str:
    return "missing" if is_available(package) else "(not for this Python)"


_OTHERS = {"cv2": ("opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")}
"""Other distributions that bring a package."""


def _import_faults(packages: list[str]) -> dict[str, str]:
    """Faults of installed packages by name, from imports in processes of their own.

    One that ends its process, or hangs, is told as such, and the next process tries those after it.
    """
    faults, last = {}, time.monotonic() + _PATIENCE
    while packages:
        line, kept = interpreter.command("-c", _IMPORTS, *packages), interpreter.environment()
        patience = max(last - time.monotonic(), 1)
        try:
            done = subprocess.run(line, capture_output=True, timeout=patience, env=kept)
            said, end = done.stdout, f"Python ends with code {done.returncode}"
        except subprocess.TimeoutExpired as error:
            said, end = error.stdout or b"", f"no end after {patience:.0f} s"
        except OSError as error:  # the program that runs is not a Python
            return {packages[0]: str(error)}
        rows = [row for row in said.decode("utf-8", "replace").splitlines() if row[:1] == "["]
        tried = dict(map(json.loads, rows))
        faults |= {name: why for name, why in tried.items() if why}
        packages = [name for name in packages if name not in tried]
        if packages:
            faults[packages.pop(0)] = end
    return faults


def _adapters() -> Iterator[str]:
    """A line for each adapter with its driver; none where wgpu fails, which the blur tells."""
    try:
        from ... import gpu

        adapters = gpu.adapters()
    except Exception:  # whatever is wrong with a driver or a library is for the report
        return
    try:
        chosen = gpu.choose_adapter().summary
    except DeviceError:
        chosen = None
    for i, adapter in enumerate(adapters):
        mark = "*" if adapter.summary == chosen else " "
        yield f"{mark} adapter {i}: {adapter.summary}; driver {adapter.info['description']}"


def _blur() -> tuple[list[str], int]:
    """Lines about a test blur, and the exit code."""
    begun = time.perf_counter()
    try:
        off = _error()
    except DeviceError as error:
        return [f"test blur: {as_options(str(error))}", REMEDY], NO_DEVICE
    except Error as error:
        return [f"test blur: {error}"], SOME_FAILED
    except Exception as error:  # as above
        why = " ".join(f"{type(error).__name__}: {error}".split())
        return [f"test blur: {_without_home(why)}", REMEDY], NO_DEVICE
    took = time.perf_counter() - begun
    if not off <= 1 / 16:
        return [f"test blur: wrong by up to {off:.3f}, at most {1 / 16:.3f} is right"], SOME_FAILED
    return [f"test blur: right, {took:.2f} s with the start of the GPU"], DONE


def _error() -> float:
    """The greatest error of a test blur: an edge that moves 16 px becomes a ramp of 8 px."""
    import numpy as np

    from ...frame import Frame
    from ...pipeline.blur import Blur
    from ...shutter import Shutter

    x = np.arange(64) + 0.5
    edge = np.repeat((x > 32).astype(np.float32)[None, :, None], 36, axis=0).repeat(3, axis=2)
    motion = np.full((36, 64, 2), (16.0, 0.0), np.float32)
    blurred = Blur("tap", shutter=Shutter(180), samples=16)(Frame(edge, motion))
    return float(np.abs(blurred[..., :3] - np.clip((x - 28) / 8, 0, 1)[None, :, None]).max())


def _without_home(text: object) -> str:
    """A text without the name of the user's folder, there or elsewhere in a path."""
    home, told = Path.home(), str(text)
    if home == home.parent:  # the whole disk, as in a container
        return told
    for path in {str(home), str(home.resolve())}:
        told = told.replace(path, "~")
    return re.sub(rf"(?<=[/\\]){re.escape(home.name)}(?=[/\\]|$)", "USER", told)
