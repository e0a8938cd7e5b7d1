"""Names of pipes: the standard streams, which a command line calls `-`, and named pipes."""

from __future__ import annotations

import os
import stat

STDIN, STDOUT = "/dev/stdin", "/dev/stdout"


def is_pipe(name: str) -> bool:
    """Return True for the standard streams and for a named pipe."""
    try:
        return name in (STDIN, STDOUT) or stat.S_ISFIFO(os.stat(name).st_mode)
    except (OSError, ValueError):
        return False
