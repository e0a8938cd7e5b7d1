"""The process that blurs, seen from Blender: requests go to it, futures come back.

It runs in Blender's own Python. That it is another process is for Blender's sake: wgpu looking for
OpenGL beside Blender's window, or a second OpenEXR beside Blender's own, ends the program.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from .wgmb_worker.problem import NoAdapterError, ProblemError

_START = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from wgmb_worker.server import serve
serve()
"""
_HIDDEN = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # Windows would open a console


class Process:
    """Starts with the first request, and anew with the next one if it has ended by a fault."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "wgmb")
        self._popen: subprocess.Popen[bytes] | None = None
        self._asked: list[Future[Any]] = []
        self._is_closed = False

    def ask(self, do: str, **words: Any) -> Future[Any]:
        """Have something done after all that was asked for before; see `wgmb_worker.server`."""
        self._asked = [one for one in self._asked if not one.done()]
        self._asked.append(self._pool.submit(self._answer, {"do": do, **words}))
        return self._asked[-1]

    @property
    def is_open(self) -> bool:
        """Return True until it is closed."""
        return not self._is_closed

    @property
    def is_idle(self) -> bool:
        """Return True if all that was asked for is done."""
        return all(one.done() for one in self._asked)

    def close(self) -> None:
        """End the process, whatever it is doing."""
        self._is_closed = True
        if self._popen is not None:
            self._popen.kill()
        self._pool.shutdown(wait=True, cancel_futures=True)
        if self._popen is not None:
            self._ended(self._popen)
            self._popen = None

    def _answer(self, request: dict[str, Any]) -> Any:
        line = b""
        popen = self._popen = self._popen or self._started()
        assert popen.stdin is not None and popen.stdout is not None
        if self._is_closed:  # meanwhile, before there was something to kill
            popen.kill()
        with contextlib.suppress(OSError):  # it has ended
            popen.stdin.write(json.dumps(request).encode() + b"\n")
            popen.stdin.flush()
            line = popen.stdout.readline()
        if not line.endswith(b"\n"):
            self._popen = None
            raise ProblemError(self._ended(popen))
        told = json.loads(line)
        if "fault" in told:
            raise RuntimeError(told["fault"])
        if "error" in told:
            raise (NoAdapterError if told["error"] == "adapter" else ProblemError)(told["text"])
        return told["result"]

    def _started(self) -> subprocess.Popen[bytes]:
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115
        here = Path.cwd()  # where files of strangers may lie
        path = [folder for folder in sys.path if folder and Path(folder).resolve() != here]
        path.append(str(Path(__file__).parent))
        words = [sys.executable, "-I", "-c", _START, json.dumps(path)]
        # Without a runtime folder, drivers would complain among the errors.
        folder = os.environ.get("XDG_RUNTIME_DIR") or os.devnull
        try:
            return subprocess.Popen(
                words,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=os.environ | {"XDG_RUNTIME_DIR": folder},
                creationflags=_HIDDEN,
            )
        except OSError as error:
            raise ProblemError(f"Cannot start Blender's Python {sys.executable}: {error}") from None

    def _ended(self, popen: subprocess.Popen[bytes]) -> str:
        """Clean up after a process that ended; returns how it did."""
        code = popen.wait()
        for pipe in (popen.stdin, popen.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
        self._errors.seek(0)
        last = self._errors.read().decode(errors="replace").strip().rpartition("\n")[2]
        self._errors.close()
        return f"The process that blurs ended (code {code})" + (f": {last}" if last else "")


_kept: list[Process] = []


@contextlib.contextmanager
def lent() -> Iterator[Process]:
    """The process for a while; it is kept for the next one, unless it is still at work then."""
    process = _kept.pop() if _kept else Process()
    try:
        yield process
    finally:
        if process.is_open and process.is_idle:
            process.ask("rest")
            _kept.append(process)
        else:
            process.close()


def end_kept() -> None:
    """End the process that is kept."""
    while _kept:
        _kept.pop().close()
