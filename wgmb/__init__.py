"""wgmb: motion blur on the GPU.

frames on disk ── io ─────────┐
arrays you have ── Frame ─────┼─ velocity ── one of methods/ ── array | batch ── io ── files
your own textures ─ FrameViews┤                   │
Scene ── scene/gbuffer ───────┘                   │
Shutter ── times of the samples ──────────────────┘

`blur` blurs a single frame; `Blur` is compiled once, for many frames or your own encoder.
"""

from ._version import __version__ as __version__

TYPE_CHECKING = False  # typing's own, without the time that loading it takes
if TYPE_CHECKING:
    from .batch import blur_sequence, vectors_sequence
    from .batch_report import BatchReport
    from .camera import Camera, Reprojections
    from .cone import Cone
    from .display import ColorConfig, ColorSpace, Display
    from .errors import DeviceError, Error, GpuMemoryError, InputError, ShaderError
    from .flow import Flow
    from .frame import Frame
    from .frame_views import FrameViews
    from .hosts.notebook import explore
    from .io.camera_file import CameraFile
    from .io.clip import Clip, Passes
    from .io.output import Output
    from .io.result import Result
    from .io.vector_output import VectorOutput
    from .io.vectors import Vectors
    from .methods import METHODS
    from .observer import Observer
    from .one_frame import blur
    from .pipeline import Blur
    from .render import Render
    from .scene import Body, CameraPath, Scene
    from .shown import show
    from .shutter import Shutter
    from .stages import BlurredFrame, blurred

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
    "Render",
    "Reprojections",
    "Result",
    "Scene",
    "ShaderError",
    "Shutter",
    "VectorOutput",
    "Vectors",
    "blur",
    "blur_sequence",
    "blurred",
    "explore",
    "show",
    "vectors_sequence",
]

_PLACES = {
    "batch": ("blur_sequence", "vectors_sequence"),
    "batch_report": ("BatchReport",),
    "camera": ("Camera", "Reprojections"),
    "cone": ("Cone",),
    "display": ("ColorConfig", "ColorSpace", "Display"),
    "errors": ("DeviceError", "Error", "GpuMemoryError", "InputError", "ShaderError"),
    "flow": ("Flow",),
    "frame": ("Frame",),
    "frame_views": ("FrameViews",),
    "hosts.notebook": ("explore",),
    "io.camera_file": ("CameraFile",),
    "io.clip": ("Clip", "Passes"),
    "io.output": ("Output",),
    "io.result": ("Result",),
    "io.vector_output": ("VectorOutput",),
    "io.vectors": ("Vectors",),
    "methods": ("METHODS",),
    "observer": ("Observer",),
    "one_frame": ("blur",),
    "pipeline": ("Blur",),
    "render": ("Render",),
    "scene": ("Body", "Scene", "CameraPath"),
    "shown": ("show",),
    "shutter": ("Shutter",),
    "stages": ("BlurredFrame", "blurred"),
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
