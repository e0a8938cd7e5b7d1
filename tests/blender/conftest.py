"""Blender's module, the add-on, and what a bundle brings along: nothing else is installed here.

`./run test` runs these files where it can install bpy; see tests/hosts/test_blender.py.
"""

import os
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SITE = ROOT / "build" / "blender" / "site"
HOSTS = {"linux": "linux-x64", "win32": "windows-x64", "darwin": "macos-arm64"}
sys.path[:0] = [str(ROOT), str(ROOT / "blender")]
os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())

import build


def unpacked() -> Path:
    """The wheels of this platform and Python as Blender unpacks them."""
    own = f"cp3{sys.version_info[1]}"
    wheels = [
        path
        for path in build.wheels_of(HOSTS[sys.platform], build.WHEELS)
        if path.stem.split("-")[2].startswith("py3") or own in path.stem
    ]
    site = SITE.with_name(f"site-{build.hashlib.sha256(str(wheels).encode()).hexdigest()[:8]}")
    if not site.exists():
        place = Path(tempfile.mkdtemp(dir=site.parent))
        for wheel in wheels:
            with zipfile.ZipFile(wheel) as file:
                file.extractall(place)
        try:
            place.rename(site)
        except OSError:  # another process was quicker
            shutil.rmtree(place)
    return site


sys.path.insert(1, str(unpacked()))

import bpy

import wgmb_blender
from wgmb_blender import process

_PROCESSES: list[process.Process] = []


@pytest.fixture(autouse=True)
def _registered():
    """The add-on, and nothing of it left behind; its process is lent on to the next test."""
    wgmb_blender.register()
    process._kept += _PROCESSES
    yield
    _PROCESSES[:], process._kept[:] = process._kept, []
    wgmb_blender.unregister()
    assert len(bpy.data.scenes) == 1
    assert not [tree for tree in bpy.data.node_groups if tree.name.startswith("wgmb")]
