"""The pages as the site's builder reads them: formulas, tables of contents, places within pages.

Building the site takes minutes and packages of its own; these faults are found in seconds.
"""

import fnmatch
import json
import re
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import pytest
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin

pytestmark = pytest.mark.fast

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MARKDOWN = MarkdownIt("commonmark").enable("table").use(dollarmath_plugin)
DEEPEST = 3  # headings that can be linked to: myst_heading_anchors of docs/conf.py


def text_of(path: Path) -> str:
    """The Markdown of a page; of a notebook, that of its cells."""
    text = path.read_text("utf-8")
    if path.suffix != ".ipynb":
        return text
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown"]
    return "\n\n".join("".join(cell["source"]) for cell in cells)


SITE = {
    path.relative_to(DOCS).with_suffix("").as_posix(): text_of(path)
    for path in sorted([*DOCS.rglob("*.md"), *DOCS.glob("*.ipynb")])
}
"""The text of every page of the site, by its name in a table of contents."""


def tokens(text: str) -> list:
    """All tokens of a page, those within lines of text too, and of containers such as :::."""
    found = MARKDOWN.parse(re.sub(r"^:{3,}.*$", "", text, flags=re.M))
    return [one for token in found for one in (token, *(token.children or []))]


def formulas(text: str) -> list[tuple[str, bool]]:
    """Formulas of a page, and True for those on lines of their own."""
    return [
        (token.content.strip(), token.type != "math_inline")
        for token in tokens(text)
        if token.type in ("math_inline", "math_block", "math_inline_double")
        or (token.type == "fence" and token.info.startswith("{math}"))
    ]


def refused(text: str) -> list[str]:
    """The formulas that the converter does not know, each with its reason."""
    found = []
    for formula, is_block in formulas(text):
        try:
            tex2mathml(formula, as_block=is_block)
        except MathError as error:
            found.append(f"{error}: {formula}")
    return found


def contents(site: dict[str, str]) -> list[tuple[str, str]]:
    """Each entry of each table of contents, as page and the page that it names."""
    found = []
    for page, text in site.items():
        folder = page.rpartition("/")[0]
        for token in tokens(text):
            if token.type != "fence" or token.info != "{toctree}":
                continue
            lines = [line.strip() for line in token.content.splitlines()]
            for line in lines:
                if not line or line.startswith(":"):
                    continue
                entry = re.sub(r".*<(.*)>", r"\1", line)
                name = f"{folder}/{entry}" if folder else entry
                if ":glob:" in lines and "*" in name:
                    found += [(page, one) for one in fnmatch.filter(site, name)]
                else:
                    found.append((page, name))
    return found


def misplaced(site: dict[str, str]) -> list[str]:
    """Entries without a page, and pages without an entry."""
    named = contents(site)
    found = [f"{page}: no page {name}" for page, name in named if name not in site]
    listed = {"index", *(name for _, name in named)}
    return found + [f"{name} is in no table of contents" for name in site if name not in listed]


def places(text: str) -> set[str]:
    """The names of the headings of a page, as links give them."""
    found: list[str] = []
    parsed = tokens(text)
    for heading, line in pairwise(parsed):
        if heading.type == "heading_open" and int(heading.tag[1]) <= DEEPEST:
            title = "".join(part.content for part in line.children)
            slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
            again = sum(
                re.fullmatch(rf"{re.escape(slug)}(-\d+)?", one) is not None for one in found
            )
            found.append(f"{slug}-{again}" if again else slug)
    return {*found, *re.findall(r"^\(([\w-]+)\)=$", text, re.M)}


def lost(pages: dict[str, str]) -> list[str]:
    """Links of the pages, which are paths from the project's folder, to no place of a page."""
    found = []
    for page, text in pages.items():
        for token in tokens(text):
            if token.type != "link_open" or "#" not in (url := unquote(token.attrs["href"])):
                continue
            path, _, place = url.partition("#")
            if re.match(r"[a-z]+:", url):
                continue
            target = page if not path else _joined(page, path)
            if target.endswith(".md") and place not in places(pages.get(target, "")):
                found.append(f"{page}: {target} has no place {place}")
    return found


def _joined(page: str, path: str) -> str:
    return ((ROOT / page).parent / path).resolve().relative_to(ROOT).as_posix()


PAGES = {
    path.relative_to(ROOT).as_posix(): text_of(path)
    for path in (*ROOT.glob("*.md"), *sorted(DOCS.rglob("*.md")))
}


def test_the_pages_have_formulas_contents_and_links_to_places():
    assert sum(len(formulas(text)) for text in SITE.values()) > 80
    assert len(contents(SITE)) > 45
    assert len(re.findall(r"\.md#", "".join(PAGES.values()))) > 15


@pytest.mark.parametrize("page", SITE)
def test_every_formula_can_be_drawn(page):
    assert refused(SITE[page]) == []


def test_every_page_is_in_a_table_of_contents_and_every_entry_is_a_page():
    assert misplaced(SITE) == []


def test_every_link_to_a_place_finds_it():
    assert lost(PAGES) == []


@pytest.mark.parametrize("text", [r"so that $a \mathrel{+}= b$ holds", "$$\n\\nothing{a}\n$$"])
def test_a_formula_that_cannot_be_drawn_is_found(text):
    assert len(refused(text)) == 1


def test_a_page_that_is_gone_or_left_out_is_found():
    site = {"index": "```{toctree}\n:hidden:\n\na/b\nWords <a/c>\n```", "a/b": "", "a/d": ""}
    assert misplaced(site) == ["index: no page a/c", "a/d is in no table of contents"]
    site["index"] = "```{toctree}\n:glob:\n\na/*\n```"
    assert misplaced(site) == []


def test_a_place_that_is_gone_is_found():
    pages = {
        "README.md": "[x](docs/a.md#the-place-of-x-1)\n\n[y](#nowhere)",
        "docs/a.md": "# A\n\n## The place of `x`: 1\n\n[A](#a) [z](../README.md#z)",
    }
    assert lost(pages) == [
        "README.md: README.md has no place nowhere",
        "docs/a.md: README.md has no place z",
    ]
