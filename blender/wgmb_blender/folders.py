"""Folders and files: may they be written, and how they come into place whole."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from .wgmb_worker.problem import ProblemError


def check_folder(folder: Path) -> None:
    """Make a folder; ProblemError unless files can be written into it."""
    with _told(f"write into {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(prefix=".wgmb_", dir=folder):
            pass


def remove(files: Sequence[Path]) -> None:
    """Remove files, if they are there."""
    for path in files:
        path.unlink(missing_ok=True)


def put_in_place(file: Path, path: Path) -> None:
    """Move a file to its place, on another disk too, so that it is there whole or not at all."""
    with _told(f"write {path}"):
        path.parent.mkdir(parents=True, exist_ok=True)
        # A new file with a name of its own: never one, or a link, that lies there already.
        with tempfile.NamedTemporaryFile(
            prefix=f".{path.name}.", suffix=".part", dir=path.parent, delete=False
        ) as beside:
            try:
                with file.open("rb") as source:
                    shutil.copyfileobj(source, beside)
                beside.close()
                shutil.copymode(file, beside.name)
                os.replace(beside.name, path)
            finally:
                Path(beside.name).unlink(missing_ok=True)
        file.unlink()


@contextlib.contextmanager
def _told(what: str):
    try:
        yield
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise ProblemError(f"Cannot {what}: {why}") from None
