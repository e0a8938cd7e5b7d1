"""Frames as arrays, and image files as their destination."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..output.output import Output
from ..output.result import Result


@dataclass
class BlurredFrame:
    """One frame of `blurred`."""

    number: int
    views: list[Result] = field(default_factory=list)
    """A Result for every view, the default one first."""
    made_of: dict[str, Any] = field(default_factory=dict)
    """Files and facts on which it depends (see Clip.made_of), for Output.write_views."""
    failed: str = ""
    """The reason why it could not be read or blurred; then it has no views."""
    bad: dict[str, int] = field(default_factory=dict)
    """Pixels that are not finite, by input."""


class FileSink:
    """Frames into an Output: image files, or a video of rendered frames."""

    def __init__(self, output: Output):
        self._output, self.is_whole = output, output.is_video
        self.done, self.why_hopeless = output.done, output.why_hopeless
        self.close, self.abandon = output.close, output.abandon

    def put(self, frame: BlurredFrame) -> None:
        """Write a frame."""
        self._output.write_views(frame.views, frame.made_of)
