"""`wgmb` on a disk that does not answer: `python -m hanging FLAG NAME blur ...`.

Once the file FLAG exists, whoever opens a file with NAME in its path waits for ever, with every
signal pending, as in a call of the system.
"""

import ctypes
import os
import sys

from wgmb.__main__ import main


def wait_for_ever() -> None:
    """Lock a mutex twice: Python's lock is let go of, and no signal ends it."""
    library, mutex = ctypes.CDLL(None), ctypes.create_string_buffer(256)
    for _ in range(2):
        library.pthread_mutex_lock(mutex)


def hang_at(flag: str, name: str) -> None:
    """Have opening such a file wait."""

    def hook(event: str, given: tuple) -> None:
        if event == "open" and name in str(given[0]) and os.path.exists(flag):
            wait_for_ever()

    sys.addaudithook(hook)


if __name__ == "__main__":
    hang_at(*sys.argv[1:3])
    main(sys.argv[3:])
