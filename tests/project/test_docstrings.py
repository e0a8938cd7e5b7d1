"""Docstrings name the thing that they describe: "The size", not "How large it is"."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACES = "wgmb", "tests", "tools", "comfyui", "blender"
FILES = [file for place in PLACES for file in sorted((ROOT / place).rglob("*.py"))]
CLAUSE = re.compile(r"\s*(What|How|Whether|Where|When|Why|Which|Who)\b")


def clauses(text: str) -> list[str]:
    """First lines of the docstrings, those of attributes included, that begin with a clause."""
    texts = [
        node.value.value
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    ]
    return [text.strip().partition("\n")[0] for text in texts if CLAUSE.match(text)]


@pytest.mark.fast
@pytest.mark.parametrize("place", PLACES)
def test_no_docstring_begins_with_a_clause(place):
    found = {
        file.relative_to(ROOT).as_posix(): lines
        for file in FILES
        if file.is_relative_to(ROOT / place) and (lines := clauses(file.read_text("utf-8")))
    }
    assert not found


@pytest.mark.fast
def test_clauses_are_found_in_modules_functions_and_attributes():
    text = '"""What it is."""\na = 1\n"""How much."""\ndef f():\n    """Whatever: fine."""\n'
    assert clauses(text) == ["What it is.", "How much."]
