"""Settings of a scene to render."""

import math
import re
from dataclasses import dataclass

from ..errors import InputError
from ..io.frame_numbers import frame_numbers
from ..scene import builtin
from ..scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class SceneSettings:
    """Times, image size, parameters and camera of a scene."""

    time: float | None = None
    "Time of a single image in seconds, without --frames."
    frames: str | None = None
    "Frames such as 0-99; frame N is at N / fps seconds."
    size: str = "640x360"
    "Width x height in pixels."
    antialias: int = 3
    "Antialiasing of the sharp frames that image methods start from: rays per pixel side, 1 to 8."
    set: tuple[str, ...] = ()
    "Scene parameter as NAME=VALUE; may be repeated."
    orbit: tuple[float, float] = (0.0, 0.0)
    "Orbits the camera around its pivot: degrees to the right, and up."
    pan: tuple[float, float] = (0.0, 0.0)
    "Then moves the camera to the right, and up [scene units]."
    dolly: float = 1.0
    "Scales the camera's distance to the pivot."

    def make(self, name: str) -> Scene:
        """The scene `name` with these parameters and this camera."""
        scene = builtin.make(name, **self.parameters())
        if (self.orbit, self.pan, self.dolly) == ((0.0, 0.0), (0.0, 0.0), 1.0):
            return scene
        aside, up = map(math.radians, self.orbit)
        return scene.seen_from((aside, up), self.pan, self.dolly)

    def parameters(self) -> dict[str, str]:
        """The scene's parameters by name."""
        return parameters_of(self.set)

    def moments(self, fps: float) -> dict[int, float]:
        """Times in seconds by frame number."""
        if self.frames is None:
            return {0: self.time or 0.0}
        return {n: n / fps for n in frame_numbers(self.frames)}


def size_of(text: str) -> tuple[int, int]:
    """`1920x1080` -> width, height."""
    sides = re.fullmatch(r"0*([1-9][0-9]{0,8})x0*([1-9][0-9]{0,8})", text)
    if sides is None:
        raise InputError(f"`size` must be like 1920x1080, got {text!r}")
    return int(sides[1]), int(sides[2])


def parameters_of(texts: tuple[str, ...]) -> dict[str, str]:
    """`NAME=VALUE` each -> values by name."""
    pairs = [text.partition("=") for text in texts]
    if wrong := [name for name, equals, _ in pairs if not equals]:
        raise InputError(f"`set` takes NAME=VALUE, got {wrong[0]!r}")
    return {name: value for name, _, value in pairs}
