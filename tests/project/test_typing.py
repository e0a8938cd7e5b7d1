"""Type checkers find a typo in a user's program, and accept what is right."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from wgmb.frame import PASSES
from wgmb.methods import METHODS
from wgmb.methods.keywords import Curve, MethodKeywords, MethodName
from wgmb.methods.options import options_of
from wgmb.pipeline.one_frame import FrameKeywords
from wgmb.run.video import PictureKeywords, VideoKeywords
from wgmb.shutter import CURVES

RIGHT = """
import numpy as np
import wgmb

color = np.zeros((8, 8, 3), np.float32)
motion = np.zeros((8, 8, 2), np.float32)
blur = wgmb.Blur("gather", shutter=180, curve="cosine", samples="auto", reach=2)
wgmb.Blur(wgmb.METHODS["tap"], shutter=90, own=3)
picture = blur(color, to_next=motion, depth=np.ones((8, 8)))
total: float = float(wgmb.blur(color, motion, path="straight", samples=8).sum())
wgmb.blur_video("in.mp4", "out.mp4", fps=60, shutter=180, holdout="mask.png", flow="dis")
for one in wgmb.blur_pictures([color], fps_in=24, fps="60000/1001", transfer="linear"):
    print(one)
for frame in wgmb.Clip("shot.####.exr"):
    print(blur(frame).shape, wgmb.Shutter(360, curve=np.ones_like))
"""
WRONG = """
import numpy as np
import wgmb

color, coded = np.zeros((8, 8, 3), np.float32), np.zeros((8, 8, 3), np.uint8)
wgmb.Blur("gathr")  # wrong
wgmb.Blur("tap", shuter=180)  # wrong
wgmb.Blur("tap", path="strait")  # wrong
wgmb.Blur("tap", curve="cosin")  # wrong
wgmb.Blur("tap", samples="many")  # wrong
wgmb.blur(color, method="tapp")  # wrong
wgmb.blur(color, dept=color)  # wrong
wgmb.blur(coded)  # wrong
wgmb.Frame(color, object_id=color)  # wrong
wgmb.blur_video("in.mp4", "out.mp4", flow="diss")  # wrong
wgmb.blur_video("in.mp4", "out.mp4", sutter=180)  # wrong
wgmb.blur_pictures([color], transfer="log")  # wrong
wgmb.blur_pictures([color], codec="h264")  # wrong
"""
CHECKERS = {
    "pyright": ["-m", "pyright", "--pythonpath", sys.executable],
    "mypy": ["-m", "mypy", "--strict", "--no-error-summary", "--cache-dir"],
}


@pytest.mark.full
@pytest.mark.parametrize("checker", CHECKERS)
def test_a_typo_is_found_and_what_is_right_is_not(checker, tmp_path):
    (tmp_path / "right.py").write_text(RIGHT)
    (tmp_path / "wrong.py").write_text(WRONG)
    (tmp_path / "pyrightconfig.json").write_text('{"typeCheckingMode": "strict"}')
    more = [str(tmp_path / "cache")] if checker == "mypy" else []
    words = [sys.executable, *CHECKERS[checker], *more, "right.py", "wrong.py"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    found = re.findall(r"(right|wrong)\.py:(\d+):.*?error", done.stdout)
    wanted = [n for n, line in enumerate(WRONG.splitlines(), 1) if line.endswith("# wrong")]
    assert {int(n) for name, n in found if name == "wrong"} == set(wanted), done.stdout
    assert not [n for name, n in found if name == "right"], done.stdout


def test_keywords_are_the_options_of_the_methods():
    assert set(get_args(MethodName)) == set(METHODS)
    assert set(get_args(Curve)) == set(CURVES)
    known = [option for m in METHODS.values() for option in options_of(m.Options).values()]
    hints = get_type_hints(MethodKeywords)
    assert {option.name for option in known} == set(hints)
    for name, hint in hints.items():
        same = [option for option in known if option.name == name]
        choices = {choice for option in same for choice in option.choices}
        assert set(get_args(hint)) == choices, name
        assert choices or {hint} == {option.kind for option in same}, name
    assert set(PASSES) - {"to_next"} <= set(get_type_hints(FrameKeywords))
    assert set(get_type_hints(PictureKeywords)) < set(get_type_hints(VideoKeywords))


ROOT = Path(__file__).parents[2]
STRICT = "gpu", "gpu_frame", "methods", "pipeline"
MOST_PARAMETERS = 8
PUBLIC = {f"{name} in pipeline/blur.py" for name in ("encode", "_encode")}  # five frames by name


def crowded(text: str) -> list[str]:
    """Functions with more than MOST_PARAMETERS parameters, constructors left out."""
    return [
        node.name
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef) and node.name != "__init__"
        and len({a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)}
                - {"self", "cls"}) > MOST_PARAMETERS
    ]  # fmt: skip


NAMES_ARE_DATA = {"bindings", "resources", "values", "changes", "content", "bound"}
"""Parameters whose names are data: what a shader binds, fields of a value, keys of JSON."""
HOOKS = {"_", "__"}  # of other packages' classes, which pass what is of no use here


def handed_on(text: str) -> list[str]:
    """Functions that take, as `*args` or `**options`, what they do not know themselves."""
    return [
        f"{node.name}: {name.arg}"
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        for name in (node.args.vararg, node.args.kwarg)
        if name is not None
        and name.arg not in HOOKS | NAMES_ARE_DATA
        and (name.annotation is None or ast.unparse(name.annotation) == "Any")
    ]


FOREIGN = {  # the calls of other packages, and what takes a method's own options
    "__init__: arguments", "__init__: options", "__init__: named", "_alone: arguments",
    "add_event_handler: options", "decode_bounded: options", "guarded: arguments",
    "of: more", "view_of: options",
}  # fmt: skip


@pytest.mark.fast
def test_no_function_hands_on_what_it_does_not_know():
    assert handed_on("def f(*args): g(*args)") == ["f: args"]
    assert handed_on("def f(*texts: str, **changes: Any): ...") == []
    found = {one for file in (ROOT / "wgmb").rglob("*.py") for one in handed_on(file.read_text())}
    assert found == FOREIGN


@pytest.mark.fast
def test_every_parameter_has_a_type():
    untyped = [
        f"{file.relative_to(ROOT)}:{node.lineno} {parameter.arg}"
        for file in sorted((ROOT / "wgmb").rglob("*.py"))
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        for parameter in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs,
                          node.args.vararg, node.args.kwarg)
        if parameter is not None and parameter.annotation is None
        and parameter.arg not in ("self", "cls", "_", "__")
    ]  # fmt: skip
    assert not untyped


@pytest.mark.fast
def test_types_are_checked_by_one_standard_in_all_folders():
    checker = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["pyright"]
    assert checker["typeCheckingMode"] == "standard"
    assert "executionEnvironments" not in checker and "wgmb" in checker["include"]


@pytest.mark.fast
def test_functions_that_record_passes_take_few_parameters():
    found = {
        f"{name} in {path.relative_to(ROOT / 'wgmb').as_posix()}"
        for folder in STRICT
        for path in (ROOT / "wgmb" / folder).rglob("*.py")
        for name in crowded(path.read_text("utf-8"))
    }
    assert found == PUBLIC
    nine = ", ".join("abcdefghi")
    assert crowded(f"def f({nine}): ...\ndef g(self, {nine[3:]}): ...\n") == ["f"]


@pytest.mark.fast
def test_the_type_checker_asks_for_every_parameter_of_passes():
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    relaxed = set(re.findall(r'root = "wgmb/(\w+)", reportMissingParameterType = false', text))
    assert not relaxed & set(STRICT)
