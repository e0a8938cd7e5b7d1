"""The part of a lock that some extras need, for `pip install --require-hashes --no-deps`.

python tools/locked.py NAME...

A NAME is an extra of pyproject.toml, "core" (what wgmb itself needs), or a package. The lock is
constraints.txt, or the file that comes before the names: `--lock FILE`. In it stand all files of
all packages with their hashes, and under each package those that need it, as `uv pip compile`
writes them.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "constraints.txt"
_ENTRY = re.compile(r"^(?=[A-Za-z0-9])", re.M)
_NAME = re.compile(r"[A-Za-z0-9._-]+")
_VIA = re.compile(r"^    # (?:via)?\s*([A-Za-z0-9._-]+)$", re.M)


@dataclass(frozen=True)
class Entry:
    """A package of a lock: one for each version that the lock has of it."""

    name: str
    via: frozenset[str]
    """Packages that need it."""
    text: str
    """Its lines, with the hashes."""


def entries(lock: Path = LOCK) -> list[Entry]:
    """All packages of a lock."""
    parts = _ENTRY.split(lock.read_text("utf-8"))
    return [
        Entry(_plain(part), frozenset(map(_plain, _VIA.findall(part))), part)
        for part in parts
        if _NAME.match(part)
    ]


def needed(names: Iterable[str], found: list[Entry]) -> list[Entry]:
    """The entries that extras or packages need; SystemExit for a name that is neither."""
    wanted = {package for name in names for package in _direct(name)}
    if unknown := wanted - {entry.name for entry in found}:
        sys.exit(f"neither an extra nor a package of the lock: {', '.join(sorted(unknown))}")
    while more := {e.name for e in found if e.via & wanted} - wanted:
        wanted |= more
    return [entry for entry in found if entry.name in wanted]


def _direct(name: str) -> Iterator[str]:
    """The packages that an extra lists; or `name` itself."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"] | {"core": project["dependencies"]}
    if name not in extras:
        yield _plain(name)
    for line in extras.get(name, []):
        if own := re.match(r"wgmb\[(.*)\]", line):
            for extra in own[1].split(","):
                yield from _direct(extra.strip())
        else:
            yield _plain(line)


def _plain(line: str) -> str:
    """The name that a line begins with, as package indexes compare it."""
    found = _NAME.match(line)
    assert found, line
    return re.sub(r"[-_.]+", "-", found[0]).lower()


if __name__ == "__main__":
    words = sys.argv[1:]
    file = LOCK
    if words[:1] == ["--lock"]:
        file, words = Path(words[1]), words[2:]
    print("".join(entry.text for entry in needed(words, entries(file))), end="")
