"""The output is what Blender would have written: its colours, its formats, its films."""

from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

import scenes
from test_table import compositor, layered
from wgmb_blender import job
from wgmb_blender.changed import changed
from wgmb_blender.settings import wanted_of
from wgmb_blender.wanted import Report, Wanted


def run(scene, *frames: int, **more) -> Report:
    report = Report()
    for _ in job.steps(scene, replace(wanted_of(scene), frames=frames, **more), report):
        pass
    assert (report.done, report.failed) == (list(frames), {})
    return report


@pytest.mark.parametrize("view", ["AgX", "Filmic", "Standard"])
@pytest.mark.parametrize("is_transparent", [False, True], ids=["opaque", "transparent"])
def test_a_png_has_the_colours_of_blenders_own(tmp_path, view, is_transparent):
    scene = scenes.crossing()
    scene.view_settings.view_transform = view
    scene.render.film_transparent = is_transparent
    if is_transparent:
        bpy.data.objects["Wall"].scale = (0.1, 0.1, 1)
    scenes.output(scene, tmp_path, "PNG", "16")
    (path,) = run(scene, 5).files
    want = tmp_path / "truth.png"
    with changed([(scene.render, "use_motion_blur", True), (scene.cycles, "samples", 128),
                  (scene.render, "filepath", str(want))]):  # fmt: skip
        scene.frame_set(5)
        bpy.ops.render.render(write_still=True)
    got, want = scenes.shown(path), scenes.shown(want)
    # 40.6 dB before with AgX; Standard shows the edges' noise with more contrast.
    least = 36.0 if is_transparent else 38.0 if view == "Standard" else 39.5
    if is_transparent:  # a PNG's colours are not premultiplied, so little is known of thin ones
        got[..., :3] *= got[..., 3:]
        want[..., :3] *= want[..., 3:]
    assert scenes.decibels(got[..., :3], want[..., :3]) > least
    if is_transparent:
        assert got[..., 3].min() == 0
        assert scenes.decibels(got[..., 3], want[..., 3]) > 36


def test_a_still_picture_has_the_very_values_of_blenders_own(tmp_path):
    """Pixels that pass through the files and the compositor do not change."""
    scene = scenes.crossing()
    for one in bpy.data.objects:
        one.animation_data_clear()
    scenes.output(scene, tmp_path, "PNG", "16")
    scene.render.dither_intensity = 0
    (path,) = run(scene, 5, method="tap").files
    scene.render.filepath = str(tmp_path / "own.png")
    scene.frame_set(5)
    bpy.ops.render.render(write_still=True)
    assert np.abs(scenes.shown(path) - scenes.shown(tmp_path / "own.png")).max() < 2e-3


FILMS = {
    "MPEG4": (".mp4", b"ftyp"),
    "MKV": (".mkv", b"\x1aE\xdf\xa3"),
    "QUICKTIME": (".mov", b"ft"),
}


@pytest.mark.parametrize("container", FILMS)
def test_a_film_is_in_the_container_that_was_asked_for(tmp_path, container):
    scene = scenes.crossing(size=(64, 36))
    scenes.output(scene, tmp_path, "FFMPEG", None, "RGB", "VIDEO")
    made = scene.render.ffmpeg
    made.format, made.codec, made.constant_rate_factor = container, "H264", "LOSSLESS"
    report = run(scene, 4, 5, 6)
    ending, magic = FILMS[container]
    (path,) = report.files
    assert path.name == f"blurred_0004-0006{ending}"
    assert magic in path.read_bytes()[:12]
    assert sorted(p.name for p in tmp_path.iterdir()) == [path.name, "sharp"]
    assert len(list((tmp_path / "sharp").iterdir())) == 5  # what it was made of is gone
    film = bpy.data.images.load(str(path))
    assert (film.source, film.frame_duration, tuple(film.size)) == ("MOVIE", 3, (64, 36))
    bpy.data.images.remove(film)
    frames = frames_of(path, scene)
    scenes.output(scene, tmp_path, "PNG", "8")
    stills = [scenes.shown(p) for p in run(scene, 4, 5, 6, is_rendering=False).files]
    for i, still in enumerate(stills):
        own = scenes.decibels(frames[i], still[..., :3])
        assert own > 32  # chroma has half the pixels in a film
        assert own > 3 + max(
            scenes.decibels(f, still[..., :3]) for f in frames[:i] + frames[i + 1 :]
        )


def frames_of(path: Path, scene) -> list[np.ndarray]:
    """The values of a film's three frames, as Blender's sequencer has them."""
    other = bpy.data.scenes.new("film")
    try:
        render = other.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = 64, 36, 100
        other.view_settings.view_transform = "Standard"
        image = render.image_settings
        if scenes.FIVE:
            image.media_type = "IMAGE"
        image.file_format, image.color_mode, image.color_depth = "PNG", "RGB", "8"
        render.dither_intensity = 0
        editor = other.sequence_editor_create()
        strips = editor.strips if hasattr(editor, "strips") else editor.sequences
        strips.new_movie("film", str(path), 1, 1)
        other.frame_start, other.frame_end = 1, 3
        render.filepath = str(path.parent / "frame")
        bpy.ops.render.render(animation=True, scene=other.name)
        files = [path.parent / f"frame{n:04d}.png" for n in (1, 2, 3)]
        found = [scenes.shown(file)[..., :3] for file in files]
        for file in files:
            file.unlink()
        return found
    finally:
        bpy.data.scenes.remove(other)


