"""The package PyOpenColorIO, which is optional: loading it, its errors, its processors."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..extras import is_installed, needed_by
from ..threads import crew

_BUILT_IN = {"builtin": "ocio://default", "studio": "ocio://studio-config-latest"}
_BLENDER = "*/datafiles/colormanagement/config.ocio"
_THREADS = min(os.cpu_count() or 1, 8)


def installed() -> bool:
    """True if OpenColorIO is there; it is not loaded."""
    return is_installed("PyOpenColorIO")


def load() -> Any:
    """The module; InputError says how to install it."""
    with needed_by("colour configs"):
        import PyOpenColorIO
    return PyOpenColorIO


@contextlib.contextmanager
def reported(about: str) -> Iterator[None]:
    """OpenColorIO's errors as one line that names what they are about; it prints nothing."""
    ocio = load()
    level = ocio.GetLoggingLevel()
    ocio.SetLoggingLevel(ocio.LOGGING_LEVEL_NONE)
    try:
        yield
    except UnicodeDecodeError:  # of names, or of its own message
        raise InputError(f"{about}: holds text that is not UTF-8") from None
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        raise InputError(f"{about}: {' '.join(str(error).split())}") from None
    finally:
        ocio.SetLoggingLevel(level)


def config_file(config: str) -> str:
    """OpenColorIO's name of the config "builtin", "studio", "blender", or of the given file."""
    if config == "blender":
        return str(_blenders_config())
    return _BUILT_IN.get(config, config)


def _blenders_config() -> Path:
    """The newest config of the module bpy, or of the program `blender`."""
    spec, program = find_spec("bpy"), shutil.which("blender")
    folders = list(spec.submodule_search_locations or ()) if spec else []
    folders += [Path(program).resolve().parent] if program else []
    found = [file for folder in folders for file in sorted(Path(folder).glob(_BLENDER))]
    if not found:
        raise InputError(
            "config blender: neither the module bpy nor the program blender was found; name the "
            "file datafiles/colormanagement/config.ocio in Blender's folder instead"
        )
    return found[-1]


def applied(processor: Any, rgb: np.ndarray) -> np.ndarray:
    """Apply a processor in place to (height, width, 3) float32, in threads where that is much."""
    bands = [band for band in np.array_split(rgb, _THREADS) if len(band)]
    if rgb.size < 1 << 16 or len(bands) == 1:
        processor.applyRGB(rgb)
        return rgb
    with crew(len(bands), "ocio") as pool:  # it lets go of Python's lock
        list(pool.map(processor.applyRGB, bands))
    return rgb


@dataclass(frozen=True)
class Shader:
    """A processor in GLSL for Vulkan: a function `vec4 shown(vec4)`."""

    text: str
    tables: dict[str, np.ndarray]
    """By the names of their samplers in `text`, where they are bound one after the other:
    float32, ([depth,] [height,] width, 4)."""
    interpolated: frozenset[str]
    """Names of samplers that interpolate; the others take the nearest."""


def shader(processor: Any, first_binding: int) -> Shader:
    """OpenColorIO's shader of a processor; its tables are bound from `first_binding` on.

    InputError where it has none, or one with properties of its own.
    """
    ocio = load()
    made = ocio.GpuShaderDesc.CreateShaderDesc(
        language=ocio.GPU_LANGUAGE_GLSL_VK_4_6, functionName="shown", resourcePrefix="ocio_"
    )
    made.setDescriptorSetIndex(0, first_binding)
    processor.getDefaultGPUProcessor().extractGpuShaderInfo(made)
    if len(list(made.getUniforms())):
        raise InputError("OpenColorIO's shader has properties that change while it runs")
    tables, interpolated = {}, set()
    for table in made.get3DTextures():
        tables[table.samplerName] = _texels(table, (table.edgeLen,) * 3, 3)
    for table in made.getTextures():
        flat = table.dimensions == made.TEXTURE_1D
        size = (table.width,) if flat else (table.height, table.width)
        channels = 1 if table.channel == made.TEXTURE_RED_CHANNEL else 3
        tables[table.samplerName] = _texels(table, size, channels)
    for table in (*made.get3DTextures(), *made.getTextures()):
        if table.interpolation != ocio.INTERP_NEAREST:
            interpolated.add(table.samplerName)
    return Shader(made.getShaderText(), tables, frozenset(interpolated))


def _texels(table: Any, size: tuple[int, ...], channels: int) -> np.ndarray:
    values = np.zeros((*size, 4), np.float32)
    values[..., :channels] = np.reshape(table.getValues(), (*size, channels))
    return values
