"""Requirements of an extra: those that the metadata of the installed wgmb lists, and which are met.

`packaging` does the whole of this, and is not among the packages of the core. A requirement
that is not understood here counts as not met, so that pip judges it.
"""

from __future__ import annotations

import operator
import re
import sys
from collections.abc import Iterable
from importlib import metadata
from itertools import zip_longest
from typing import NamedTuple

_LINE = re.compile(r"([\w.-]+)\s*(?:\[([^]]*)\])?\s*\(?([^;()]*)\)?\s*(?:;\s*(.*))?")
_OF_EXTRA = re.compile(r"""\s*(?:\band\s+)?\bextra\s*==\s*['"]([\w.-]+)['"]""")
_PYTHON = re.compile(r'\bpython_version\s*([<>=!]=|[<>])\s*"([\d.]+)"')
_OPERATORS = {
    ">=": operator.ge, "<=": operator.le, "==": operator.eq, "!=": operator.ne,
    ">": operator.gt, "<": operator.lt,
}  # fmt: skip


class Requirement(NamedTuple):
    """A package and the versions that will do, such as `av` and `<19,>=18.1`."""

    name: str
    "The name in the package index."
    versions: str = ""
    "Conditions with commas between them; empty: any version."
    marker: str = ""
    "The systems and Pythons that need it, which pip evaluates; empty: all."

    @property
    def is_for_this_python(self) -> bool:
        """False if the marker excludes the Python that runs; other conditions are pip's."""
        limits = _PYTHON.findall(self.marker)
        here = ".".join(map(str, sys.version_info[:2]))
        return " or " in self.marker or all(_holds(here, sign + limit) for sign, limit in limits)

    def __str__(self) -> str:
        """As pip reads it, without a marker that is known to hold."""
        rest = _PYTHON.sub("", self.marker).replace(" and ", " ").strip(" ()")
        marker = self.marker if rest or not self.is_for_this_python else ""
        return f"{self.name}{self.versions}" + (f"; {marker}" if marker else "")

    @property
    def is_met(self) -> bool:
        """True if a version that will do is installed."""
        version = version_of(self.name)
        return version is not None and all(
            _holds(version, condition) for condition in self.versions.split(",") if condition
        )


def version_of(name: str) -> str | None:
    """The version of an installed package by its name in the index; None if it is missing."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def of_extra(extra: str) -> list[Requirement]:
    """Requirements of an extra of wgmb and of the extras within it, one for each package.

    Empty where the metadata of wgmb is missing, as in a frozen program, or knows no such extra.
    """
    try:
        lines = metadata.requires("wgmb") or []
    except metadata.PackageNotFoundError:
        return []
    found: dict[tuple[str, str], Requirement] = {}
    for one in _of_extra(extra, lines, set()):
        same = found.setdefault((one.name.lower(), one.marker), one)
        parts = [*same.versions.split(","), *one.versions.split(",")]
        versions = ",".join(_narrowed(dict.fromkeys(part for part in parts if part)))
        found[one.name.lower(), one.marker] = same._replace(versions=versions)
    return list(found.values())


def _of_extra(extra: str, lines: list[str], visited: set[str]) -> list[Requirement]:
    visited.add(extra)
    found = []
    for line in lines:
        part = _LINE.fullmatch(line)
        if not part or not (of := _OF_EXTRA.search(part[4] or "")) or of[1] != extra:
            continue
        marker = _OF_EXTRA.sub("", part[4]).strip().replace("'", '"')
        if part[1].lower() != "wgmb":
            found.append(Requirement(part[1], part[3].replace(" ", ""), marker))
            continue
        for inner in re.findall(r"[\w.-]+", part[2] or ""):
            if inner not in visited:
                found += _of_extra(inner, lines, visited)
    return found


def _narrowed(conditions: Iterable[str]) -> list[str]:
    """Conditions without each `>=` and `<` that another one of them implies, `>=` first."""
    kept = list(conditions)
    for sign, strictest in ((">=", -1), ("<", 0)):
        alike = [part for part in kept if re.fullmatch(rf"{sign}\s*\d+(?:\.\d+)*", part)]
        if len(alike) > 1:
            alike.sort(key=lambda part: _numbers(part.removeprefix(sign).strip()))
            kept = [part for part in kept if part not in alike or part == alike[strictest]]
    return sorted(kept, key=lambda part: not part.startswith(">"))


def _holds(version: str, condition: str) -> bool:
    """Compare the numbers of releases, without the letters of early versions."""
    part = re.fullmatch(r"([<>=!]=|[<>])\s*(\d+(?:\.\d+)*)", condition.strip())
    release = re.match(r"\d+(?:\.\d+)*", version)
    if not part or not release:
        return False
    pairs = zip_longest(_numbers(release[0]), _numbers(part[2]), fillvalue=0)
    have, want = zip(*pairs, strict=True)
    return _OPERATORS[part[1]](have, want)


def _numbers(release: str) -> list[int]:
    return [int(number) for number in release.split(".")]
