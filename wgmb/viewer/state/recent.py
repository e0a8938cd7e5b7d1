"""Files that were looked at last, kept for the next time where the system has such things."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from pathlib import Path

from ...io.atomic import write_file

_MOST = 8


class RecentFiles:
    """Patterns and videos, the last one first; in a file that may be deleted at any time."""

    def __init__(self, path: Path):
        self._path = path
        self.sources = _read(path)

    def add(self, source: str) -> None:
        """Note a file or pattern that is shown; names that cannot be written are left out."""
        whole = os.path.abspath(source)
        if self.sources[:1] == [whole]:
            return
        self.sources = [whole, *(one for one in self.sources if one != whole)][:_MOST]
        with suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            text = json.dumps(self.sources, indent=1)
            write_file(self._path, text.encode(), mode=0o600)


def default_path() -> Path:
    """The file where the system keeps such things."""
    home = Path.home()
    if sys.platform == "win32":
        folder = Path(os.environ.get("LOCALAPPDATA") or home / "AppData/Local")
    elif sys.platform == "darwin":
        folder = home / "Library/Application Support"
    else:
        folder = Path(os.environ.get("XDG_STATE_HOME") or home / ".local/state")
    return folder / "wgmb" / "recent.json"


def _read(path: Path) -> list[str]:
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return []
    whole = isinstance(found, list) and all(isinstance(one, str) for one in found)
    return found[:_MOST] if whole else []
