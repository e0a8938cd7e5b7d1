"""The add-on in a Blender that one starts: its command line, and its window.

WGMB_BLENDER_PROGRAM names one, 4.2 or later; nothing but that program, and for the window Xvfb and
xdotool, is needed. The bundle is installed into settings of its own.
"""

import contextlib
import os
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = shlex.split(os.environ.get("WGMB_BLENDER_PROGRAM", ""))
WHEELS = ROOT / "build/blender/wheels"
pytestmark = [
    pytest.mark.full,
    pytest.mark.skipif(not PROGRAM, reason="WGMB_BLENDER_PROGRAM names no Blender"),
]
INSTALL = """
import sys, addon_utils, bpy
from pathlib import Path
bundle, tests, folder = sys.argv[sys.argv.index("--") + 1:]
addon_utils.enable("bl_pkg", default_set=True)
done = bpy.ops.extensions.package_install_files(
    filepath=bundle, repo="user_default", enable_on_install=True
)
assert done == {"FINISHED"}, done
bpy.context.preferences.view.show_splash = False
bpy.context.preferences.view.render_display_type = "NONE"
bpy.ops.wm.save_userpref()
sys.path.append(tests)
import scenes
scene = scenes.crossing(size=(64, 36))
scene.cycles.samples = 2
scenes.output(scene, Path(folder), "PNG", "8")
bpy.ops.wm.save_as_mainfile(filepath=folder + "/shot.blend")
"""
WINDOW = """
import os, bpy
from pathlib import Path
FOLDER = Path(bpy.data.filepath).parent
def say(text):
    with (FOLDER / "told").open("a") as file:
        file.write(text + "\\n")
def plain(scene):
    image, render = scene.render.image_settings, scene.render
    return (
        render.filepath, image.file_format, image.color_depth, render.use_motion_blur,
        scene.view_layers[0].use_pass_vector, scene.frame_current, len(bpy.data.scenes),
        len(bpy.data.images) - ("Render Result" in bpy.data.images),
    )
def work():
    window, scene = bpy.context.window_manager.windows[0], bpy.context.scene
    keys = bpy.context.window_manager.keyconfigs.addon.keymaps.new("Window").keymap_items
    keys.new("wgmb.render_and_blur", "F5", "PRESS")
    yield 1
    before = plain(scene)
    say("ready")
    for _ in range(2):
        while not window.modal_operators:
            yield 0.02
        say("at work")
        while window.modal_operators:
            yield 0.1
        say("as before" if plain(scene) == before else f"{before} {plain(scene)}")
    bpy.ops.wm.quit_blender()
steps = work()
bpy.app.timers.register(lambda: next(steps, None), first_interval=2)
"""
LIVE = """
import bpy
import numpy as np
from pathlib import Path
FOLDER = Path(bpy.data.filepath).parent
def seen(area):
    image = area.spaces.active.image
    if image is None:
        return "nothing"
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return f"{image.name} {tuple(image.size)} {pixels.std():.4f}"
def work():
    from bl_ext.user_default.wgmb import preview
    window = bpy.context.window_manager.windows[0]
    area = max(window.screen.areas, key=lambda area: area.width * area.height)
    area.type = "IMAGE_EDITOR"
    yield 1
    window.scene.frame_set(5)
    with bpy.context.temp_override(window=window, screen=window.screen, area=area):
        bpy.ops.wgmb.preview()
    for shutter in (1.0, 0.1):
        window.scene.render.motion_blur_shutter = shutter
        yield 1
        while not preview.text().startswith("Preview of frame"):
            yield 0.1
        yield 3
        with (FOLDER / "seen").open("a") as file:
            file.write(seen(area) + "\\n")
    bpy.ops.wm.quit_blender()
steps = work()
bpy.app.timers.register(lambda: next(steps, None), first_interval=2)
"""


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """A folder with a scene, and settings in which the bundle is installed."""
    sys.path.append(str(ROOT / "blender"))
    import build

    folder = tmp_path_factory.mktemp("shot")
    (bundle,) = build.bundle(folder, WHEELS, ("linux-x64",))
    shutil.copy(ROOT / "tests/blender/scenes.py", folder)
    (folder / "install.py").write_text(INSTALL)
    done = blender(folder, "-b", "-P", folder / "install.py", "--", bundle, folder, folder)
    assert (folder / "shot.blend").exists(), done.stdout + done.stderr
    return folder


def environment(folder: Path) -> dict[str, str]:
    return os.environ | {"BLENDER_USER_RESOURCES": str(folder / "settings")}


