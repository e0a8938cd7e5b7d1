"""The settings in the record of a result, by which later runs compare it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .._version import __version__


def plain(settings: object) -> dict[str, Any]:
    """A group of settings by name, as JSON can hold them."""
    return {k: str(v) if isinstance(v, Path) else v for k, v in vars(settings).items()}


def record(*groups: object, **more: object) -> dict[str, Any]:
    """The settings on which the contents of a file depend, and the version of wgmb.

    Of a group with a property `looks`, these are its looks, of others all. `more`: facts that are
    in no group, or say more than its field.
    """
    found: dict[str, Any] = {"wgmb": __version__}
    for group in groups:
        found |= group.looks if hasattr(group, "looks") else plain(group)  # pyright: ignore
    return found | more
