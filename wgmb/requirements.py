"""Requirements of an extra that apply here, by the metadata of the installed wgmb."""

from __future__ import annotations

from importlib import metadata

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name
from packaging.version import InvalidVersion


def version_of(name: str) -> str | None:
    """The version of an installed package by its name in the index; None if it is missing."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def of_extra(extra: str) -> dict[str, Requirement]:
    """Requirements of an extra of wgmb and of the extras within it, by the name of the package.

    Those that the markers exclude on this system and Python are left out; ranges of one package
    are joined. Empty where the metadata of wgmb is missing, as in a frozen program, or knows no
    such extra.
    """
    requirements = _listed()
    joined: dict[str, Requirement] = {}
    extras = [extra]
    for of in extras:  # it grows by the extras within
        for one in requirements:
            if not _applies(one, of):
                continue
            name = canonicalize_name(one.name)
            if name == "wgmb":
                extras += [inner for inner in sorted(one.extras) if inner not in extras]
            elif name in joined:
                joined[name].specifier &= one.specifier
            else:
                joined[name] = one
    return joined


def is_excluded(name: str, extra: str) -> bool:
    """True if the markers of a package of an extra exclude this system or Python."""
    own = [one for one in _listed() if canonicalize_name(one.name) == name]
    return bool(own) and not any(_applies(one, extra) for one in own)


def _listed() -> list[Requirement]:
    """All requirements in the metadata of wgmb."""
    try:
        return [Requirement(line) for line in metadata.requires("wgmb") or []]
    except (metadata.PackageNotFoundError, InvalidRequirement):
        return []


def _applies(requirement: Requirement, extra: str) -> bool:
    """True if it belongs to the extra alone, and this system and Python need it."""
    marker = requirement.marker
    return marker is not None and not marker.evaluate() and marker.evaluate({"extra": extra})


def line(requirement: Requirement) -> str:
    """The name and the versions, as pip reads them; the marker is known to hold."""
    return f"{requirement.name}{requirement.specifier}"


def is_met(requirement: Requirement) -> bool:
    """True if a version that will do is installed."""
    version = version_of(requirement.name)
    try:
        return version is not None and requirement.specifier.contains(version, prereleases=True)
    except InvalidVersion:
        return False
