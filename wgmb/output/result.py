"""A result on its way to a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..sequence.data_windows import Placement, Window, laid, result_window
from ..sequence.frame_file import FrameFile


@dataclass(frozen=True, eq=False)
class Result:
    """One view of a frame, to be written."""

    source: FrameFile
    """The frame as stored, whose other layers and attributes an EXR keeps."""
    picture: NDArray[np.float32]
    """(height, width, 3 or 4) float32, linear, premultiplied alpha."""
    confidence: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    """(height, width) float32, by the names of `Blur.confidence`; empty without confidence."""
    placement: Placement | None = None
    """Position of the picture; None: it fills the source's data window."""
    is_converted: bool = False
    """True at another rate: the time code and the rate of the source do not apply."""

    @property
    def canvas(self) -> Window:
        """The window that the picture fills."""
        if self.placement is not None:
            return self.placement.canvas
        if self.source.part is not None:
            return self.source.part.data_window
        return 0, 0, self.picture.shape[1] - 1, self.picture.shape[0] - 1

    @property
    def window(self) -> Window:
        """The source's data window, grown as far as the picture needs."""
        if self.placement is None or self.canvas == self.source.data_window:
            return self.canvas
        return result_window(self.picture, self.placement, self.source.data_window)

    @property
    def displayed(self) -> np.ndarray:
        """The picture, cropped or padded to the display window."""
        if self.placement is None:
            return self.picture
        return laid(self.picture, self.canvas, self.source.display_window)
