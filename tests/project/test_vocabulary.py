"""Names are the field's words: parameters, functions, classes and fields say what they hold."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.fast

PACKAGE = Path(__file__).parents[2] / "wgmb"
FORBIDDEN = {
    **dict.fromkeys(("asked", "wish"), "a request, or layers, columns, numbers ..."),
    **dict.fromkeys(("told", "said"), "messages, notes, or what was read"),
    **dict.fromkeys(("made", "found", "worth"), "the result, by its own name"),
    **dict.fromkeys(("shown", "seen", "glance"), "display values, a display, a thumbnail ..."),
    **dict.fromkeys(("given", "what", "who", "when"), "the settings' own names"),
    **dict.fromkeys(("there", "beside", "around"), "neighbours, existing, other ..."),
    **dict.fromkeys(("spare",), "margin, unused"),
    **dict.fromkeys(("footage", "reel"), "a reader, shots"),
    **dict.fromkeys(("ingredients", "meaning"), "dependencies, convention"),
}
"""Words that say nothing of what is held, and what says it instead."""

ALLOWED = {
    ("color/spaces.py", "shown"): "public: Display.shown",
    ("sequence/layers/camera_file.py", "around"): "public: CameraFile.around",
    ("cli/commands/view.py", "what"): "the WHAT of the usage line",
}


def names(file: Path) -> Iterator[tuple[int, str]]:
    """Lines and names of a file's parameters, functions, classes and fields."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.lineno, node.name
        if isinstance(node, ast.arg):
            yield node.lineno, node.arg
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.attr
        if isinstance(node, ast.ClassDef):
            for field in node.body:
                if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                    yield field.lineno, field.target.id


def faults(file: Path, name: str) -> list[str]:
    """A line for each forbidden name of a file, which is called `name`."""
    return [
        f"{name}:{line}: {word}, rather: {FORBIDDEN[plain]}"
        for line, word in names(file)
        if (plain := word.strip("_").lower()) in FORBIDDEN and (name, word) not in ALLOWED
    ]


def test_names_say_what_they_hold():
    found = []
    for file in sorted(PACKAGE.rglob("*.py")):
        name = file.relative_to(PACKAGE).as_posix()
        found += faults(file, name)
    assert not found, "\n".join(found)


def test_every_kind_of_name_is_looked_at(tmp_path):
    code = "class Wish:\n    told: int\n    def _made(self, given):\n        self.seen = given\n"
    (file := tmp_path / "one.py").write_text(code)
    words = sorted(fault.split(":")[2].split(",")[0].strip() for fault in faults(file, "one.py"))
    assert words == ["Wish", "_made", "given", "seen", "told"]


def test_light_before_and_after_a_blur_is_named_in_few_modules():
    """A change of it is made in color/highlights.py, video/planes/ and their shader.

    The ninth is methods/contract_check.py, which lists the options of wgmb by name.
    """
    named = [f for f in PACKAGE.rglob("*.py") if re.search(r"\bhighlights\b", f.read_text("utf-8"))]
    assert len(named) <= 9, named


HEADLESS = re.compile(r"\bwhat (?!if\b|about\b|to\b|was (?:expected|given|found)\b|came\b)", re.I)
"""A clause in the place of a noun: "what rests" for static surfaces, "what is lost" for losses."""

QUESTION = re.compile(
    r"\b(?:sa(?:y|ys|id|ying)|tell|tells|told|know|knows|known|show|shows|showing|see|sees|asks?|asked|"
    r"explains?|explained|decides?|decided|lists?|names?|named|checks?|stat(?:e|es|ing)|describes?|"
    r"learn|chooses?|understand|judges?|reports?|guess)\W+$",
    re.I,
)
"""Words before an indirect question, which is no such clause: "an error says what was wrong"."""


def headless(text: str) -> list[str]:
    """The beginnings of the headless clauses of a text."""
    found = HEADLESS.finditer(text)
    return [text[m.start() : m.end() + 40] for m in found if not QUESTION.search(text[: m.start()])]


def prose(page: str) -> str:
    """A page of Markdown without its headings and code."""
    page = re.sub(r"(?ms)^(```|~~~).*?^\1", "", page)
    return re.sub(r"`[^`]*`|^#.*$", "x", page, flags=re.M)


def texts(file: Path) -> Iterator[str]:
    """Docstrings and messages of a file."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            yield node.value


def test_headless_clauses_are_rare():
    """At most 4 in 10,000 words; see HEADLESS."""
    root = PACKAGE.parent
    pages = [*root.glob("*.md"), *(root / "docs").rglob("*.md")]
    written = [prose(page.read_text("utf-8")) for page in pages]
    coded = [text for file in sorted(PACKAGE.rglob("*.py")) for text in texts(file)]
    for all_texts in (written, coded):
        found = [clause for text in all_texts for clause in headless(text)]
        words = sum(len(text.split()) for text in all_texts)
        assert len(found) <= 4e-4 * words, "\n".join(found)


def test_questions_are_no_headless_clauses():
    assert headless("It follows what rests.") and headless("What is lost is named.")
    assert not headless("An error says what was wrong.")
