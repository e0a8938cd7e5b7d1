"""The site holds together: links within it lead somewhere, nothing is loaded from a network.

Checked on the HTML as it was written, so that it also holds for what the theme adds.
"""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_LOADED = {"script", "img", "source", "video", "audio", "iframe", "embed", "object", "track"}


class Page(HTMLParser):
    """Targets, links and loaded files of one page of the site."""

    def __init__(self, text: str):
        super().__init__()
        self.anchors: set[str] = set()
        self.links: set[str] = set()
        self.loads: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the address or the anchor of one tag."""
        given = {name: value or "" for name, value in attrs}
        self.anchors.update(given[name] for name in ("id", "name") if name in given)
        for name in ("href", "src", "srcset", "data"):
            if name in given:
                loaded = tag in _LOADED or (tag == "link" and given.get("rel") != "canonical")
                (self.loads if loaded else self.links).add(given[name])


def faults(folder: Path) -> list[str]:
    """One line for everything that leads nowhere or would be loaded from a network."""
    found = []
    pages = {path: Page(path.read_text("utf-8")) for path in sorted(folder.rglob("*.html"))}
    for path, page in pages.items():
        name = path.relative_to(folder)
        found += [f"{name} loads {url}" for url in sorted(page.loads) if _is_remote(url)]
        for url in sorted(page.links | page.loads):
            parts = urlsplit(url)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                found.append(f"{name} links to {url}, which is not there")
            elif parts.fragment and target in pages and not _has(pages[target], parts.fragment):
                found.append(f"{name} links to {url}, where there is no such place")
    for path in sorted(folder.rglob("*.css")):
        remote = re.findall(
            r"""(?:url\(|@import)\s*["']?((?:https?:)?//[^)"']*)""", path.read_text("utf-8")
        )
        found += [f"{path.relative_to(folder)} loads {url}" for url in remote]
    return found


def _is_remote(url: str) -> bool:
    return urlsplit(url).scheme in ("http", "https") or url.startswith("//")


def _has(page: Page, fragment: str) -> bool:
    return unquote(fragment) in page.anchors


def _check(app: Sphinx, exception: Exception | None) -> None:
    from sphinx.errors import SphinxError  # here, as tests of the above need no Sphinx

    if exception is None and app.builder.name == "html" and (found := faults(Path(app.outdir))):
        raise SphinxError("\n".join(("the site does not hold together:", *found)))


def setup(app: Sphinx) -> dict:
    """Called by Sphinx."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
