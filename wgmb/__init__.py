"""wgmb: motion blur on the GPU.

frames on disk ─ sequence ─┐
arrays you have ─ Frame ───┼─ velocity ── one method of blur/ ── array | sequence ─ files
your own wgpu textures ────┤                  │
Scene ── gbuffer ──────────┘                  │
Shutter ── times of the samples ──────────────┘

`blur` is one frame at once, `Blur` the same kept for many frames or for your own encoder.
"""

__version__ = "0.1.0"

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
