"""The wheel that is built from here holds all that the program needs, and nothing else."""

import os
import subprocess
import venv
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hatchling import build

import make_frames as make
from wgmb.cli import app

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return folder / build.build_wheel(str(folder))


def files(folder: str) -> set[str]:
    """All files in a folder of the source tree, by their names in it."""
    found = (ROOT / folder).rglob("*")
    return {
        path.relative_to(ROOT / folder).as_posix()
        for path in found
        if path.is_file() and "__pycache__" not in path.parts
    }


def test_it_holds_every_file_of_the_package_and_every_shader(wheel):
    with zipfile.ZipFile(wheel) as file:
        packed = {name for name in file.namelist() if ".dist-info/" not in name}
    wanted = {f"wgmb/{name}" for name in files("wgmb")}
    assert packed == wanted | {f"wgmb/wgsl/{name}" for name in files("wgsl")}


COMMAND = """
import wgmb
from importlib.metadata import entry_points
print(wgmb.__file__)
command = next(iter(entry_points(group="console_scripts", name="wgmb")))
command.load()()
"""


@pytest.mark.full
def test_installed_by_itself_it_renders_a_scene(wheel, tmp_path):
    """In an environment of its own, which borrows what wgmb depends on, but not wgmb."""
    venv.create(tmp_path / "venv", with_pip=False)
    (site,) = (tmp_path / "venv").glob("[Ll]ib/**/site-packages")
    with zipfile.ZipFile(wheel) as file:
        file.extractall(site)
    (site / "dependencies.pth").write_text(str(Path(np.__file__).parent.parent))
    python = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    words = ["render", "crossing", "--size", "64x36", "--quiet", "-o"]
    done = subprocess.run(
        [python, "-c", COMMAND, *words, "there.exr"],
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert Path(done.stdout.strip()).is_relative_to(site)
    assert app.main([*words, str(tmp_path / "here.exr")]) == 0
    there, here = (make.plain_read(tmp_path / f"{name}.exr") for name in ("there", "here"))
    assert there.keys() == here.keys()
    assert all(np.array_equal(there[name], here[name]) for name in here)
