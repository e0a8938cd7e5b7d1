"""Contents of the panel beside the State."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..draw.frame_status import FrameStatus
from ..draw.request import Available


@dataclass
class Info:
    """Contents of the panel: status, measurements and available choices."""

    report: FrameStatus
    adapter: str
    available: Available
    frame_times: np.ndarray  # seconds, the last one last
    draw_times: np.ndarray
    passes: dict[str, float] = field(default_factory=dict)
    frame: str = ""
    """The output frame of a video that is on the canvas, in words; the state may be ahead of it."""
    recording: str = ""
    export: str = ""
    message: str = ""
    recent: list[str] = field(default_factory=list)
    """Files that were looked at before."""
