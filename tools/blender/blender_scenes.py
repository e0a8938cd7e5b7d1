"""Scenes with a path tracer's own motion blur.

    python tools/blender/blender_scenes.py FOLDER [SCENE ...]

A scene is one of this file's, of light_scenes.py or of hard_scenes.py, or an animated glTF file,
FILE.glb or FILE.glb:ANIMATION (else its first): its cycle is played SPEED times as fast as the
file says, so that a walk blurs like a run, with the cycle's middle on frame 10.

Runs in an environment of its own (Python 3.11, `pip install bpy==4.5.15 OpenEXR`, 1 GB), on
the CPU, one to five minutes a scene on two cores. Into FOLDER/SCENE it writes
prev.exr, curr.exr, next.exr    frames 9, 10, 11 without motion blur, with depth and vectors, and
                                with passes of light where the scene asks for them
truth_050.exr, truth_100.exr    frame 10 with Cycles' motion blur: 180 and 360 degrees, box,
                                centred on the frame; the mean of two halves, kept as .a and .b
blender_vecblur_050.exr, _100   what Blender's Vector Blur node makes of curr.exr
camera.json                     the cameras of frames 9, 9.5, 10, 10.5, 11
Light is direct, ambient light is emission, and most scenes have one lamp, a point: noise is of
edges alone there.
"""

import json
import math
import random
import sys
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
from blender_kit import AMBIENT, FRAME, Scene, add, animate, box, camera, limb, material, sun
from hard_scenes import HARD
from light_scenes import LIGHT
from mathutils import Matrix, Vector

FPS = 24
VECTOR_BLUR = 64  # samples of Blender's node
SHUTTERS = {"050": 0.5, "100": 1.0}
SPEED = 2.0  # of a glTF file's animation
LIGHT_PASSES = (
    *(f"{kind}_{part}" for kind in ("diffuse", "glossy", "transmission")
      for part in ("direct", "indirect", "color")),
    "emit", "environment",
)  # fmt: skip


# ---- the scenes -------------------------------------------------------------------------------


def rotozoom():
    """The camera rolls, zooms in and flies over a textured ground with things on it."""
    ground = material("noise", (0.05, 0.12, 0.03), (0.5, 0.42, 0.25), 3.0)
    add("plane", ground, size=60)
    rng = random.Random(4)
    hues = [(0.7, 0.1, 0.06), (0.05, 0.25, 0.6), (0.7, 0.5, 0.05), (0.6, 0.6, 0.6)]
    for i in range(22):
        angle, far = 2.4 * i, 0.7 + 0.95 * math.sqrt(i) * 1.1
        x, y, high = far * math.cos(angle), far * math.sin(angle), rng.uniform(0.4, 1.6)
        color = material(("checker", "noise", "brick")[i % 3], hues[i % 4], (0.9, 0.9, 0.8), 5)
        if i % 4 == 0:
            add("cone", color, radius1=0.4, depth=high, location=(x, y, high / 2))
        elif i % 4 == 1:
            add("cylinder", color, radius=0.12, depth=high, location=(x, y, high / 2))
        elif i % 4 == 2:
            turned = box(color, (0.5, 0.5, high), (x, y, high / 2))
            turned.rotation_euler[2] = angle
        else:
            add("uv_sphere", color, radius=0.35, location=(x, y, 0.35), segments=48, ring_count=24)
    head, eye = camera((0, -5.5, 6.5), (0, 0, 0.2), 35)
    animate(eye, "rotation_euler", lambda t: math.radians(20 + 6 * t), 2)
    animate(eye.data, "lens", lambda t: 35 * 1.07**t)
    way = Vector((0.15, 0.35, -0.3))
    animate(head, "location", lambda t: Vector((0, -5.5, 6.5)) + t * way)
    sun((0.5, 0.4, -1))


