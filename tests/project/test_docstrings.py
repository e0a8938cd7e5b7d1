"""Docstrings name the thing that they describe, by the name that it has in the code."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACES = "wgmb", "tests", "tools", "comfyui", "blender"
FILES = [file for place in PLACES for file in sorted((ROOT / place).rglob("*.py"))]
DEFINED = re.compile(r"(?:^|\\n|[.;] )((?:`\w+`(?:, | and )?)+):")
FILE = re.compile(r"(?<![\w*{<])(?:[\w-]+/)*[a-z_0-9-]+\.(?:wgsl|py)\b")
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


def undefined(text: str) -> list[str]:
    """Names that the docstring of a dataclass defines (`name`: ...), and the class does not have.

    Classes with bases are left out, as they have fields that are not in the text.
    """
    missing = []
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.ClassDef) or node.bases:
            continue
        if not any("dataclass" in ast.unparse(one) for one in node.decorator_list):
            continue
        own = {one.target.id for one in node.body
               if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name)}  # fmt: skip
        own |= {one.name for one in node.body if isinstance(one, ast.FunctionDef)}
        lists = DEFINED.findall(ast.get_docstring(node) or "")
        said = {name for words in lists for name in re.findall(r"`(\w+)`", words)}
        missing += [f"{node.name}.{name}" for name in sorted(said - own)]
    return missing


@pytest.mark.fast
def test_docstrings_of_dataclasses_define_fields_that_they_have():
    found = {
        file.relative_to(ROOT).as_posix(): names
        for file in FILES
        if file.is_relative_to(ROOT / "wgmb") and (names := undefined(file.read_text("utf-8")))
    }
    assert not found


@pytest.mark.fast
def test_a_name_that_a_class_does_not_have_is_found():
    text = '@dataclass\nclass A:\n    """`a`, `b`: 1. `c`: 2; see `d`."""\n    a: int\n    b: int\n'
    assert undefined(text) == ["A.c"]
    assert undefined(text.replace("c`:", "a`:")) == []


@pytest.mark.fast
@pytest.mark.parametrize("place", ["wgmb", "wgsl"])
def test_files_that_comments_name_exist(place):
    folders = "wgmb", "wgsl", "tools", "tests", "blender", "sample"
    known = {path.name for folder in folders for path in (ROOT / folder).rglob("*.*")}
    files = [
        path for path in sorted((ROOT / place).rglob("*.*")) if path.suffix in (".py", ".wgsl")
    ]
    assert files
    found = {
        path.relative_to(ROOT).as_posix(): names
        for path in files
        if (names := {one for one in FILE.findall(path.read_text("utf-8"))
                      if Path(one).name not in known})
    }  # fmt: skip
    assert not found
