"""wgmb: motion blur on the GPU.

input          exposure      blur                      sum            output
sequence/ ─┐                                         ┌ pipeline/ ─┬─ output/ ── files
video/ ────┼── exposure ──┬─ gpu_frame/ ── methods/ ─┘            ├─ video/write/
Frame ─────┤    shutter   │  textures,     one blur               └─ arrays, textures
Scene ─────┘              └─ motion
                run/ drives the road from a request to files

`blur` blurs a single frame; `Blur` is compiled once, for many frames or your own encoder.
"""

import sys

from ._version import __version__ as __version__

if sys.version_info < (3, 11):  # noqa: UP036
    raise ImportError(f"wgmb needs Python 3.11 or newer, got {sys.version.split()[0]}")

TYPE_CHECKING = False  # typing's own, without the time that loading it takes
if TYPE_CHECKING:
    from .camera import Camera, Reprojections
    from .color.spaces import ColorConfig, ColorSpace, Display
    from .cone import Cone
    from .errors import DeviceError, Error, GpuMemoryError, InputError, ShaderError
    from .flow import Flow
    from .frame import Frame
    from .gpu_frame.views import FrameViews
    from .hosts.notebook import explore
    from .methods import METHODS
    from .observer import Observer
    from .output.output import Output
    from .output.result import Result
    from .output.vectors import VectorOutput
    from .pipeline.blur import Blur
    from .pipeline.one_frame import blur
    from .png import show
    from .render import Render
    from .run.file_sink import BlurredFrame
    from .run.pictures import PictureBlur, blur_pictures
    from .run.report import BatchReport, VideoReport
    from .run.sequence import blur_sequence, vectors_sequence
    from .run.stages import blurred
    from .run.video import blur_video
    from .scene import Body, CameraPath, Scene
    from .sequence.clip import Clip, Passes
    from .sequence.layers.camera_file import CameraFile
    from .sequence.layers.vectors import Vectors
    from .shutter import Shutter

__all__ = [
    "METHODS",
    "BatchReport",
    "Blur",
    "BlurredFrame",
    "Body",
    "Camera",
    "CameraFile",
    "CameraPath",
    "Clip",
    "ColorConfig",
    "ColorSpace",
    "Cone",
    "DeviceError",
    "Display",
    "Error",
    "Flow",
    "Frame",
    "FrameViews",
    "GpuMemoryError",
    "InputError",
    "Observer",
    "Output",
    "Passes",
    "PictureBlur",
    "Render",
    "Reprojections",
    "Result",
    "Scene",
    "ShaderError",
    "Shutter",
    "VectorOutput",
    "Vectors",
    "VideoReport",
    "blur",
    "blur_pictures",
    "blur_sequence",
    "blur_video",
    "blurred",
    "explore",
    "show",
    "vectors_sequence",
]

_PLACES = {
    "camera": ("Camera", "Reprojections"),
    "cone": ("Cone",),
    "color.spaces": ("ColorConfig", "ColorSpace", "Display"),
    "errors": ("DeviceError", "Error", "GpuMemoryError", "InputError", "ShaderError"),
    "flow": ("Flow",),
    "frame": ("Frame",),
    "gpu_frame.views": ("FrameViews",),
    "hosts.notebook": ("explore",),
    "methods": ("METHODS",),
    "observer": ("Observer",),
    "output.output": ("Output",),
    "output.result": ("Result",),
    "output.vectors": ("VectorOutput",),
    "pipeline.blur": ("Blur",),
    "pipeline.one_frame": ("blur",),
    "png": ("show",),
    "render": ("Render",),
    "run.report": ("BatchReport", "VideoReport"),
    "run.file_sink": ("BlurredFrame",),
    "run.pictures": ("PictureBlur", "blur_pictures"),
    "run.sequence": ("blur_sequence", "vectors_sequence"),
    "run.video": ("blur_video",),
    "run.stages": ("blurred",),
    "scene": ("Body", "Scene", "CameraPath"),
    "sequence.clip": ("Clip", "Passes"),
    "sequence.layers.camera_file": ("CameraFile",),
    "sequence.layers.vectors": ("Vectors",),
    "shutter": ("Shutter",),
}
_PLACE = {name: place for place, names in _PLACES.items() for name in names}

if not TYPE_CHECKING:  # a checker takes every name for known otherwise

    def __getattr__(name: str) -> object:
        """Load names on first use, so that importing wgmb itself is cheap."""
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