def propeller():
    """Thin blades and spoked wheels, fast, before a wall; one behind a grid of bars."""
    wall = material("brick", (0.5, 0.2, 0.12), (0.62, 0.32, 0.2), 2.2)
    stands = add("plane", wall, size=30, location=(0, 5, 0))
    stands.rotation_euler[0] = math.radians(90)
    add("plane", material("noise", (0.12, 0.12, 0.12), (0.3, 0.3, 0.28), 4), size=40,
        location=(0, 0, -1.7))  # fmt: skip
    metal, dark = material("plain", (0.75, 0.75, 0.78)), material("plain", (0.04, 0.04, 0.05))
    tips = material("checker", (0.8, 0.08, 0.04), (0.9, 0.85, 0.1), 6)

    def rotor(at, blades, length, width, degrees, tilt=0.0, blade=metal):
        bpy.ops.object.empty_add(location=at)
        stand = bpy.context.object
        stand.rotation_euler = (0, 0, math.radians(tilt))
        hub = add("uv_sphere", dark, radius=0.13, segments=24, ring_count=12)
        hub.parent = stand
        for k in range(blades):
            arm = box(blade, (length, 0.02, width), (0, 0, 0), hub)
            arm.data.transform(Matrix.Translation((length / 2, 0, 0)))
            arm.rotation_euler = (math.radians(25), -2 * math.pi * k / blades, 0)
            arm.rotation_mode = "YXZ"
        animate(hub, "rotation_euler", lambda t: math.radians(degrees * t + 11), 1)

    rotor((-1.7, 0.5, 0.35), 3, 1.25, 0.14, 40, 0, tips)
    rotor((1.15, 1.5, 0.75), 5, 0.95, 0.06, -30)
    rotor((0.55, -0.6, -0.75), 2, 0.75, 0.05, 50, 50)
    bpy.ops.object.empty_add(location=(2.0, -0.2, -1.0))
    axle = bpy.context.object
    tyre = add("torus", dark, major_radius=0.62, minor_radius=0.06, major_segments=64)
    tyre.data.transform(Matrix.Rotation(math.radians(90), 4, "X"))
    tyre.parent = axle
    for k in range(10):
        spoke = box(metal, (0.035, 0.02, 0.62), (0, 0, 0), tyre)
        spoke.data.transform(Matrix.Translation((0, 0, 0.31)))
        spoke.rotation_euler[1] = 2 * math.pi * k / 10
    speed = -0.16
    animate(axle, "location", lambda t: 2.0 + speed * t, 0)
    animate(tyre, "rotation_euler", lambda t: speed * t / 0.68, 1)
    for k in range(6):
        box(material("plain", (0.1, 0.22, 0.12)), (0.05, 0.05, 1.6), (0.75 + 0.28 * k, 0.6, 0.75))
    camera((0, -6.5, 0.2), (0, 0, 0), 42)
    sun((0.35, 0.8, -0.6))


