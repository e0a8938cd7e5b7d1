"""User settings as plain values: one dataclass per group, convertible to library objects.

The command line, the viewer and the laboratory share them. The string under a field is its help.
"""

from .blur import METHOD_OPTIONS, BlurSettings
from .input import InputSettings
from .output import OutputSettings, rate_of
from .record import plain
from .scene import SceneSettings, parameters_of, size_of
from .shutter import ShutterSettings

__all__ = [
    "METHOD_OPTIONS",
    "BlurSettings",
    "InputSettings",
    "OutputSettings",
    "SceneSettings",
    "ShutterSettings",
    "parameters_of",
    "plain",
    "rate_of",
    "size_of",
]
