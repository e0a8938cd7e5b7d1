"""The command line asks the library for runs: its commands make no frames themselves."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.fast

COMMANDS = sorted((Path(__file__).parents[2] / "wgmb/cli/commands").glob("*.py"))
MAKERS = {"Blur", "Output", "VectorOutput", "Observer", "Render", "Video", "VideoWriter"}
FRAMES = {"numbers", "wanted", "moments", "frames", "pictures", "exposures", "on_disk", "presented"}
LOOKS = {("info.py", "Blur"), ("doctor.py", "Blur")}  # at one frame, which is not written


def faults(name: str, text: str) -> Iterator[str]:
    """Lines that make a blur or an output, or loop over frames."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute):
            called = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            if called in MAKERS and (name, called) not in LOOKS:
                yield f"{name}:{node.lineno}: makes {called}"
        if isinstance(node, ast.For | ast.AsyncFor | ast.comprehension):
            for part in ast.walk(node.iter):
                word = part.id if isinstance(part, ast.Name) else getattr(part, "attr", "")
                if word in FRAMES:
                    yield f"{name}:{node.iter.lineno}: loops over {word}"
        if isinstance(node, ast.While) and name != "doctor.py":
            yield f"{name}:{node.lineno}: loops"


@pytest.mark.parametrize("file", COMMANDS, ids=lambda file: file.name)
def test_commands_make_no_frames(file):
    assert not list(faults(file.name, file.read_text("utf-8")))


@pytest.mark.parametrize(
    "text",
    ["for n in clip.numbers:\n    pass", "x = [f(m) for m in wanted]", "b = wgmb.Blur('tap')",
     "files = Output(name)", "while True:\n    step()", "for a, b in zip(pictures, x): pass"],
)  # fmt: skip
def test_what_makes_frames_is_found(text):
    assert len(list(faults("blur.py", text))) == 1
