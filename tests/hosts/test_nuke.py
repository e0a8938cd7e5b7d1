"""The lines for Nuke's menu, with a stand-in for its commands: render, blur, read."""

import re
import shutil
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from wgmb.io import exr

ROOT = Path(__file__).parents[2]
BLOCK = re.search(r"```py\n(import nuke.*?)```", (ROOT / "docs/artists/nuke.md").read_text(), re.S)


@pytest.mark.full
@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in for the program is a script")
def test_the_menu_entry_renders_blurs_and_reads(tmp_path, monkeypatch):
    said, menu = {}, {}

    def execute(write, first, last):
        for frame in range(first, last + 1):
            name = f"crossing.{frame:04d}.exr"
            shutil.copy(ROOT / "sample" / name, write.file.replace("####", f"{frame:04d}"))

    nuke = ModuleType("nuke")
    vars(nuke).update(
        root=lambda: SimpleNamespace(firstFrame=lambda: 9, lastFrame=lambda: 10),
        selectedNode=lambda: "selected",
        nodes=SimpleNamespace(Write=lambda **how: SimpleNamespace(**how), Read=lambda **how: how),
        execute=execute,
        delete=lambda write: said.update(deleted=write.inputs),
        menu=lambda name: SimpleNamespace(addCommand=menu.__setitem__),
        ProgressTask=lambda title: SimpleNamespace(
            setProgress=lambda percent: said.update(percent=percent), isCancelled=lambda: False
        ),
    )
    monkeypatch.setitem(sys.modules, "nuke", nuke)
    names = {}
    exec(compile(BLOCK[1], "docs/artists/nuke.md", "exec"), names)
    program = tmp_path / "wgmb"
    program.write_text(f'#!/bin/sh\ncd "{ROOT}" && exec "{sys.executable}" -m wgmb "$@"\n')
    program.chmod(0o755)
    names["WGMB"] = str(program)
    read = names["motion_blur"](str(tmp_path))
    assert read == {"file": str(tmp_path / "blurred.####.exr"), "first": 9, "last": 10}
    assert exr.read(tmp_path / "blurred.0009.exr") and (tmp_path / "blurred.0010.exr").exists()
    assert said["deleted"] == ["selected"] and "wgmb/Motion blur" in menu
    with pytest.raises(RuntimeError, match="blurred"):  # its results are there
        names["motion_blur"](str(tmp_path))