def test_every_second_frame_of_a_film_and_its_sound(tmp_path):
    import wave

    with wave.open(str(tmp_path / "tone.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(48000)
        tone = np.sin(np.arange(48000) * 0.06) * 20000
        file.writeframes(tone.astype("<i2").tobytes())
    scene = scenes.crossing(size=(64, 36))
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    try:
        strips.new_sound("tone", str(tmp_path / "tone.wav"), 1, 1)
    except RuntimeError as error:
        pytest.skip(str(error))  # the module of 4.2 is compiled without sound
    scenes.output(scene, tmp_path, "FFMPEG", None, "RGB", "VIDEO")
    made = scene.render.ffmpeg
    made.format, made.codec, made.audio_codec = "MPEG4", "H264", "AAC"
    scene.frame_end, scene.frame_step = 8, 2
    report = run(scene, 4, 6, 8, handles=False)
    film = bpy.data.images.load(str(report.files[0]))
    assert film.frame_duration == 3
    bpy.data.images.remove(film)
    assert b"mp4a" in report.files[0].read_bytes()
    assert len(strips) == 1


def test_a_multilayer_file_keeps_the_other_passes(tmp_path):
    from wgmb.io import exr

    scene = scenes.crossing(size=(64, 36))
    scene.view_layers[0].use_pass_z = True
    scene.view_layers[0].use_pass_object_index = True
    scenes.output(scene, tmp_path, "OPEN_EXR", "32")
    (plain,) = run(scene, 5).files
    scenes.output(scene, tmp_path, "OPEN_EXR_MULTILAYER", "16", media="MULTI_LAYER_IMAGE")
    scene.render.image_settings.exr_codec = "DWAA"
    scene.render.filepath = str(tmp_path / "layers_")
    (path,) = run(scene, 5, is_rendering=False).files
    got = exr.read(path).channels()
    layers = {name.split(".")[1] for name in got}
    index = "Object Index" if scenes.FIVE else "IndexOB"
    assert {"Combined", "Depth", index} <= layers
    assert not layers & {"Vector", "CryptoObject00"}  # which only the blur needed
    sharp = exr.read(tmp_path / "sharp" / "sharp_0005.exr").channels()
    for name in ("ViewLayer.Depth.Z", f"ViewLayer.{index}.X"):
        assert got[name].dtype == np.float32 and np.array_equal(got[name], sharp[name])
    blurred = np.dstack([got[f"ViewLayer.Combined.{c}"] for c in "RGBA"])
    assert blurred.dtype == np.float16
    assert scenes.psnr(blurred.astype(np.float32), scenes.pixels(plain)) > 45  # DWAA is lossy
    image = bpy.data.images.load(str(path))  # Blender reads it too
    image.size[:]  # which loads it
    assert image.type == "MULTILAYER"
    bpy.data.images.remove(image)


def test_a_multilayer_file_of_two_layers_and_a_compositor(tmp_path):
    from wgmb.io import exr

    scene = layered()
    scenes.output(scene, tmp_path, "OPEN_EXR", "32")
    (plain,) = run(scene, 5, method="tap").files
    scenes.output(scene, tmp_path, "OPEN_EXR_MULTILAYER", "32", media="MULTI_LAYER_IMAGE")
    scene.render.filepath = str(tmp_path / "layers_")
    (path,) = run(scene, 5, is_rendering=False, method="tap").files
    got = exr.read(path).channels()
    assert {name.rpartition(".")[0] for name in got if "Combined" in name} == {
        "Composite.Combined", "back.Combined", "front.Combined",
    }  # fmt: skip
    both = np.dstack([got[f"Composite.Combined.{c}"] for c in "RGBA"])
    assert np.abs(both - scenes.pixels(plain)).max() < 1e-5
    front = np.dstack([got[f"front.Combined.{c}"] for c in "RGBA"])
    sharp = scenes.pixels(tmp_path / "sharp" / "sharp_0005.exr", "front.Combined")
    assert np.abs(front - sharp).max() > 0.3


def test_nodes_that_need_other_passes_get_them(tmp_path):
    """A compositor of depth: what is not blurred is as rendered, in its place with overscan too."""
    scene = scenes.crossing(size=(64, 36))
    scene.view_layers[0].use_pass_z = True
    tree, end = compositor(scene)
    node, divide = tree.nodes.new("CompositorNodeRLayers"), math_node(tree)
    divide.operation = "DIVIDE"
    divide.inputs[1].default_value = 20.0
    tree.links.new(node.outputs["Depth"], divide.inputs[0])
    tree.links.new(divide.outputs[0], end)
    scenes.output(scene, tmp_path)
    (path,) = run(scene, 5, overscan=5).files
    got = scenes.pixels(path)[..., 0]
    (path,) = run(scene, 5, composited=True).files
    from wgmb.io import exr

    depth = exr.read(tmp_path / "sharp" / "sharp_0005.exr").channels()["ViewLayer.Depth.Z"]
    assert np.median(np.abs(got - depth / 20)) < 1e-3
    assert np.abs(np.roll(got, 1, 1) - depth / 20).mean() > np.abs(got - depth / 20).mean()


def math_node(tree):
    for kind in ("CompositorNodeMath", "ShaderNodeMath"):  # 5.0 shares those of shaders
        try:
            return tree.nodes.new(kind)
        except RuntimeError:
            continue
    raise AssertionError("no math node")


def test_what_a_wanted_is_by_default():
    assert Wanted().method == "gather"
