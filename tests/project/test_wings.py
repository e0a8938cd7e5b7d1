"""The rest of the package works without each of its wings, which a copy leaves out."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from wgmb.extras import WINGS

ROOT = Path(__file__).parents[2]
COMMANDS = {
    "farm": "blur sample/crossing.####.exr -o {} --workers 1",
    "lab": "compare crossing -o {}",
    "perceive": "perceive crossing -o {}",
    "viewer": "view crossing",
}
QUICK = ["tests/project/test_shutter.py", "tests/settings/test_blur_settings.py",
         "tests/pipeline/test_locked.py", "tests/sequence/test_windows.py"]  # fmt: skip
IMPORTS = """
import pkgutil, importlib, sys
import wgmb
wings = sys.argv[1].split(",")
for module in pkgutil.walk_packages(wgmb.__path__, "wgmb."):
    place = module.name.split(".")[1]
    if place not in wings and "commands" not in module.name and place != "__main__":
        importlib.import_module(module.name)
assert wgmb.__file__.startswith(sys.argv[2]), wgmb.__file__
"""


def copy(folder: Path, *wings: str) -> Path:
    """The package without some wings, with what lies beside it."""
    left_out = {*wings, "__pycache__"}

    def names(place: str, found: list[str]) -> set[str]:
        return left_out & set(found) if Path(place) == ROOT / "wgmb" else {"__pycache__"}

    shutil.copytree(ROOT / "wgmb", folder / "wgmb", ignore=names)
    for name in ("wgsl", "sample", "tests", "tools", "docs", "pyproject.toml", "README.md"):
        (folder / name).symlink_to(ROOT / name)
    return folder


def run(folder: Path, *words: str, code: int = 0) -> str:
    """Output of a program that Python runs with the copy; its exit code must be `code`."""
    there = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    there.pop("WGMB_TIER", None)  # the copy has no `./run` that could set a part up
    line = [sys.executable, "-P", *words]
    done = subprocess.run(line, cwd=folder, env=there, capture_output=True, text=True, timeout=600)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def check(folder: Path, *wings: str) -> None:
    """The rest can be imported, `wgmb --help` works, and commands name what is missing."""
    run(folder, "-c", IMPORTS, ",".join(WINGS), str(folder))
    assert "blur" in run(folder, "-m", "wgmb", "--help")
    for wing in COMMANDS.keys() & set(wings):
        words = COMMANDS[wing].format(folder / "out.####.exr").split()
        said = run(folder, "-m", "wgmb", *words, code=2)
        assert f"this copy of wgmb has no wgmb/{wing}" in said
        assert f"the extra {WINGS[wing]}" in said
        assert len(said.strip().splitlines()) == 1


@pytest.mark.fast
def test_the_rest_works_without_all_wings(tmp_path):
    check(copy(tmp_path, *WINGS), *WINGS)


@pytest.mark.full
@pytest.mark.parametrize("wing", WINGS)
def test_the_rest_works_without_a_wing(wing, tmp_path):
    check(copy(tmp_path, wing), wing)


@pytest.mark.full
def test_tests_of_the_core_pass_without_all_wings(tmp_path):
    folder = copy(tmp_path, *WINGS)
    said = run(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *QUICK)
    assert " passed" in said and "failed" not in said
