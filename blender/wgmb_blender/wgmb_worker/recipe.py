"""The recipe of a blur, as plain data that one process can hand to another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .problem import ProblemError

COMPOSITE = "Composite"
MATTE = "use_pass_cryptomatte_object", "CryptoObject"


@dataclass(frozen=True)
class View:
    """One eye of a stereo picture; without a name, the only one."""

    name: str = ""
    suffix: str = ""


@dataclass(frozen=True)
class SharpFrames:
    """The files: `stem` and a number, then the suffix of the view."""

    stem: str

    def pattern(self, view: View = View()) -> str:
        """The files of a view, with the number left open."""
        return f"{self.stem}####{view.suffix}.exr"

    def path(self, number: int, view: View = View()) -> Path:
        """The file of a frame."""
        return Path(f"{self.stem}{number:04d}{view.suffix}.exr")


@dataclass(frozen=True)
class Picture:
    """`size`: of the whole picture; `part`: left, top, right, bottom of what is rendered of it.

    `margin`: pixels rendered around the part and cut off after the blur. `is_cropped`: the
    result is the part alone, otherwise it lies in the whole picture, with nothing around it.
    """

    size: tuple[int, int]
    part: tuple[int, int, int, int]
    margin: int = 0
    is_cropped: bool = False

    @property
    def rendered(self) -> tuple[int, int]:
        """Width and height of a sharp frame."""
        left, top, right, bottom = self.part
        return right - left + 2 * self.margin, bottom - top + 2 * self.margin

    @property
    def result(self) -> tuple[int, int]:
        """Width and height of a blurred frame."""
        left, top, right, bottom = self.part
        return (right - left, bottom - top) if self.is_cropped else self.size

    def laid(self, plane: np.ndarray) -> np.ndarray:
        """Return the part of a sharp frame's (height, width, ...) array that the result shows."""
        width, height = self.rendered
        if plane.shape[:2] != (height, width):
            raise ProblemError(
                f"a sharp frame must be {width} x {height} pixels with these settings, got "
                f"{plane.shape[1]} x {plane.shape[0]}: was it rendered with others?"
            )
        inside = plane[self.margin : height - self.margin, self.margin : width - self.margin]
        if self.result == inside.shape[1::-1]:
            return inside
        whole = np.zeros((*self.size[::-1], *plane.shape[2:]), plane.dtype)
        left, top, right, bottom = self.part
        whole[top:bottom, left:right] = inside
        return whole


@dataclass(frozen=True)
class Exposure:
    """A wgmb.Shutter in plain data.

    `middle` and `rolling_duration` are in frame intervals; `curve`: values at equal times, or
    None, a box.
    """

    degrees: float
    middle: float = 0.0
    curve: tuple[float, ...] | None = None
    rolling: str | None = None
    rolling_duration: float = 0.0


@dataclass(frozen=True)
class Setup:
    """The blur: `samples` is a number or "auto", `device` a part of an adapter's name.

    `shading`: "auto" follows light by the passes that the frames have, "off" does not.
    """

    method: str
    exposure: Exposure
    samples: int | str
    device: str | None
    shading: str = "auto"


@dataclass(frozen=True)
class Recipe:
    """The subject of the blur. `layers`: the view layers, or the composite, whose pictures are.

    `rendered`: frames that may be neighbours; None: all on disk. `kept`: names of objects that
    stay sharp. `folder`: for the blurred files, which are `is_whole` if they have all passes.
    """

    sharp: SharpFrames
    views: Sequence[View]
    layers: Sequence[str]
    frames: Sequence[int]
    rendered: Sequence[int] | None
    picture: Picture
    cuts: Sequence[int]
    kept: Sequence[str]
    folder: str
    is_whole: bool

    def file(self, number: int, view: View) -> Path:
        """The blurred file of a frame."""
        return Path(self.folder) / f"blurred_{number:06d}{view.suffix}.exr"


def told(one: Setup | Recipe | Picture) -> dict[str, Any]:
    """Any of these as JSON has it."""
    return asdict(one)


def setup_of(told: dict[str, Any]) -> Setup:
    """The Setup that was told."""
    words = {**told, "exposure": Exposure(**told["exposure"])}
    return Setup(**words)


def recipe_of(told: dict[str, Any]) -> Recipe:
    """The Recipe that was told."""
    words = {
        **told,
        "sharp": SharpFrames(**told["sharp"]),
        "views": [View(**view) for view in told["views"]],
        "picture": picture_told(told["picture"]),
    }
    return Recipe(**words)


def picture_told(told: dict[str, Any]) -> Picture:
    """The Picture that was told."""
    words = {**told, "size": tuple(told["size"]), "part": tuple(told["part"])}
    return Picture(**words)
