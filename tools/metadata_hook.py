"""Metadata that hatchling asks for: the package's links and its description, from README.md.

A package index shows README without the files beside it. With `address` in pyproject.toml, its
links lead into the repository at the tag of this version; without one, only their text stays, and
pictures are left out.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

if sys.version_info < (3, 11):  # noqa: UP036
    sys.exit("wgmb needs Python 3.11 or newer, got " + sys.version.split()[0])
import tomllib

from hatchling.metadata.plugin.interface import MetadataHookInterface

ROOT = Path(__file__).parents[1]


class CustomMetadataHook(MetadataHookInterface):
    """The hook that pyproject.toml names."""

    def update(self, metadata: dict) -> None:
        """Add `urls` and `readme`."""
        address, version = address_of(ROOT), metadata["version"]
        metadata["urls"] = urls(address, version)
        text = (ROOT / "README.md").read_text("utf-8")
        described = description(text, address, version)
        metadata["readme"] = {"content-type": "text/markdown", "text": described}


def address_of(root: Path) -> str:
    """The repository's address, as pyproject.toml has it; "" where it is not set."""
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))
    return project["tool"]["wgmb"]["address"].rstrip("/")


def urls(address: str, version: str) -> dict[str, str]:
    """The links of the package; none without an address."""
    if not address:
        return {}
    return {
        "Source": address,
        "Documentation": f"{address}/blob/v{version}/docs/index.md",
        "Changelog": f"{address}/blob/v{version}/CHANGELOG.md",
        "Issues": f"{address}/issues",
    }


def description(text: str, address: str, version: str) -> str:
    """README with links that lead somewhere from a package index."""

    def linked(match: re.Match) -> str:
        is_picture, words, target = match.groups()
        if re.match(r"[a-z]+:|#", target):
            return match[0]
        if not address:
            return "" if is_picture else words
        kind = "raw" if is_picture else "blob"
        return f"{is_picture}[{words}]({address}/{kind}/v{version}/{target})"

    text = re.sub(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)", linked, text)
    return re.sub(r"\n{3,}", "\n\n", text)
