"""The bundles: small, valid for Blender's own tool, and enough for a Blender that has nothing."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import bpy
import pytest

import build
from conftest import HOSTS, ROOT

TOOL = Path(bpy.utils.system_resource("SCRIPTS")) / "addons_core/bl_pkg/cli/blender_ext.py"
INSTALL = f"""
import sys
import bpy
import addon_utils
addon_utils.enable("bl_pkg", default_set=False)
done = bpy.ops.extensions.package_install_files(
    filepath=sys.argv[1], repo="user_default", enable_on_install=True
)
assert done == {{"FINISHED"}}, done
import OpenEXR, cffi, fileseq, wgmb, wgpu
for module in (OpenEXR, cffi, fileseq, wgmb, wgpu):
    assert "extensions" in module.__file__ and sys.argv[2] in module.__file__, module.__file__
sys.path.insert(0, {str(ROOT / "tests" / "blender")!r})
import scenes
from pathlib import Path
scene = scenes.crossing(size=(32, 18))
addon_utils.enable("bl_ext.user_default.wgmb")
scenes.output(scene, Path(sys.argv[2]), "PNG", "8")
assert bpy.ops.wgmb.render_and_blur() == {{"FINISHED"}}
addon_utils.disable("bl_ext.user_default.wgmb")
assert not hasattr(bpy.types.Scene, "wgmb")
"""


@pytest.fixture(scope="module")
def bundles(tmp_path_factory):
    made = build.bundle(tmp_path_factory.mktemp("bundles"))
    return dict(zip(build.PLATFORMS, made, strict=True))


@pytest.mark.parametrize("platform", build.PLATFORMS)
def test_a_bundle_is_small_valid_and_whole(bundles, platform):
    path = bundles[platform]
    assert path.stat().st_size < build.MOST_BYTES
    done = subprocess.run([sys.executable, TOOL, "validate", path], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(path) as file:
        names = file.namelist()
        text = file.read("blender_manifest.toml").decode()
    wheels = [name for name in names if name.endswith(".whl")]
    listed = [line.strip(' ",').removeprefix("./") for line in text.splitlines() if ".whl" in line]
    assert sorted(listed) == sorted(wheels)
    of = [Path(name).name.partition("-")[0] for name in wheels]
    assert {"wgmb", "wgpu", "openexr", "cffi", "pycparser", "fileseq", "packaging"} <= set(of)
    assert ("rubicon_objc" in of) == platform.startswith("macos")
    assert of.count("openexr") == of.count("cffi") == len(build.PYTHONS)
    assert not any("numpy" in name or "__pycache__" in name for name in names)


def test_a_blender_that_has_nothing_installs_it_and_blurs(bundles, tmp_path):
    path = bundles[HOSTS[sys.platform]]
    env = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    env["BLENDER_USER_RESOURCES"] = str(tmp_path)
    words = [sys.executable, "-c", INSTALL, path, tmp_path]
    done = subprocess.run(words, env=env, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert sorted(p.name for p in tmp_path.glob("*.png")) == [
        f"blurred_000{n}.png" for n in (4, 5, 6)
    ]