def flag():
    """Two cloths that wave, one before the other, seen by a camera that pans slowly."""
    add("plane", material("noise", (0.06, 0.16, 0.03), (0.25, 0.3, 0.08), 2), size=200,
        location=(0, 60, -2))  # fmt: skip
    stone = material("noise", (0.25, 0.22, 0.18), (0.55, 0.5, 0.42), 5)
    for k in range(5):
        high = (2.2, 3.6, 1.6, 3.0, 2.4)[k]
        box(stone, (1.8, 1, high), (-5.2 + 2.6 * k, 7, high / 2 - 2))

    def cloth(at, width, height, color, amplitude, waves, degrees):
        across, down = 96, 48
        corners = [(width * i / across, 0.0, height * (0.5 - j / down))
                   for j in range(down + 1) for i in range(across + 1)]  # fmt: skip
        faces = []
        for j in range(down):
            for i in range(across):
                k = j * (across + 1) + i
                faces.append((k, k + 1, k + across + 2, k + across + 1))
        mesh = bpy.data.meshes.new("cloth")
        mesh.from_pydata(corners, [], faces)
        uv = mesh.uv_layers.new()
        for loop in mesh.loops:
            x, _, z = corners[loop.vertex_index]
            uv.data[loop.index].uv = x / width, z / width
        mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
        made = bpy.data.objects.new("cloth", mesh)
        bpy.context.collection.objects.link(made)
        made.location = at
        mesh.materials.append(color)
        made.shape_key_add(name="rest")
        for name, wave, sign in (("cos", math.sin, 1), ("sin", math.cos, -1)):
            key = made.shape_key_add(name=name)
            key.slider_min, key.slider_max = -1, 1
            for corner, point in zip(corners, key.data, strict=True):
                x, y, z = corner
                phase = waves * 2 * math.pi * (x / width + 0.25 * z / height)
                rise = amplitude * min(1, 1.6 * x / width) * sign * wave(phase)
                point.co = (x - 0.15 * rise, y + rise, z + 0.35 * rise)
        # sin(phase - w t) = sin(phase) cos(w t) - cos(phase) sin(w t)
        turn = math.radians(degrees)
        blocks = made.data.shape_keys.key_blocks
        animate(blocks["cos"], "value", lambda t: math.cos(0.8 + turn * t))
        animate(blocks["sin"], "value", lambda t: math.sin(0.8 + turn * t))
        pole = material("plain", (0.5, 0.5, 0.52))
        add("cylinder", pole, radius=0.035, depth=5, location=(at[0] - 0.03, at[1], at[2] - 1.6))

    stripes = material("checker", (0.75, 0.05, 0.05), (0.9, 0.88, 0.82), 7, "UV")
    spots = material("noise", (0.03, 0.08, 0.45), (0.95, 0.75, 0.1), 9, "UV")
    cloth((-2.0, 0.0, 0.35), 2.5, 1.5, stripes, 0.36, 1.4, 55)
    cloth((0.35, 1.6, 0.55), 2.6, 1.7, spots, 0.4, 1.2, 75)
    head, _ = camera((-0.9, -6.2, -0.4), (0.1, 0, 0.1), 40)
    turned = head.rotation_euler[2]
    animate(head, "rotation_euler", lambda t: turned - math.radians(0.7 * t), 2)
    sun((0.5, 0.8, -0.7))


