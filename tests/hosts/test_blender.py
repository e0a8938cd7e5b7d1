"""The Blender add-on: what can be told without Blender, and tests/blender in Blender's module.

`./run test all` installs the module into build/blender where it can; WGMB_BLENDER=required fails
where it cannot, WGMB_WITHOUT=blender does without.
"""

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import parts
from wgmb import __version__

ROOT = Path(__file__).parents[2]
ADD_ON, TESTS, HOME = ROOT / "blender/wgmb_blender", ROOT / "tests/blender", ROOT / "build/blender"
PYTHON = HOME / "venv/bin/python"
MANIFEST = tomllib.loads((ADD_ON / "blender_manifest.toml").read_text("utf-8"))
FILES = sorted(path.name for path in TESTS.glob("test_*.py"))
sys.path.append(str(ROOT / "blender"))


@pytest.mark.fast
def test_the_manifest_is_of_this_version_and_licence():
    assert MANIFEST["version"] == __version__
    assert MANIFEST["license"] == ["SPDX:GPL-3.0-or-later"]
    assert MANIFEST["blender_version_min"] == "4.2.0"
    assert "GNU GENERAL PUBLIC LICENSE" in (ROOT / "blender/LICENSE").read_text("utf-8")[:80]
    assert (ROOT / "LICENSE").read_text("utf-8").startswith("MIT License")


@pytest.mark.fast
def test_wheels_are_locked_for_all_that_wgmb_needs():
    """But for numpy, which Blender has; with the versions of constraints.txt."""
    import build

    text = (ROOT / "pyproject.toml").read_text("utf-8")
    needed = {
        re.split(r"[ <>=~]", line)[0].lower()
        for line in tomllib.loads(text)["project"]["dependencies"]
    }
    locked = build.locked()
    assert needed - {"numpy"} <= set(locked) == set(build.PACKAGES)
    constraints = (ROOT / "constraints.txt").read_text("utf-8")
    for name, version in locked.items():
        assert re.search(rf"^{name}=={re.escape(version)}\b", constraints, re.M)
    lock = build.LOCK.read_text("utf-8")
    per_python = len(build.PLATFORMS) * len(build.PYTHONS)
    counts = {name: lock.count("--hash", lock.index(f"{name}=="), end) for name, end in ends(lock)}
    assert counts["openexr"] == counts["cffi"] == per_python
    assert counts["wgpu"] == len(build.PLATFORMS)


@pytest.mark.fast
def test_without_hatchling_a_line_says_what_brings_it(monkeypatch, tmp_path):
    import build

    monkeypatch.setattr(build, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match=r"^this Python has no hatchling, .*; \./run add-on"):
        build.bundle(tmp_path / "dist", tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.fast
def test_without_the_wheels_no_bundle_is_begun(monkeypatch, tmp_path):
    import build

    monkeypatch.setattr(build, "find_spec", lambda name: name)
    monkeypatch.setattr(build, "own_wheel", lambda folder: pytest.fail("a wheel is built"))
    with pytest.raises(SystemExit, match=r" has no cffi, .* for linux-x64: fetch them first$"):
        build.bundle(tmp_path / "dist", tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.fast
def test_without_a_network_a_line_says_so(monkeypatch, tmp_path):
    import build

    for first, end in (("WARNING: Retrying\n", "; is the package index within reach?"), ("", "")):
        answer = subprocess.CompletedProcess([], 1, "", f"{first}ERROR: No matching a\n")
        monkeypatch.setattr(subprocess, "run", lambda *_, answer=answer, **__: answer)
        told = re.escape(f" for Python 3.11: ERROR: No matching a{end}")
        with pytest.raises(SystemExit, match=rf"^pip could not download the wheels{told}$"):
            build.download(["wgpu"], tmp_path / "wheels")


def ends(lock: str) -> list[tuple[str, int]]:
    """Each package of the lock, and where the next one begins."""
    found = [(m[1], m.start()) for m in re.finditer(r"^([a-z-]+)==", lock, re.M)]
    return [
        (name, at) for (name, _), (_, at) in zip(found, [*found[1:], ("", len(lock))], strict=True)
    ]


@pytest.mark.fast
@pytest.mark.parametrize("file", sorted(p.name for p in ADD_ON.glob("*.py")))
def test_the_add_on_can_be_loaded_without_what_it_brings(file):
    """Only functions import wgmb, so that a Blender that lacks it can say so."""
    tree = ast.parse((ADD_ON / file).read_text("utf-8"))
    top = [n for n in tree.body if isinstance(n, (ast.Import, ast.ImportFrom))]
    names = {a.name for n in top if isinstance(n, ast.Import) for a in n.names}
    names |= {n.module for n in top if isinstance(n, ast.ImportFrom) and not n.level and n.module}
    assert not {n for n in names if n.partition(".")[0] in ("wgmb", "wgpu", "OpenEXR")}


@pytest.mark.full
@pytest.mark.parametrize("file", FILES)
def test_in_blenders_module(file):
    parts.need("blender")
    words = [PYTHON, "-m", "pytest", "-c", TESTS / "pytest.ini", f"--confcutdir={TESTS}"]
    words += [f"--rootdir={TESTS}", "-q", TESTS / file]
    keep = {name: v for name, v in os.environ.items() if not name.startswith("PYTEST")}
    keep.pop("PYTHONPATH", None)
    done = subprocess.run(words, cwd=TESTS, env=keep, capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0, done.stdout[-20000:] + done.stderr[-2000:]
