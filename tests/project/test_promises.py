"""Promises of SECURITY.md about the whole program: nothing is executed, nothing connects."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import make_clips as clips
import make_frames as make

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "wgmb").rglob("*.py"))
CALLS = {
    "eval", "exec", "compile", "os.system", "os.popen",
    "socket.socket", "socket.create_server", "socket.create_connection",
}  # fmt: skip
MODULES = {
    "pickle", "marshal", "shelve", "dill", "cloudpickle", "yaml",
    "urllib", "http", "requests", "ftplib", "smtplib", "xmlrpc",
}  # fmt: skip


def dotted(node: ast.expr) -> str:
    """`a.b.c` for such a name, else ""."""
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


@pytest.mark.fast
def test_no_module_executes_text_unpickles_or_opens_a_connection():
    assert len(SOURCES) > 150
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            found: list[str] = []
            if isinstance(node, ast.Call):
                found = [dotted(node.func)]
                if found[0].startswith("subprocess."):
                    assert all(k.arg != "shell" for k in node.keywords), f"{path}:{node.lineno}"
            elif isinstance(node, ast.Import):
                found = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found = [node.module or "", *(f"{node.module}.{a.name}" for a in node.names)]
            wrong = {*found, *(name.partition(".")[0] for name in found)} & (CALLS | MODULES)
            assert not wrong, f"{path}:{node.lineno}: {wrong}"


WATCH = """
import sys
seen = []
AWAY = "socket.connect", "socket.bind", "subprocess.Popen", "os.system", "os.exec", "os.posix_spawn"
sys.addaudithook(lambda event, given: event in (*AWAY, "pickle.find_class") and seen.append(event))
from wgmb.cli import app
code = app.main(sys.argv[1:])
assert not seen, seen
sys.exit(code)
"""


@pytest.mark.covers(1)
@pytest.mark.parametrize("command", ["info", "blur"])
@pytest.mark.parametrize("kind", ["frame", "video"])
def test_a_command_neither_connects_nor_starts_a_program(tmp_path, command, kind):
    source = tmp_path / ("in.exr" if kind == "frame" else "in.mkv")
    if kind == "frame":
        make.write_exr(source, make.frame(1))
        more = ["--method", "tap"]
    else:
        clips.write(source, codec="ffv1")
        more = ["--flow", "none"]
    words = [source] if command == "info" else [source, "-o", tmp_path / "out.exr", *more]
    if command == "blur" and kind == "video":
        words[2] = tmp_path / "out.mp4"
    line = [sys.executable, "-c", WATCH, command, *map(str, words)]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def test_a_connection_and_a_program_would_be_seen(tmp_path):
    """The watch itself."""
    line = [sys.executable, "-c", WATCH.replace("app.main(sys.argv[1:])", "0; import subprocess; "
            "subprocess.run(['true'])")]  # fmt: skip
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert "subprocess.Popen" in done.stderr


@pytest.mark.fast
def test_each_promise_of_the_page_has_a_test_that_exists():
    page = (ROOT / "SECURITY.md").read_text("utf-8")
    promised = page[page.index("## Promises") : page.index("How this is tested:")]
    promises = [lead.rstrip(".") for lead in re.findall(r"^- \*\*([^*]+)\*\*", promised, re.M)]
    assert len(promises) >= 7
    rows = dict(re.findall(r"^\| ([^|]+) \| (`[^|]+) \|$", page, re.M))
    assert list(rows) == promises
    for tests in rows.values():
        for file, name in re.findall(r"`([^`]+)::([^`]+)`", tests):
            assert f"def {name}(" in (ROOT / "tests" / file).read_text("utf-8"), (file, name)