def runner():
    """Two jointed figures run past each other; the camera goes along with one of them."""
    add("plane", material("noise", (0.3, 0.2, 0.1), (0.5, 0.4, 0.25), 5), size=80)
    bark, leaves = material("noise", (0.1, 0.05, 0.02), (0.25, 0.15, 0.08), 8), material(
        "noise", (0.02, 0.08, 0.01), (0.15, 0.35, 0.06), 6)  # fmt: skip
    rng = random.Random(2)
    for k in range(12):
        x, y = -7 + 1.3 * k + rng.uniform(-0.3, 0.3), 4 + 3 * rng.random()
        add("cylinder", bark, radius=0.12, depth=2, location=(x, y, 1))
        add("ico_sphere", leaves, radius=rng.uniform(0.6, 1), location=(x, y, 2.4), subdivisions=4)
    for k in range(30):
        box(material("plain", (0.7, 0.7, 0.65)), (0.06, 0.04, 0.7), (-7 + 0.5 * k, 2.2, 0.35))
    box(material("plain", (0.7, 0.7, 0.65)), (20, 0.04, 0.07), (0, 2.2, 0.55))

    def figure(x, y, speed, pace, phase, shirt, trousers):
        skin = material("plain", (0.6, 0.36, 0.25))
        way = 1 if speed > 0 else -1
        body = limb(shirt, 0.17, 0.5, (x, y, 0))
        body.rotation_euler[1] = way * 0.15
        head = add("uv_sphere", skin, radius=0.13, segments=32, ring_count=16)
        head.location, head.parent = (0.03 * way, 0, 0.28), body
        turn = math.radians(pace)

        def swing(of, amount, lead, rest=0.0):
            def angle(t):
                return -way * (rest + amount * math.sin(turn * t + phase + lead))

            animate(of, "rotation_euler", angle, 1)

        for side, lead in ((-1, 0.0), (1, math.pi)):
            arm = limb(shirt, 0.055, 0.3, (0, 0.22 * side, -0.02), body)
            fore = limb(skin, 0.045, 0.28, (0, 0, -0.3), arm)
            thigh = limb(trousers, 0.09, 0.45, (0, 0.1 * side, -0.52), body)
            shin = limb(skin, 0.06, 0.45, (0, 0, -0.45), thigh)
            shoe = box(material("plain", (0.9, 0.9, 0.9)), (0.26, 0.1, 0.08), (0, 0, -0.47), shin)
            shoe.location[0] = 0.06 * way
            swing(arm, 0.9, lead + math.pi)
            swing(fore, 0.3, lead + math.pi, 1.3)
            swing(thigh, 0.8, lead, 0.25)
            swing(shin, 0.75, lead - 1.4, -0.85)
        animate(body, "location", lambda t: x + speed * t, 0)
        animate(body, "location", lambda t: 1.36 + 0.05 * math.sin(2 * (turn * t + phase)), 2)

    red = material("checker", (0.7, 0.05, 0.04), (0.85, 0.6, 0.1), 12)
    blue = material("checker", (0.05, 0.15, 0.6), (0.8, 0.8, 0.85), 10)
    grey = material("plain", (0.08, 0.08, 0.1))
    figure(-0.5, 0.0, 0.26, 25, 0.6, red, grey)
    figure(0.75, 0.9, -0.22, 28, 2.2, blue, material("plain", (0.25, 0.22, 0.12)))
    head, _ = camera((0, -4.4, 1.35), (0, 0, 1.05), 36)
    animate(head, "location", lambda t: 0.13 * t, 0)
    sun((0.4, 0.7, -0.8))


SCENES = {s.__name__: Scene(s) for s in (rotozoom, propeller, flag, runner)} | LIGHT | HARD


# ---- a scene of a glTF file -------------------------------------------------------------------


def gltf(text: str) -> str:
    """The file's model on a ground before a wall, or as its own camera sees it; says so."""
    path, _, name = (text, "", "") if Path(text).is_file() else text.rpartition(":")
    if not Path(path).is_file():
        sys.exit(f"expected a glTF file or a scene of {', '.join(SCENES)}, got {text!r}")
    bpy.ops.import_scene.gltf(filepath=str(Path(path).resolve()), disable_bone_shape=True)
    things = list(bpy.data.objects)
    about = f"{Path(path).name}: {play(things, name)}, at {SPEED:g} times its speed"
    glow()
    if not any(thing.type == "LIGHT" for thing in things):
        sun((-0.45, 0.7, -0.8), 2.2)
    eyes = [thing for thing in things if thing.type == "CAMERA"]
    if eyes:
        bpy.context.scene.camera = eyes[0]
        return f"{about}, seen by its own camera."
    middle = Vector((0, 0, stand(things) / 2))
    add("plane", material("noise", (0.1, 0.14, 0.05), (0.42, 0.36, 0.24), 5), size=60)
    wall = add("plane", material("brick", (0.5, 0.2, 0.12), (0.62, 0.32, 0.2), 2.2), size=60)
    wall.location, wall.rotation_euler[0] = (0, 3.4, 2.2 - 30), math.radians(90)
    bpy.ops.object.empty_add(location=middle)
    pivot = bpy.context.object
    head, _ = camera((2.3, -3.5, 0.9), (0, 0, 0), 35)
    head.parent = pivot
    animate(pivot, "rotation_euler", lambda t: math.radians(-2.5 * t), 2)
    return f"{about}; the camera goes round it."


