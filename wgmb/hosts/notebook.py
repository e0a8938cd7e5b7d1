"""The panel for notebooks; its widgets are loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import wgpu

from ..extras import needed_by
from ..frame import Frame

if TYPE_CHECKING:
    from .explorer import Explorer


def explore(
    frame: Frame, *, exposure: float = 0.0, device: wgpu.GPUDevice | str | None = None
) -> Explorer:
    """A panel for a notebook: the frame blurred by any method, with sliders; extra `notebook`.

    `frame`: with its neighbours (Frame.between) for the methods that use them. `exposure`
    [stops] brightens the picture. `device`: see Blur.
    """
    with needed_by("wgmb.explore"):
        from .explorer import Explorer
    return Explorer(frame, exposure=exposure, device=device)
