"""What the README shows works as it stands."""

import re
import shlex
from pathlib import Path

import pytest

from wgmb import cli, options

HERE = Path(__file__).parent.parent
TEXT = (HERE / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.S)


def test_python_blocks_run_in_their_order(tmp_path, monkeypatch):
    monkeypatch.chdir(HERE)
    names: dict = {}
    assert len(BLOCKS) == 1
    for block in BLOCKS:
        exec(compile(block.replace('"out/', f'"{tmp_path}/'), "README.md", "exec"), names)
    assert names["out"].shape == (270, 480, 3)
    assert [image.shape for image in names["images"]] == [(240, 400, 4)] * 3


def test_every_option_that_is_named_exists():
    known = {"--version", "--help"}
    for group in vars(options).values():
        for name in getattr(group, "__dataclass_fields__", ()):
            known.add("--" + name.replace("_", "-"))
    known |= {"--adapter", "--size", "--rounds", "--verbose", "--sharp", "--passes", "--config"}
    known |= {"--truth", "--inputs", "--frame", "--peer", "--experiment", "--save"}
    known |= {"--against", "--article", "--confidence", "--seconds"}
    known |= {"--method", "--report", "--speed"}
    named = set(re.findall(r"--[a-z][a-z-]+", TEXT))
    assert named - known == set()


@pytest.mark.parametrize("line", re.findall(r"^wgmb blur .*$", TEXT, re.M))
def test_command_lines_are_understood(line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = shlex.split(line.replace("shot.####.exr", f"{HERE}/sample/crossing.####.exr"))
    assert cli.main([*words[1:], "--quiet"]) == 0
    assert len(list(tmp_path.glob("blurred.*.exr"))) == 3
