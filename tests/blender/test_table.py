"""The add-on's results against the path tracer's own blur, feature by feature.

The figures are PSNR in dB of sRGB values, of `gather` with 16 samples a pixel on sharp frames of 16
samples against 128 samples of Cycles' blur, and were measured with bpy 4.5.15. A result may be
better than they are, and half a decibel worse.
"""

import math
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

import scenes
from wgmb_blender import job
from wgmb_blender.wanted import Report, Wanted

SLACK = 0.5


def blurred(scene, folder: Path, *frames: int, **more) -> list[np.ndarray]:
    """The add-on's results for these frames, as linear light."""
    scenes.output(scene, folder)
    wanted = Wanted(frames=frames, sharp=scene.wgmb.sharp, **more)
    report = Report()
    for _ in job.steps(scene, wanted, report):
        pass
    assert (report.done, report.failed) == (list(frames), {})
    blurred.report = report
    return [scenes.pixels(path) for path in report.files]


def reaches(got: float, figure: float):
    assert got > figure - SLACK, f"{got:.2f} dB, {figure} before"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Sharp frames 3 to 6 of the crossing, which many tests blur in their own way."""
    place = tmp_path_factory.mktemp("crossing")
    import wgmb_blender

    wgmb_blender.register()
    scene = scenes.crossing()
    scenes.output(scene, place)
    wanted = Wanted(frames=(4, 5), sharp=scene.wgmb.sharp, is_blurring=False)
    for _ in job.steps(scene, wanted, Report()):
        pass
    wgmb_blender.unregister()
    assert len(list(place.rglob("*.exr"))) == 4
    return place


# ---- the exposure ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("position", "shutter", "figure"),
    [
        ("START", 0.5, 37.9),
        ("CENTER", 0.5, 39.1),
        ("END", 0.5, 37.5),
        ("START", 1.0, 39.0),
        ("CENTER", 1.0, 40.0),
        ("END", 1.0, 38.7),
    ],
)
def test_position_and_length_of_the_shutter(folder, tmp_path, position, shutter, figure):
    scene = scenes.crossing()
    scene.render.motion_blur_position, scene.render.motion_blur_shutter = position, shutter
    (got,) = blurred(scene, folder, 5, is_rendering=False)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), figure)


def test_the_curve_of_the_shutter(folder, tmp_path):
    scene = scenes.crossing()
    scene.render.motion_blur_shutter = 1.0
    mapping = scene.render.motion_blur_shutter_curve
    mapping.initialize()
    points = mapping.curves[0].points
    points[0].location, points[-1].location = (0, 0), (1, 0)
    mapping.update()
    (got,) = blurred(scene, folder, 5, is_rendering=False)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), 39.9)


@pytest.mark.parametrize(("duration", "figure"), [(0.1, 35.7), (0.5, 38.6)])
def test_a_rolling_shutter(folder, tmp_path, duration, figure):
    scene = scenes.crossing()
    scene.render.motion_blur_shutter = 1.0
    scene.cycles.rolling_shutter_type = "TOP"
    scene.cycles.rolling_shutter_duration = duration
    (got,) = blurred(scene, folder, 5, is_rendering=False)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), figure)


# ---- the frames -----------------------------------------------------------------------------


def test_the_first_frame_with_a_handle_without_and_alone(folder, tmp_path):
    scene = scenes.crossing()
    want = scenes.truth(scene, 4, tmp_path / "truth")
    (got,) = blurred(scene, folder, 4, is_rendering=False)
    reaches(scenes.psnr(got, want), 38.5)
    first, _ = blurred(scene, tmp_path, 4, 5, handles=False)
    reaches(scenes.psnr(first, want), 38.2)
    assert not (tmp_path / "sharp" / "sharp_0003.exr").exists()
    # What lies there from before is no neighbour of a frame that is rendered without handles.
    (alone,) = blurred(scene, tmp_path, 4, handles=False)
    reaches(scenes.psnr(alone, want), 38.1)
    assert not np.array_equal(alone, first)


def test_keys_that_begin_with_the_frame(tmp_path):
    """A kink in the path: three positions cannot tell it from a smooth turn."""
    scene = scenes.crossing()
    for one in (o for o in bpy.data.objects if o.animation_data):
        for curve in scenes.curves_of(one):
            for key in [k for k in curve.keyframe_points if k.co[0] < 4][::-1]:
                curve.keyframe_points.remove(key)
    (got,) = blurred(scene, tmp_path, 4)
    reaches(scenes.psnr(got, scenes.truth(scene, 4, tmp_path / "truth")), 33.9)


def test_every_second_frame(folder, tmp_path):
    scene = scenes.crossing()
    scene.frame_start, scene.frame_end, scene.frame_step = 3, 5, 2
    scenes.output(scene, tmp_path)
    wanted = Wanted(sharp=scene.wgmb.sharp, handles=False)
    report = Report()
    for _ in job.steps(scene, wanted, report):
        pass
    assert report.done == [3, 5]
    got = scenes.pixels(tmp_path / "blurred_0005.exr")
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), 38.9)
    sharp = "sharp/sharp_0005.exr"
    a, b = (scenes.pixels(place / sharp, "ViewLayer.Combined") for place in (tmp_path, folder))
    assert np.array_equal(a, b)
    a, b = (vectors(place / sharp) for place in (tmp_path, folder))
    assert np.array_equal(a, b)  # of one frame, whatever the step


def vectors(path: Path) -> np.ndarray:
    from wgmb.io import exr

    channels = exr.read(path).channels()
    return np.dstack([channels[f"ViewLayer.Vector.{c}"] for c in "XYZW"])


def test_time_that_is_stretched(folder, tmp_path):
    scene = scenes.crossing()
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 200
    (got,) = blurred(scene, tmp_path, 10)
    reaches(scenes.psnr(got, scenes.truth(scene, 10, tmp_path / "truth")), 39.1)
    slow, fast = (
        np.abs(vectors(place / "sharp" / f"sharp_{n:04d}.exr")).mean()
        for place, n in ((tmp_path, 10), (folder, 5))
    )
    assert slow / fast == pytest.approx(0.5, abs=1e-3)


def test_a_cut_between_the_cameras_of_two_markers(tmp_path):
    scene = scenes.crossing()
    bpy.ops.object.camera_add(location=(3, -7, 1.5), rotation=(math.radians(80), 0, 0.4))
    other = bpy.context.object
    other.data.lens = 40
    scene.timeline_markers.new("a", frame=0).camera = scene.camera
    scene.timeline_markers.new("b", frame=6).camera = other
    before, after = blurred(scene, tmp_path, 5, 6)
    assert "Camera cut before frame 6" in blurred.report.notes
    for n, got in ((5, before), (6, after)):
        reaches(scenes.psnr(got, scenes.truth(scene, n, tmp_path / f"truth{n}")), 39.1)


# ---- the picture ----------------------------------------------------------------------------


def inner(picture: np.ndarray) -> np.ndarray:
    """The part of 160 x 90 pixels that the render region of the tests shows."""
    return picture[18:72, 40:120]


@pytest.mark.parametrize("is_cropped", [False, True], ids=["in the picture", "cropped"])
def test_a_render_region(tmp_path, is_cropped):
    scene = scenes.crossing()
    render = scene.render
    render.use_border, render.use_crop_to_border = True, is_cropped
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.2, 0.8
    (got,) = blurred(scene, tmp_path, 5)
    want = scenes.truth(scene, 5, tmp_path / "truth")
    assert got.shape == want.shape == ((54, 80, 4) if is_cropped else (90, 160, 4))
    if not is_cropped:
        outside = np.ones((90, 160), bool)
        outside[18:72, 40:120] = False
        assert not got[outside].any() and not want[outside].any()
        got, want = inner(got), inner(want)
    reaches(scenes.psnr(got, want), 36.3)
    (got,) = blurred(scene, tmp_path, 5, overscan=20)  # what is around the region is known
    got = got if is_cropped else inner(got)
    reaches(scenes.psnr(got, want), 36.3)


def edges(picture: np.ndarray) -> np.ndarray:
    return np.hstack([picture[:, :12], picture[:, -12:]])


def panning():
    """The crossing seen by a camera that pans fast, for a whole frame."""
    scene = scenes.crossing()
    scene.render.motion_blur_shutter = 1.0
    scenes.animate(scene.camera, "location", lambda n: (0.5 * n - 2.5, -8, 0.1 * n))
    return scene


def test_overscan_brings_in_what_comes_from_outside(tmp_path):
    scene = panning()
    want = scenes.truth(scene, 5, tmp_path / "truth")
    (plain,) = blurred(scene, tmp_path, 5)
    (wider,) = blurred(scene, tmp_path, 5, overscan=16)
    assert wider.shape == want.shape
    reaches(scenes.psnr(plain, want), 39.7)
    reaches(scenes.psnr(wider, want), 39.9)
    reaches(scenes.psnr(edges(wider), edges(want)), 42.4)
    assert scenes.psnr(edges(wider), edges(want)) > scenes.psnr(edges(plain), edges(want)) + 0.3


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
def test_overscan_leaves_every_pixel_where_it_was(tmp_path, fit, kind):
    """Also where the lens is shifted and the picture is taller than wide."""
    scene = scenes.crossing(size=(40, 64) if fit == "AUTO" else (64, 40))
    lens = scene.camera.data
    lens.type, lens.sensor_fit, lens.ortho_scale = kind, fit, 5.0
    lens.shift_x, lens.shift_y = 0.1, -0.07
    scene.render.motion_blur_shutter = 0.0
    (plain,) = blurred(scene, tmp_path, 5, handles=False, method="tap")
    (wider,) = blurred(scene, tmp_path, 5, handles=False, method="tap", overscan=9)
    assert plain.shape == wider.shape
    assert scenes.psnr(wider, plain) > 27  # one pixel off is under 20
    for x, y in ((1, 0), (0, 1)):
        assert scenes.psnr(np.roll(wider, (y, x), (0, 1)), plain) < scenes.psnr(wider, plain) - 4


# ---- what is in it --------------------------------------------------------------------------


def test_a_transparent_film(tmp_path):
    scene = scenes.crossing()
    scene.render.film_transparent = True
    (got,) = blurred(scene, tmp_path, 5)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), 39.1)
    bpy.data.objects.remove(bpy.data.objects["Wall"])
    (got,) = blurred(scene, tmp_path, 5)
    want = scenes.truth(scene, 5, tmp_path / "nothing")
    reaches(scenes.psnr(got, want), 36.6)
    reaches(scenes.decibels(got[..., 3], want[..., 3]), 36.9)


@pytest.mark.parametrize(("opacity", "figure"), [(0.3, 40.4), (0.6, 40.1)])
def test_a_transparent_shader(tmp_path, opacity, figure):
    scene = scenes.crossing()
    made = bpy.data.materials.new("glass")
    made.use_nodes = True
    nodes, link = made.node_tree.nodes, made.node_tree.links.new
    nodes.clear()
    mix, out = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeOutputMaterial")
    light = nodes.new("ShaderNodeEmission")
    light.inputs[0].default_value = (0.9, 0.2, 0.1, 1)
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    link(light.outputs[0], mix.inputs[2])
    link(mix.outputs[0], out.inputs[0])
    mix.inputs[0].default_value = opacity
    bpy.data.objects["Cube"].data.materials[0] = made
    (got,) = blurred(scene, tmp_path, 5)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), figure)


def test_a_body_that_changes_its_shape(tmp_path):
    scene = scenes.crossing(camera_moves=False)
    ball = bpy.data.objects["Ball"]
    ball.animation_data_clear()
    ball.location = (0.8, -1, -0.4)
    ball.shape_key_add(name="Basis")
    shape = ball.shape_key_add(name="bent")
    for point in shape.data:
        point.co = (point.co.x + 1.6 * point.co.z, point.co.y, point.co.z + 0.3)
    for n in range(-3, 20):
        shape.value = 0.5 + 0.5 * math.sin(n * 0.9)
        shape.keyframe_insert("value", frame=n)
    (got,) = blurred(scene, tmp_path, 5)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), 39.4)


def test_hair(tmp_path):
    scene = scenes.crossing(camera_moves=False)
    ball = bpy.data.objects["Ball"]
    ball.modifiers.new("hair", "PARTICLE_SYSTEM")
    hair = ball.particle_systems[0].settings
    hair.type, hair.count, hair.hair_length, hair.root_radius = "HAIR", 400, 0.5, 0.6
    scene.cycles_curves.shape = "THICK"
    (got,) = blurred(scene, tmp_path, 5)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), 37.2)


def test_particles(tmp_path):
    scene = scenes.crossing(camera_moves=False)
    for name in ("Cube", "Ball"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.ops.mesh.primitive_ico_sphere_add(radius=0.25, location=(0, 50, 0))
    drop = bpy.context.object
    drop.data.materials.append(scenes.glow((1, 0.8, 0.1)))
    bpy.ops.mesh.primitive_plane_add(size=3, location=(0, -1, 2))
    cloud = bpy.context.object
    cloud.show_instancer_for_render = False
    cloud.modifiers.new("rain", "PARTICLE_SYSTEM")
    rain = cloud.particle_systems[0].settings
    rain.count, rain.frame_start, rain.frame_end, rain.lifetime = 80, -20, 0, 100
    rain.render_type, rain.instance_object, rain.particle_size = "OBJECT", drop, 1.0
    rain.normal_factor = 0
    for n in range(-20, 8):
        scene.frame_set(n)  # what bakes them here
    (got,) = blurred(scene, tmp_path, 5)
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), 37.3)


@pytest.mark.parametrize("method", ["tap", "tiles", "reproject"])
def test_the_other_methods(folder, tmp_path, method):
    scene = scenes.crossing()
    (got,) = blurred(scene, folder, 5, is_rendering=False, method=method)
    figure = {"tap": 32.7, "tiles": 33.0, "reproject": 37.5}[method]
    reaches(scenes.psnr(got, scenes.truth(scene, 5, tmp_path / "truth")), figure)


def test_collections_that_stay_sharp(folder, tmp_path):
    """Also what they instance; their objects are found by name in the Cryptomatte."""
    scene = scenes.crossing()
    held, shared = bpy.data.collections.new("held"), bpy.data.collections.new("shared")
    scene.collection.children.link(held)
    held.objects.link(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_cube_add(size=0.5)
    box = bpy.context.object
    box.name = "Box [a*]"
    box.data.materials.append(scenes.glow((0.1, 0.1, 0.9), (0.9, 0.9, 0.1)))
    scene.collection.objects.unlink(box)
    shared.objects.link(box)
    bpy.ops.object.collection_instance_add(collection="shared", location=(1.2, -2, 0.6))
    held.objects.link(bpy.context.object)
    scenes.animate(bpy.context.object, "location", lambda n: (2.0 - 0.2 * n, -2, 0.6))
    (all_blurred,) = blurred(scene, tmp_path, 5)
    (got,) = blurred(scene, tmp_path, 5, kept=("held",))
    sharp = scenes.pixels(tmp_path / "sharp" / "sharp_0005.exr")
    from wgmb.io import exr

    channels = exr.read(tmp_path / "sharp" / "sharp_0005.exr").channels()
    depth = channels["ViewLayer.Depth.Z"]
    scene.frame_set(5)
    near = depth < 8.6  # the cube, the box and the ball
    same = np.abs(got - sharp).max(2) < 2e-3
    was_blurred = np.abs(all_blurred - sharp).max(2) > 0.02
    red = near & (sharp[..., 0] > 1.5 * sharp[..., 1])
    blue = near & (sharp[..., 2] > 1.5 * sharp[..., :2].max(2))  # the ball is green
    green = near & (sharp[..., 1] > 1.5 * sharp[..., 0])
    for kept in (red, blue):
        assert (kept & was_blurred).sum() > 20
        assert same[kept & was_blurred].mean() > 0.7  # less where it covers a part of a pixel
    assert same[green & was_blurred].mean() < 0.5  # the ball is blurred, but where the cube is
    assert not scene.view_layers[0].use_pass_cryptomatte_object


# ---- view layers and the compositor ---------------------------------------------------------


def compositor(scene):
    """A new compositor: its tree, and the socket that takes the picture."""
    if scenes.FIVE:
        tree = bpy.data.node_groups.new("comp", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        scene.compositing_node_group = tree
        return tree, tree.nodes.new("NodeGroupOutput").inputs[0]
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree, scene.node_tree.nodes.new("CompositorNodeComposite").inputs[0]


def layered():
    """The wall in one view layer, all else in another, put together by the compositor."""
    scene = scenes.crossing()
    back, front = (bpy.data.collections.new(name) for name in ("back", "front"))
    for collection in (back, front):
        scene.collection.children.link(collection)
    for one in [o for o in scene.collection.objects if o.type == "MESH"]:
        (back if one.name == "Wall" else front).objects.link(one)
        scene.collection.objects.unlink(one)
    scene.view_layers[0].name = "back"
    scene.view_layers.new("front")
    scene.view_layers["back"].layer_collection.children["front"].exclude = True
    scene.view_layers["front"].layer_collection.children["back"].exclude = True
    scene.render.film_transparent = True
    tree, end = compositor(scene)
    over = tree.nodes.new("CompositorNodeAlphaOver")
    pictures = [socket for socket in over.inputs if socket.type == "RGBA"]
    for name, socket in zip(("back", "front"), pictures, strict=True):
        node = tree.nodes.new("CompositorNodeRLayers")
        node.layer = name
        tree.links.new(node.outputs["Image"], socket)
    tree.links.new(over.outputs[0], end)
    return scene


def test_view_layers_are_blurred_apart_and_then_composited(tmp_path):
    scene = layered()
    nodes = len(compositor_nodes(scene))
    (got,) = blurred(scene, tmp_path, 5)
    assert len(compositor_nodes(scene)) == nodes
    want = scenes.truth(scene, 5, tmp_path / "truth")
    reaches(scenes.psnr(got, want), 39.5)
    assert scenes.psnr(got, want) > scenes.psnr(
        scenes.pixels(tmp_path / "sharp" / "sharp_0005.exr", "back.Combined"), want
    )


def compositor_nodes(scene):
    tree = scene.compositing_node_group if scenes.FIVE else scene.node_tree
    return list(tree.nodes)


def test_without_a_compositor_the_first_view_layer_is_the_picture(tmp_path):
    """As in Blender."""
    scene = layered()
    scene.render.use_compositing = False
    (got,) = blurred(scene, tmp_path, 5)
    want = scenes.truth(scene, 5, tmp_path / "truth")
    reaches(scenes.psnr(got, want), 40.0)


@pytest.mark.parametrize("composited", [False, True], ids=["before", "after"])
def test_a_compositor_that_makes_all_darker(tmp_path, composited):
    scene = scenes.crossing()
    tree, end = compositor(scene)
    node, darker = (tree.nodes.new(f"CompositorNode{k}") for k in ("RLayers", "Exposure"))
    darker.inputs["Exposure"].default_value = -1.0
    tree.links.new(node.outputs["Image"], darker.inputs[0])
    tree.links.new(darker.outputs[0], end)
    (got,) = blurred(scene, tmp_path, 5, composited=composited)
    want = scenes.truth(scene, 5, tmp_path / "truth")
    reaches(scenes.psnr(got, want), 40.6)
    scene.render.use_compositing = False
    (plain,) = blurred(scene, tmp_path, 5)
    assert scenes.psnr(got, plain / 2) > 55


# ---- stereo ---------------------------------------------------------------------------------


def test_both_eyes(tmp_path):
    scene = scenes.crossing()
    scene.render.use_multiview = True
    scene.camera.data.stereo.interocular_distance = 0.6
    scenes.output(scene, tmp_path)
    scene.render.image_settings.views_format = "INDIVIDUAL"
    report = Report()
    for _ in job.steps(scene, Wanted(frames=(5,), sharp=scene.wgmb.sharp), report):
        pass
    assert [p.name for p in report.files] == ["blurred_0005_L.exr", "blurred_0005_R.exr"]
    with pytest.raises(Exception, match="no such file"):
        scenes.truth(scene, 5, tmp_path / "truth")  # which looks for one file
    left, right = (scenes.pixels(path) for path in report.files)
    for eye, got in (("L", left), ("R", right)):
        reaches(scenes.psnr(got, scenes.pixels(tmp_path / f"truth_{eye}.exr")), 38.5)
    assert scenes.psnr(left, right) < 25
    scene.render.image_settings.views_format = "STEREO_3D"
    scene.render.image_settings.stereo_3d_format.display_mode = "SIDEBYSIDE"
    again = Report()
    wanted = Wanted(frames=(5,), sharp=scene.wgmb.sharp, is_rendering=False)
    for _ in job.steps(scene, wanted, again):
        pass
    both = scenes.pixels(again.files[0])
    assert both.shape == (90, 320, 4)
    assert max(scenes.psnr(both, np.hstack(p)) for p in ((left, right), (right, left))) > 60


def test_the_defaults_are_those_of_the_panel():
    scene = scenes.crossing()
    from wgmb_blender.settings import wanted_of

    assert wanted_of(scene) == replace(Wanted(), sharp="//sharp/")