def play(things, name: str) -> str:
    """Play one animation alone, three times, the second's middle on FRAME; returns its name."""
    moved = [of.animation_data for of in (*things, *bpy.data.shape_keys) if of.animation_data]
    names = sorted({track.name for of in moved for track in of.nla_tracks})
    name = name or next((of.action.name for of in moved if of.action), "")
    if name not in names:
        sys.exit(f"expected one of the file's animations {names}, got {name!r}")
    for of in moved:
        of.action = None
        for track in of.nla_tracks:
            track.mute = track.name != name
            strip = track.strips[0]
            half = 1.5 * (strip.frame_end - strip.frame_start) / SPEED
            strip.scale, strip.repeat = 1 / SPEED, 3
            strip.frame_start, strip.frame_end = FRAME - half, FRAME + half
    return name


def glow():
    """Give what was imported the ambient light that `material` gives."""
    for made in bpy.data.materials:
        for node in made.node_tree.nodes:
            if node.type == "BSDF_PRINCIPLED" and not node.inputs["Emission Color"].is_linked:
                color, emission = node.inputs["Base Color"], node.inputs["Emission Color"]
                emission.default_value = color.default_value
                for given in color.links:
                    made.node_tree.links.new(given.from_socket, emission)
                node.inputs["Emission Strength"].default_value = AMBIENT


def stand(things) -> float:
    """Put things on the ground, 2 long, wide or high over frames 8 to 12; returns how high."""
    corners = []
    for offset in range(-2, 3):
        bpy.context.scene.frame_set(FRAME + offset)
        graph = bpy.context.evaluated_depsgraph_get()
        for mesh in (thing.evaluated_get(graph) for thing in things if thing.type == "MESH"):
            corners += [mesh.matrix_world @ Vector(corner) for corner in mesh.bound_box]
    low, high = np.min(corners, 0), np.max(corners, 0)
    scale = 2 / (high - low).max()
    bpy.ops.object.empty_add(location=-scale * np.array([*(low + high)[:2] / 2, low[2]]))
    under = bpy.context.object
    under.scale = [scale] * 3
    for thing in things:
        thing.parent = thing.parent or under
    return scale * (high - low)[2]


# ---- rendering --------------------------------------------------------------------------------


