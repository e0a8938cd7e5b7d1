# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion Blur (wgmb): motion blur for rendered frames, on any GPU, after rendering."""

from __future__ import annotations

import bpy

from . import command, operators, panel, preview, process, settings

_PARTS = (settings, operators, panel, preview, command)


def register() -> None:
    """Add the panel, the operators, the settings and the command."""
    if hasattr(bpy.types.Scene, "wgmb"):
        raise RuntimeError(
            "Motion Blur (wgmb) is enabled already, from another place: disable that one first"
        )
    done = []
    try:
        for part in _PARTS:
            part.register()
            done.append(part)
    except BaseException:
        for part in reversed(done):
            part.unregister()
        raise


def unregister() -> None:
    """Remove all that `register` added."""
    for part in reversed(_PARTS):
        part.unregister()
    process.end_kept()
