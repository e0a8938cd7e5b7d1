"""The Python that runs wgmb's commands, and every other one that it starts.

None of them imports a module from the current folder, where files of strangers lie. This module
imports only modules that are found before a folder is searched.
"""

import os
import sys

TYPE_CHECKING = False  # typing's own is not loaded here
if TYPE_CHECKING:
    import signal
    from collections.abc import Callable

_ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))


def command(*words: str) -> list[str]:
    """The command line of another Python, which is started with `environment`."""
    return [sys.executable, "-P", *words]


def environment() -> dict[str, str]:
    """This process's environment for another Python, and for those that it starts in turn."""
    found = os.environ | {"PYTHONSAFEPATH": "1"}
    folders = found.pop("PYTHONPATH", "").split(os.pathsep)
    if kept := [folder for folder in folders if not is_current(folder)]:
        found["PYTHONPATH"] = os.pathsep.join(kept)
    return found


def leave_current_folder() -> None:
    """Import nothing more from the current folder, here and in any other Python.

    `python -m` puts it first on the path, and so does an empty entry of PYTHONPATH.
    """
    sys.path[:] = [folder for folder in sys.path if not is_current(folder)]
    kept = environment()
    if "PYTHONPATH" not in kept:
        os.environ.pop("PYTHONPATH", None)
    os.environ.update(kept)


def name_runtime_folder() -> None:
    """Name a runtime folder where the environment names none: Wayland's library, which drivers
    load, complains on stderr otherwise.

    It is no folder, so nobody can offer a display there. A program calls this before it starts a
    thread: the environment is the whole process's, and a library that changes it may end its host.
    """
    if sys.platform == "linux" and not os.environ.get("XDG_RUNTIME_DIR"):
        os.environ["XDG_RUNTIME_DIR"] = os.devnull


def is_current(folder: str) -> bool:
    """Return True for the current folder, unless wgmb itself is installed there."""
    try:
        place = os.path.realpath(folder)  # of an empty name, the current folder
        return place == os.path.realpath(os.curdir) != _ROOT
    except OSError:  # it was removed
        return not folder


def handle_signals(handler: "Callable[..., object] | int") -> None:
    """Set the handler of the signals that end a program.

    They are Ctrl-C, SIGTERM, and SIGHUP, as a terminal sends that is closed. SIGHUP stays ignored
    where nohup has it ignored; SIGINT does not, as a shell has background processes ignore it.
    ValueError on any but the main thread.
    """
    import signal  # by now, it is not searched for in the current folder

    for number in ending_signals():
        is_kept = number.name == "SIGHUP" and signal.getsignal(number) == signal.SIG_IGN
        if not is_kept:
            signal.signal(number, handler)


def ending_signals() -> "list[signal.Signals]":
    """The signals that end a program; Windows has no SIGHUP."""
    import signal

    names = "SIGINT", "SIGTERM", "SIGHUP"
    return [signal.Signals[name] for name in names if name in signal.Signals.__members__]
