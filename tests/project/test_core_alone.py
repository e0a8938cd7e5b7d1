"""The core without extras, in an environment that `./run test` makes: nothing else is installed."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import core_alone
import parts
from wgmb.extras import EXTRAS

pytestmark = pytest.mark.full
PYTHON = Path(__file__).parents[2] / "build/core/bin/python"


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Messages and results of the core alone: said.json and results.npz."""
    parts.need("core")
    folder = tmp_path_factory.mktemp("alone")
    line = [PYTHON, "-W", "error", core_alone.__file__, folder]
    done = subprocess.run(line, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    with np.load(folder / "results.npz") as made:
        return json.loads((folder / "said.json").read_text()), dict(made)


def test_nothing_of_an_extra_is_installed_there(alone):
    said, _ = alone
    extras = {package.index_name for package in EXTRAS.values()} | {"opencv-python"}
    extras -= {"rendercanvas"}  # wgpu lists it, and does not load it
    assert not extras & set(said["installed"])
    assert said["numpy"].startswith(("1.26.", "2.1."))


def test_every_method_scene_and_batch_has_the_same_bits_there(alone, tmp_path):
    _, made = alone
    here = core_alone.results(tmp_path)
    assert made.keys() == here.keys()
    for name in here:
        assert np.array_equal(made[name], here[name]), name


PACKAGE = {
    "png": "av", "png output": "av", "jpeg output": "imageio", "tiff output": "tifffile",
    "mp4 output": "av", "config": "opencolorio", "explore": "ipywidgets", "command": "cyclopts",
}  # fmt: skip


@pytest.mark.parametrize("what", PACKAGE)
def test_what_is_missing_is_told_with_the_command_that_installs_it(alone, what):
    text = alone[0]["said"][what]
    told = rf"\w is not installed: .*build/core/bin/python.* install .*'{PACKAGE[what]}[<>=].*'\n?$"
    assert re.search(told, text)
    assert len(text.splitlines()) == 1
    if what == "command":
        assert text.startswith("2 wgmb: ")
