"""wgmb: motion blur on the GPU.

frames on disk ─ sequence ─┐
arrays you have ─ Frame ───┼─ velocity ── one method of blur/ ── array | sequence ─ files
your own wgpu textures ────┤                  │
Scene ── gbuffer ──────────┘                  │
Shutter ── times of the samples ──────────────┘

`blur` is one frame at once, `Blur` the same kept for many frames or for your own encoder.
"""

__version__ = "0.1.0"

import sys

TYPE_CHECKING = False  # typing's own, without the time that loading it takes
if TYPE_CHECKING:
    from .blur import METHODS
    from .bodies import Body
    from .camera_file import CameraFile
    from .cameras import Camera, Reprojections
    from .cone import Cone
    from .errors import DeviceError, Error, GpuMemoryError, InputError, ShaderError
    from .frame import Frame
    from .frame_views import FrameViews
    from .output import Output
    from .perceive import Viewer
    from .pipeline import Blur, blur
    from .render import Render
    from .run import Report, blur_sequence
    from .scene import Scene, Shot
    from .sequence import Clip, Passes
    from .shutter import Shutter
    from .vectors import Vectors

__all__ = [
    "METHODS",
    "Blur",
    "Body",
    "Camera",
    "CameraFile",
    "Clip",
    "Cone",
    "DeviceError",
    "Error",
    "Frame",
    "FrameViews",
    "GpuMemoryError",
    "InputError",
    "Output",
    "Passes",
    "Render",
    "Report",
    "Reprojections",
    "Scene",
    "ShaderError",
    "Shot",
    "Shutter",
    "Vectors",
    "Viewer",
    "blur",
    "blur_sequence",
]

_PLACES = {
    "blur": ("METHODS",),
    "bodies": ("Body",),
    "camera_file": ("CameraFile",),
    "cameras": ("Camera", "Reprojections"),
    "cone": ("Cone",),
    "errors": ("DeviceError", "Error", "GpuMemoryError", "InputError", "ShaderError"),
    "frame": ("Frame",),
    "frame_views": ("FrameViews",),
    "output": ("Output",),
    "perceive": ("Viewer",),
    "pipeline": ("Blur", "blur"),
    "render": ("Render",),
    "run": ("Report", "blur_sequence"),
    "scene": ("Scene", "Shot"),
    "sequence": ("Clip", "Passes"),
    "shutter": ("Shutter",),
    "vectors": ("Vectors",),
}
_Module = type(sys)
_PLACE = {name: place for place, names in _PLACES.items() for name in names}


class _Package(_Module):
    """Importing the folder of methods leaves `wgmb.blur` the function of that name."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name == "blur" and isinstance(value, _Module)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

if not TYPE_CHECKING:  # a checker takes every name for known otherwise

    def __getattr__(name: str) -> object:
        """Load what is asked for: importing wgmb itself costs nothing."""
        from importlib import import_module

        if name in _PLACE:
            value = getattr(import_module(f"{__name__}.{_PLACE[name]}"), name)
        elif name.startswith("_"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        else:
            try:
                value = import_module(f"{__name__}.{name}")
            except ModuleNotFoundError as error:
                if error.name != f"{__name__}.{name}":
                    raise
                raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
