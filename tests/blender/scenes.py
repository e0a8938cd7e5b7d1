"""A small scene in motion, 160 x 90, of emission only, so that all noise is of edges.

A textured wall, a turning cube and a ball that cross, and a camera that may pan. Every key is
linear, so the paths between frames are straight but for the turning.
"""

import math
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

SIZE = 160, 90
SHARP, TRUTH = 16, 128  # samples a pixel
FIVE = bpy.app.version >= (5, 0, 0)


def glow(a, b=None, scale=4.0):
    """A material that shines in one colour, or in a checker of two."""
    made = bpy.data.materials.new("glow")
    made.use_nodes = True
    nodes, link = made.node_tree.nodes, made.node_tree.links.new
    nodes.clear()
    light, out = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    link(light.outputs[0], out.inputs[0])
    light.inputs[0].default_value = (*a, 1)
    if b is not None:
        checker, place = nodes.new("ShaderNodeTexChecker"), nodes.new("ShaderNodeTexCoord")
        checker.inputs["Color1"].default_value = (*a, 1)
        checker.inputs["Color2"].default_value = (*b, 1)
        checker.inputs["Scale"].default_value = scale
        link(place.outputs["Object"], checker.inputs["Vector"])
        link(checker.outputs[0], light.inputs[0])
    return made


def curves_of(data):
    """The animation curves of something."""
    action = data.animation_data.action
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    return [
        curve
        for layer in action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        for curve in bag.fcurves
    ]


def animate(data, path: str, value: Callable[[int], object], frames=range(-3, 40)):
    """A linear key at every frame."""
    for n in frames:
        setattr(data, path, value(n))
        data.keyframe_insert(path, frame=n)
    for curve in curves_of(data):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def crossing(*, camera_moves=True, size=SIZE):
    """The scene; frames 4 to 6, a centred shutter of half a frame."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine, render.fps = "CYCLES", 24
    (render.resolution_x, render.resolution_y), render.resolution_percentage = size, 100
    cycles.device, cycles.samples, cycles.max_bounces = "CPU", SHARP, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.3, 0.45, 0.7, 1)
    scene.view_layers[0].name = "ViewLayer"
    primitive = bpy.ops.mesh
    primitive.primitive_plane_add(size=40, location=(0, 6, 0), rotation=(math.pi / 2, 0, 0))
    bpy.context.object.data.materials.append(glow((0.08, 0.12, 0.2), (0.5, 0.45, 0.35), 1.2))
    bpy.context.object.name = "Wall"
    primitive.primitive_cube_add(size=1.4)
    cube = bpy.context.object
    cube.data.materials.append(glow((0.8, 0.1, 0.05), (0.95, 0.9, 0.6), 3))
    animate(cube, "location", lambda n: (-2.4 + 0.42 * n, 0, 0.5))
    animate(cube, "rotation_euler", lambda n: (0, 0.12 * n, 0.3))
    primitive.primitive_uv_sphere_add(radius=0.7)
    ball = bpy.context.object
    ball.name = "Ball"
    ball.data.materials.append(glow((0.05, 0.3, 0.1), (0.5, 0.9, 0.3), 3))
    animate(ball, "location", lambda n: (2.2 - 0.3 * n, -1.0, -0.8))
    bpy.ops.object.camera_add(location=(0, -8, 0), rotation=(math.pi / 2, 0, 0))
    scene.camera = bpy.context.object
    scene.camera.data.lens = 38
    if camera_moves:
        animate(scene.camera, "location", lambda n: (0.12 * n - 0.6, -8, 0.02 * n))
    scene.frame_start, scene.frame_end = 4, 6
    render.motion_blur_shutter, render.motion_blur_position = 0.5, "CENTER"
    return scene


def output(scene, folder: Path, kind="OPEN_EXR", depth="32", mode="RGBA", media="IMAGE"):
    """Ask for files of a kind, called `blurred_####`, and for sharp ones beside them."""
    image = scene.render.image_settings
    if FIVE:
        image.media_type = media
    image.file_format = kind
    image.color_mode = mode
    if depth:
        image.color_depth = depth
    scene.render.filepath = str(folder / "blurred_")
    if hasattr(scene, "wgmb"):
        scene.wgmb.sharp = str(folder / "sharp" / "sharp_")


def truth(scene, number: int, path: Path, samples=TRUTH) -> np.ndarray:
    """Cycles' own blur of a frame: (height, width, 4) linear light."""
    from wgmb_blender.changed import changed

    render, image = scene.render, scene.render.image_settings
    changes = [(layer, "use_pass_vector", False) for layer in scene.view_layers]
    changes += [(render, "use_motion_blur", True), (scene.cycles, "samples", samples)]
    changes += [(image, "media_type", "IMAGE")] if FIVE else []
    changes += [(image, "file_format", "OPEN_EXR"), (image, "color_depth", "32")]
    changes += [(image, "color_mode", "RGBA"), (render, "filepath", str(path))]
    changes += [(render, "use_file_extension", True), (image, "views_format", "INDIVIDUAL")]
    with changed(changes):
        scene.frame_set(number)
        bpy.ops.render.render(write_still=True, scene=scene.name)
    return pixels(path.with_name(path.name + ".exr"))


def pixels(path: Path, layer: str | None = None) -> np.ndarray:
    """The picture in an EXR file: (height, width, 3 or 4) linear light."""
    from wgmb.io import exr
    from wgmb.sequence.layers import names as layers

    channels = exr.read(path).channels()
    names = layers.find_color(list(channels), layer)
    return np.dstack([channels[name].astype(np.float32) for name in names])


def shown(path: Path) -> np.ndarray:
    """The values that a picture file holds, 0..1, unchanged: (height, width, 4)."""
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.name = "Non-Color"
        image.alpha_mode = "CHANNEL_PACKED"
        values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
        image.pixels.foreach_get(values)
        return values.reshape(image.size[1], image.size[0], 4)[::-1]
    finally:
        bpy.data.images.remove(image)


def srgb(light: np.ndarray) -> np.ndarray:
    """The sRGB values of linear light."""
    x = np.clip(np.nan_to_num(light[..., :3]), 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def decibels(a: np.ndarray, b: np.ndarray) -> float:
    """PSNR of values in 0..1."""
    return float(-10 * np.log10(np.mean((a - b) ** 2, dtype=np.float64) + 1e-12))


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    """PSNR of the sRGB values of two linear pictures."""
    return decibels(srgb(a), srgb(b))