def blender(folder: Path, *words, **more) -> subprocess.CompletedProcess[str]:
    env = environment(folder) | more
    words = [*PROGRAM, *map(str, words)]
    return subprocess.run(words, env=env, capture_output=True, text=True, timeout=300)


def test_the_command_line(shot):
    """All of it, then without a sharp frame, without a GPU, and with wrong words."""
    file = shot / "shot.blend"
    done = blender(shot, "-b", file, "-c", "wgmb", "--frames", "4-5")
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert "wgmb: 50% Rendering frame 6" in lines and "wgmb: 2 frames blurred" in lines
    names = sorted(p.name for p in shot.glob("*.png"))
    assert names == ["blurred_0004.png", "blurred_0005.png"]
    (shot / "sharp/0005.exr").unlink()
    done = blender(shot, "-b", file, "-c", "wgmb", "--frames", "4-5", "--use-rendered")
    assert done.returncode == 1
    assert f"wgmb: Frame 5: there is no {shot / 'sharp/0005.exr'}" in done.stderr
    none = {"VK_ICD_FILENAMES": "/none", "VK_DRIVER_FILES": "/none"}
    done = blender(shot, "-b", file, "-c", "wgmb", "--use-rendered", **none)
    assert done.returncode == 3
    assert "No Vulkan, Metal or DirectX 12 driver found" in done.stderr
    assert blender(shot, "-b", file, "-c", "wgmb", "--frames", "x").returncode == 2


@pytest.mark.skipif(
    not (shutil.which("Xvfb") and shutil.which("xdotool")), reason="needs Xvfb and xdotool"
)
def test_the_window(shot):
    """Esc stops it, and what is finished stays; then it runs to the end; the window lives."""
    for path in [*shot.glob("*.png"), *shot.glob("sharp/*")]:
        path.unlink()
    (shot / "window.py").write_text(WINDOW)
    words = ["--window-geometry", "0", "0", "800", "600", shot / "shot.blend"]
    with display() as number:
        env = environment(shot) | {"DISPLAY": number}
        words = [*PROGRAM, *map(str, words), "-P", str(shot / "window.py")]
        log = (shot / "log").open("w")
        with log, subprocess.Popen(words, env=env, stdout=log, stderr=log) as program:
            try:
                until(shot, ["ready"], program)
                press(number, "F5")
                until(shot, ["ready", "at work"], program)
                press(number, "Escape")
                told = ["ready", "at work", "as before"]
                until(shot, told, program)
                assert not list(shot.glob("*.png"))
                press(number, "F5")
                until(shot, [*told, "at work", "as before"], program)
                assert program.wait(60) == 0
            finally:
                program.kill()
    assert sorted(p.name for p in shot.glob("*.png")) == [f"blurred_000{n}.png" for n in (4, 5, 6)]
    assert "3 frames blurred" in (shot / "log").read_text()


@pytest.mark.skipif(not shutil.which("Xvfb"), reason="needs Xvfb")
def test_the_live_preview_is_in_the_image_editor_and_follows_the_shutter(shot):
    file = shot / "shot.blend"
    done = blender(shot, "-b", file, "-c", "wgmb", "--frames", "5")
    assert done.returncode == 0, done.stdout + done.stderr
    (shot / "live.py").write_text(LIVE)
    with display() as number:
        words = ["--window-geometry", "0", "0", "800", "600", file, "-P", shot / "live.py"]
        done = blender(shot, *words, DISPLAY=number)
    first, second = (shot / "seen").read_text().splitlines()
    assert first.startswith("Motion Blur: preview (64, 36) "), done.stdout + done.stderr
    assert second.startswith("Motion Blur: preview (64, 36) ") and first != second


@contextlib.contextmanager
def display():
    """A screen that nobody sees; yields its number."""
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(words, pass_fds=[write], **quiet) as server:
        os.close(write)
        try:
            with os.fdopen(read) as file:
                yield f":{file.readline().strip()}"
        finally:
            server.terminate()


def press(number: str, key: str) -> None:
    words = ["xdotool", "mousemove", "400", "300", "key", key]
    subprocess.run(words, env=os.environ | {"DISPLAY": number}, check=True)


def until(shot: Path, lines: list[str], program: subprocess.Popen) -> None:
    """Wait until the window has told these lines."""
    for _ in range(1200):
        told = (shot / "told").read_text().splitlines() if (shot / "told").exists() else []
        if told == lines:
            return
        assert lines[: len(told)] == told, told
        if program.poll() is not None:
            break
        time.sleep(0.1)
    raise AssertionError((shot / "log").read_text()[-3000:])