def begin(wanted: Scene):
    """An empty file with a sky, and Cycles set up."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.45, 0.62, 0.85, 1)
    seen = scene.world.cycles_visibility
    seen.diffuse = seen.glossy = seen.transmission = seen.scatter = False
    scene.frame_set(FRAME)
    scene.render.engine, scene.render.fps = "CYCLES", FPS
    scene.render.resolution_x, scene.render.resolution_y = wanted.size
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", wanted.sharp
    cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces = wanted.bounces
    cycles.max_bounces = sum(wanted.bounces)
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    scene.render.film_transparent = False
    layer = scene.view_layers[0]
    layer.name = "ViewLayer"
    layer.use_pass_z = layer.use_pass_vector = layer.use_pass_normal = True
    layer.use_pass_object_index = True
    for name in LIGHT_PASSES if wanted.light else ():
        setattr(layer, f"use_pass_{name}", True)
    return scene


def shoot(scene, path: Path, layers: bool):
    """Render into a file: all layers, or the colour alone."""
    image = scene.render.image_settings
    image.file_format = "OPEN_EXR_MULTILAYER" if layers else "OPEN_EXR"
    image.color_mode, image.color_depth, image.exr_codec = "RGBA" if layers else "RGB", "16", "ZIP"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def render(folder: Path, name: str):
    """Everything of one scene but the vector blur."""
    wanted = SCENES.get(name) or Scene(lambda: gltf(name))
    scene = begin(wanted)
    about = wanted.make() or wanted.make.__doc__
    for i, thing in enumerate(bpy.data.objects):
        thing.pass_index = i + 1
        thing.cycles.use_motion_blur = thing.cycles.use_deform_motion = True
        thing.cycles.motion_steps = 3
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "camera.json").write_text(json.dumps(cameras(scene, about, wanted.size), indent=1))
    for offset, file in ((-1, "prev"), (0, "curr"), (1, "next")):
        scene.frame_set(FRAME + offset)
        shoot(scene, folder / f"{file}.exr", True)
    scene.frame_set(FRAME)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_position = "CENTER"
    scene.cycles.samples = wanted.half
    for text, shutter in SHUTTERS.items():
        scene.render.motion_blur_shutter = shutter
        halves = []
        for seed, half in enumerate("ab", 1):
            scene.cycles.seed = seed
            halves.append(folder / f"truth_{text}.{half}.exr")
            shoot(scene, halves[-1], False)
        save_mean(halves, folder / f"truth_{text}.exr")


def save_mean(files, onto: Path):
    """The mean of pictures of R, G, B."""
    planes = {}
    for file in files:
        with OpenEXR.File(str(file), separate_channels=True) as opened:
            for name in "RGB":
                plane = opened.channels()[name].pixels.astype(np.float32) / len(files)
                planes[name] = planes.get(name, 0) + plane
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    half = {name: plane.astype(np.float16) for name, plane in planes.items()}
    OpenEXR.File(header, half).write(str(onto))


def cameras(scene, about: str, size: tuple[int, int]) -> dict:
    """camera.json: matrices in Blender's and OpenGL's sense."""
    found = {}
    for time in (9, 9.5, 10, 10.5, 11):
        scene.frame_set(int(time), subframe=time % 1)
        eye = scene.camera.evaluated_get(bpy.context.evaluated_depsgraph_get())
        projection = eye.calc_matrix_camera(
            bpy.context.evaluated_depsgraph_get(), x=size[0], y=size[1]
        )
        found[f"{time:g}"] = {
            "camera_matrix_world": [list(row) for row in eye.matrix_world],
            "projection": [list(row) for row in projection],
        }
    return {
        "doc": " ".join(about.split()),
        "frame": FRAME,
        "fps": FPS,
        "resolution": size,
        "conventions": {
            "matrix": "row-major lists, column vectors: p_world = M @ p_camera; the camera "
            "looks along -Z, +Y up",
            "projection": "OpenGL clip space, z in [-1, 1]",
            "depth": "distance along the view axis; background 1e10",
            "vector": "pixels, y up; XY = P(n-1) - P(n); ZW = P(n) - P(n+1)",
        },
        "frames": found,
    }


def vector_blur(folder: Path, size: tuple[int, int]):
    """Blender's own filter on curr.exr, at every shutter."""
    for text, shutter in SHUTTERS.items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.use_nodes = True
        nodes, link = scene.node_tree.nodes, scene.node_tree.links.new
        nodes.clear()
        given, out = nodes.new("CompositorNodeImage"), nodes.new("CompositorNodeComposite")
        node = nodes.new("CompositorNodeVecBlur")
        given.image = bpy.data.images.load(str(folder / "curr.exr"))
        node.inputs["Samples"].default_value = VECTOR_BLUR
        node.inputs["Shutter"].default_value = shutter
        for layer, socket in (("Combined", "Image"), ("Depth", "Z"), ("Vector", "Speed")):
            link(given.outputs[layer], node.inputs[socket])
        link(node.outputs[0], out.inputs[0])
        render_ = scene.render
        render_.resolution_x, render_.resolution_y = size
        render_.resolution_percentage, render_.use_sequencer = 100, False
        render_.compositor_device, render_.compositor_precision = "CPU", "FULL"
        shoot(scene, folder / f"blender_vecblur_{text}.exr", False)


def main():
    """Render the scenes named, or all but those of glTF files."""
    into, *names = sys.argv[1:]
    for name in names or SCENES:
        folder = Path(into).resolve() / Path(name).stem
        render(folder, name)
        vector_blur(folder, SCENES[name].size if name in SCENES else Scene.size)


if __name__ == "__main__":
    main()
