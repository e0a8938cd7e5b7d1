"""A request of the window, and the answer: images, and all that can be chosen."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...color.spaces import Display
from ...methods.options import Option
from ..state.state import State
from .composer import NOTHING, Image
from .frame_status import FrameStatus
from .place import Box


@dataclass(frozen=True)
class Request:
    """A state that is to be shown in an area [px] of the canvas."""

    state: State
    area: Box
    moving: bool = False
    """Quick is better than fine."""
    full: bool = False
    """Everything at once, however long it takes."""

    @property
    def picture(self) -> tuple[Any, ...]:
        """All that the images depend on."""
        state = self.state
        return (
            state.picture,
            self.area,
            state.look,
            state.mode,
            state.against,
            state.eyes,
            state.kept,
        )


@dataclass(frozen=True)
class Available:
    """Choices that there are for a state, by name."""

    methods: list[str]
    looks: list[str]
    eyes: list[str]
    rivals: list[str]
    options: dict[str, Option]
    finding: str = ""
    layers: dict[str, str] = field(default_factory=dict)
    """Of frames on disk: names in their files, by "picture" and "depth"."""
    display: Display | None = None


@dataclass
class Drawn:
    """The answer to a request."""

    request: Request
    state: State
    """The request's own, as far as it is possible here."""
    report: FrameStatus
    available: Available
    images: dict[str, Image]
    """By slot; colours as their display shows them, or linear light."""
    under: dict[str, np.ndarray] = field(default_factory=dict)
    """Images for numbers or arrows, if these are shown, (height, width, channels): "light" of the
    first image, and "depth", "motion" (px) and "confidence" where there are such."""
    chromaticities: dict[str, Any] = field(default_factory=dict)
    """Of the picture shown, as an attribute of an EXR."""

    def sides(self, flicked: bool) -> tuple[Image, Image]:
        """The images of both sides; `flicked`: the second one for both, once it is there."""
        first, second = self.images["first"], self.images.get("second", NOTHING)
        return (second if flicked and second != NOTHING else first), second

    def corrected(self, state: State) -> State:
        """A state, with impossible settings replaced as in `self.state`."""
        asked, found = self.request.state, self.state
        if asked.method == state.method != found.method:
            is_suited = state.is_method_suited
            state = replace(state.with_method(found.method), is_method_suited=is_suited)
        for name in ("look", "eyes", "against"):
            if getattr(asked, name) == getattr(state, name):
                state = replace(state, **{name: getattr(found, name)})
        return state
