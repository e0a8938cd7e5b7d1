"""Settings of a simulated viewer as plain values; the string under a field is its help."""

from dataclasses import dataclass

from ..cone import Cone
from ..errors import InputError
from ..settings.groups import changed

_OF_SCENES = "nature", "size", "set"


@dataclass(frozen=True, kw_only=True)
class PerceptionSettings:
    """Cone cell and scene."""

    cone_rate: float = 50.0
    "Decay rate of the cone cell's impulse response, 1/s."
    cone_peak: float = 0.05
    "Peak of the cone cell's impulse response, seconds after a flash."
    nature: float = 480.0
    "Scenes: images per second that approximate continuous time."
    size: str = "640x360"
    "Scenes: width x height in pixels."
    set: tuple[str, ...] = ()
    "Scenes: parameter as NAME=VALUE; may be repeated."

    def check(self, *, of_scene: bool) -> None:
        """InputError for options of scenes, unless a scene is perceived."""
        for name in () if of_scene else changed(self):
            if name in _OF_SCENES:
                raise InputError(f"`{name}` is for scenes")

    @property
    def cone(self) -> Cone:
        """The cone cell."""
        return Cone(self.cone_rate, self.cone_peak)
