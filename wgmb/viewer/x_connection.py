"""The connection to an X server, which may end at any time.

Xlib then ends the program with a line and exit code 1, when it is called next. wgpu panics with a
hundred lines, so that nothing may be drawn in between.
"""

from __future__ import annotations

import ctypes
import select
from collections.abc import Callable

import glfw


def display_watch() -> Callable[[], bool]:
    """A function that returns False once the X server has gone; always True without one."""
    try:
        if glfw.get_platform() != glfw.PLATFORM_X11:
            return lambda: True
        display = ctypes.c_void_p(glfw.get_x11_display())
        ends = select.poll()
        ends.register(ctypes.CDLL("libX11.so.6").XConnectionNumber(display), 0)  # its end alone
    except (AttributeError, OSError):  # GLFW, Python or the system knows nothing of X
        return lambda: True
    return lambda: not ends.poll(0)
