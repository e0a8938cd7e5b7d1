"""Settings of a simulated viewer as plain values; the string under a field is its help."""

from dataclasses import dataclass

from ..cone import Cone


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

    @property
    def cone(self) -> Cone:
        """The cone cell."""
        return Cone(self.cone_rate, self.cone_peak)
