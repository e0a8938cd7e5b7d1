"""The live preview, and the passes of light that the add-on asks for."""

import time

import bpy
import numpy as np
import pytest

import scenes
from wgmb_blender import job, preview
from wgmb_blender.comparison import PREVIEW, show
from wgmb_blender.sharp import LIGHT_PASSES
from wgmb_blender.wanted import Report, Wanted

LIGHT = set(LIGHT_PASSES.values())


def run(scene, **more):
    report = Report()
    for _ in job.steps(scene, Wanted(sharp=scene.wgmb.sharp, **more), report):
        pass
    assert not report.failed
    return report.files


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Sharp frames 3 to 6."""
    import wgmb_blender

    place = tmp_path_factory.mktemp("preview")
    wgmb_blender.register()
    scene = scenes.crossing()
    scenes.output(scene, place)
    run(scene, frames=(4, 5), is_blurring=False)
    wgmb_blender.unregister()
    return place


@pytest.fixture
def scene(folder):
    scene = scenes.crossing()
    scenes.output(scene, folder)
    scene.frame_set(5)
    yield scene
    preview.end()


@pytest.fixture
def pictures(monkeypatch):
    """The images of the preview, in their order."""
    shown = []
    own = preview.show
    monkeypatch.setattr(preview, "show", lambda rgba, name: shown.append(rgba) or own(rgba, name))
    return shown


def test_an_image_keeps_its_place_in_an_editor_when_its_size_changes():
    small = show(np.zeros((9, 16, 4), np.float32), "sized")
    whole = np.random.default_rng(0).random((18, 40, 4)).astype(np.float32)
    assert show(whole, "sized") == small and tuple(small.size) == (40, 18)
    pixels = np.empty(whole.size, np.float32)
    small.pixels.foreach_get(pixels)
    np.testing.assert_array_equal(pixels.reshape(whole.shape)[::-1], whole)
    bpy.data.images.remove(small)


def until(count: int, pictures: list) -> np.ndarray:
    """Tick as Blender's timers do, until so many pictures were shown; returns the last one."""
    end = time.monotonic() + 100
    while len(pictures) < count:
        assert preview.tick() and time.monotonic() < end, preview.text()
        time.sleep(0.01)
    preview.tick()
    return pictures[-1]


def test_it_shows_what_the_run_would_write_and_follows_shutter_and_frame(scene, tmp_path, pictures):
    assert bpy.ops.wgmb.preview() == {"FINISHED"}
    first = until(2, pictures)  # the first is black
    assert preview.text() == "Preview of frame 5"
    image = bpy.data.images[PREVIEW]
    assert tuple(image.size) == first.shape[1::-1]
    got = np.empty(first.size, np.float32)
    image.pixels.foreach_get(got)
    assert np.array_equal(got.reshape(first.shape)[::-1], first)
    scene.render.filepath = str(tmp_path / "blurred_")
    (path,) = run(scene, frames=(5,), is_rendering=False, light="AUTO")
    assert np.allclose(scenes.pixels(path), first[..., : scenes.pixels(path).shape[2]], atol=1e-6)
    scene.render.motion_blur_shutter = 1.0
    longer = until(3, pictures)
    assert not np.allclose(longer, first, atol=0.01)
    scene.render.motion_blur_shutter = 0.5
    assert np.array_equal(until(4, pictures), first)
    scene.frame_set(4)
    assert not np.allclose(until(5, pictures), first, atol=0.01)
    assert preview.text() == "Preview of frame 4"
    for _ in range(5):  # nothing has changed
        preview.tick()
    assert len(pictures) == 5


def test_a_frame_without_a_sharp_file_is_a_sentence_and_the_next_one_is_shown(scene, pictures):
    scene.frame_set(20)
    bpy.ops.wgmb.preview()
    preview.tick()
    preview.tick()
    assert preview.text() == "Frame 20 has no sharp file yet: Render and Blur makes it"
    scene.frame_set(5)
    until(2, pictures)
    assert preview.text() == "Preview of frame 5"


def test_it_ends_by_its_button_before_a_run_and_before_a_file_is_loaded(scene, tmp_path):
    for ending in (
        bpy.ops.wgmb.preview,
        bpy.ops.wgmb.blur_rendered,
        lambda: bpy.ops.wm.read_homefile(use_empty=True),
    ):
        scene = bpy.context.scene
        scene.render.filepath = str(tmp_path / "blurred_")
        bpy.ops.wgmb.preview()
        assert preview.is_on() and bpy.app.timers.is_registered(preview.tick)
        preview.tick()
        ending()
        assert not preview.is_on() and not bpy.app.timers.is_registered(preview.tick)


@pytest.mark.parametrize(
    ("light", "method", "has"),
    [("ON", "gather", True), ("AUTO", "gather", False), ("OFF", "gather", False),
     ("ON", "tap", False)],
)  # fmt: skip
def test_passes_of_light_are_rendered_where_they_are_used(tmp_path, light, method, has):
    """Without a GPU, they are rendered if they are asked for."""
    from wgmb.io import exr

    scene = scenes.crossing()
    scenes.output(scene, tmp_path, "OPEN_EXR_MULTILAYER", media="MULTI_LAYER_IMAGE")
    (path,) = run(scene, frames=(5,), handles=False, light=light, method=method)
    sharp = exr.read(tmp_path / "sharp" / "sharp_0005.exr", header_only=True)
    names = {name.split(".")[1] for part in sharp.parts for name in part.channels}
    assert (names >= LIGHT) if has else not (LIGHT & names)
    written = {name.split(".")[1] for name in exr.read(path).channels()}
    assert not LIGHT & written  # they were switched on for the blur alone
    assert not scene.view_layers[0].use_pass_diffuse_direct


def test_a_shadow_follows_its_body(tmp_path):
    """A lamp above a ball that crosses: off, on, and the truth."""
    scene = scenes.crossing(camera_moves=False)
    for one in bpy.data.materials:
        tree = one.node_tree
        emission = next(n for n in tree.nodes if n.type == "EMISSION")
        surface = tree.nodes.new("ShaderNodeBsdfDiffuse")
        for link in list(emission.inputs[0].links):
            tree.links.new(link.from_socket, surface.inputs[0])
        surface.inputs[0].default_value = emission.inputs[0].default_value
        output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
        tree.links.new(surface.outputs[0], output.inputs[0])
    bpy.ops.object.light_add(type="SUN", rotation=(0.9, 0.5, 0))
    bpy.context.object.data.energy = 4
    scene.cycles.samples = 32
    scenes.output(scene, tmp_path)
    scene.render.motion_blur_shutter = 1.0
    want = scenes.truth(scene, 5, tmp_path / "truth")
    scores = {}
    for light in ("OFF", "ON"):
        scenes.output(scene, tmp_path / light)
        (path,) = run(scene, frames=(5,), light=light)
        scores[light] = scenes.psnr(scenes.pixels(path), want)
    print(scores)
    assert scores["ON"] > scores["OFF"], scores
