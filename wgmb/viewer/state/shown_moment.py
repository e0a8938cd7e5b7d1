"""A scene, frames or a video as the viewer has opened it, and the moment that is shown."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...scene import builtin
from ...settings import (
    BlurSettings,
    InputSettings,
    SceneSettings,
    ShutterSettings,
)
from ...settings.color import ColorSettings
from ...settings.video import VideoSettings
from .files import is_video_file

_SCENE = SceneSettings(size="1280x720", antialias=2)
_BLUR = BlurSettings(method="gather")
_SHUTTER = ShutterSettings().resolved()


@dataclass(frozen=True)
class ShownMoment:
    """A scene, frames or a video: its settings, its frames, and the moment that is shown."""

    source: str = "crossing"
    """A scene's name, or a file or pattern."""
    scene: SceneSettings = _SCENE
    """Size, parameters and camera of a scene."""
    input: InputSettings = field(default_factory=InputSettings)
    """Layers and conventions of files."""
    blur: BlurSettings = _BLUR
    """The method, which is always set, and its options."""
    shutter: ShutterSettings = _SHUTTER
    """Angle and curve are always set."""
    color: ColorSettings = field(default_factory=ColorSettings)
    video: VideoSettings = field(default_factory=VideoSettings)
    """Motion and time of a video; its encoding, which an export has."""
    frames: str = "0-11"
    """Of a video: its pictures that the output is made from."""
    frame: float = 0.0
    """The moment [frame intervals]; of a video the output frame, from 0 on."""
    fps: float = 24.0
    """Of a video: of the output, whose interval the shutter is in."""
    is_method_suited: bool = False
    """Of a video: no method is set, so that it suits the motion, as in `wgmb blur`."""
    own_times: bool = False
    """Of a video: `fps` is "source", an output frame for each picture, at its time."""

    @property
    def is_scene(self) -> bool:
        """True if `source` is a built-in scene."""
        return self.source in builtin.SCENES

    @property
    def is_video(self) -> bool:
        """True if `source` is a video."""
        return not self.is_scene and is_video_file(self.source)
