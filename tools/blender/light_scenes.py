"""Scenes in which light moves over surfaces: shadows, reflections, and none of it, with passes."""

import functools
import math
import random

import bpy
from blender_kit import Scene, add, animate, box, camera, sun
from blender_kit import material as any_material
from mathutils import Matrix, Vector

material = functools.partial(any_material, ambient=0.1)
SIZE = (320, 180)


def lamps(hard, soft):
    """Two suns: one with hard shadows, one with soft ones."""
    sun(*hard, 0.4)
    sun(*soft, 14)


def wheel(at, degrees):
    """A spoked wheel that stands and turns, `degrees` a frame."""
    bpy.ops.object.empty_add(location=at)
    axle, dark, radius = bpy.context.object, material("plain", (0.3, 0.12, 0.05)), 0.8
    rim = add("torus", dark, major_radius=radius, minor_radius=0.06, major_segments=64)
    rim.data.transform(Matrix.Rotation(math.radians(90), 4, "X"))
    rim.parent = axle
    for k in range(8):
        spoke = box(dark, (0.06, 0.05, radius), (0, 0, 0), rim)
        spoke.data.transform(Matrix.Translation((0, 0, radius / 2)))
        spoke.rotation_euler[1] = 2 * math.pi * k / 8
    animate(rim, "rotation_euler", lambda t: math.radians(degrees * t + 7), 1)


def ground():
    """A textured plane."""
    add("plane", material("noise", (0.25, 0.21, 0.15), (0.62, 0.55, 0.42), 3), size=60)


def casters():
    """Ground, and things that throw shadows on it."""
    ground()
    wheel((-1.2, 1.5, 1.0), 11)
    cube = box(
        material("checker", (0.7, 0.1, 0.06), (0.9, 0.9, 0.8), 5), (0.5, 0.5, 0.35), (0, 0, 0)
    )
    animate(cube, "location", lambda t: Vector((1.3 + 0.33 * t, 1.5, 0.75)))
    ball = add("uv_sphere", material("checker", (0.05, 0.25, 0.6), (0.8, 0.8, 0.85), 8),
               radius=0.3, segments=48, ring_count=24)  # fmt: skip
    animate(ball, "location", lambda t: Vector((0.6 - 0.28 * t, 0.5, 0.8 + 0.05 * t)))
    add("cylinder", material("plain", (0.6, 0.6, 0.6)), radius=0.07, depth=1.6,
        location=(-0.1, 1.9, 0.8))  # fmt: skip
    rng = random.Random(3)
    for k in range(9):  # leaves above the picture
        leaf = add("ico_sphere", material("plain", (0.1, 0.3, 0.05)),
                   radius=rng.uniform(0.12, 0.26), subdivisions=3)  # fmt: skip
        leaf.scale[2] = 0.2
        x, y = -3.4 + 0.75 * k, 3.9 + 1.1 * rng.random()
        animate(leaf, "location", lambda t, x=x, y=y: Vector((x + 0.2 * t, y, 4.2)))
    lamps(((0.3, -0.95, -0.75), 3.6), ((-0.7, -0.35, -0.8), 1.8))
    return camera((0, -4.6, 3.5), (0, 0.3, 0.1), 34)


def shadows():
    """Wheel, box, ball and unseen leaves throw hard and soft shadows; the camera stands."""
    casters()


def shadows_pan():
    """The same things and shadows, seen by a camera that moves and pans."""
    head, _ = casters()
    turned = head.rotation_euler[2]
    animate(head, "location", lambda t: Vector((0.16 * t, -4.6 + 0.1 * t, 3.5)))
    animate(head, "rotation_euler", lambda t: turned + math.radians(1.1 * t), 2)


def reflections():
    """A glossy floor reflects a wheel, a box, a ball and bars that pass; the camera stands."""
    floor = material("noise", (0.06, 0.05, 0.05), (0.25, 0.2, 0.16), 2.5)
    nodes, link = floor.node_tree.nodes, floor.node_tree.links.new
    gloss, both = nodes.new("ShaderNodeBsdfGlossy"), nodes.new("ShaderNodeAddShader")
    gloss.inputs["Roughness"].default_value = 0.12
    gloss.inputs["Color"].default_value = (0.45, 0.45, 0.45, 1)
    out = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    link(out.inputs["Surface"].links[0].from_socket, both.inputs[0])
    link(gloss.outputs[0], both.inputs[1])
    link(both.outputs[0], out.inputs["Surface"])
    add("plane", floor, size=60)
    wall = add("plane", material("brick", (0.35, 0.2, 0.15), (0.45, 0.3, 0.22), 1.2), size=40,
               location=(0, 4, 0))  # fmt: skip
    wall.rotation_euler[0] = math.radians(90)
    wheel((-1.5, 1.2, 0.95), 11)
    cube = box(
        material("checker", (0.8, 0.1, 0.06), (0.95, 0.9, 0.8), 5), (0.5, 0.5, 0.9), (0, 0, 0)
    )
    animate(cube, "location", lambda t: Vector((1.2 + 0.3 * t, 1.3, 0.55)))
    ball = add(
        "uv_sphere", material("plain", (0.9, 0.75, 0.1)), radius=0.3, segments=48, ring_count=24
    )
    animate(ball, "location", lambda t: Vector((0.4 - 0.25 * t, 0.7, 0.5)))
    for k in range(3):
        bar = box(material("plain", (0.85, 0.85, 0.9)), (0.08, 0.08, 1.4), (0, 0, 0))
        animate(bar, "location", lambda t, k=k: Vector((-0.6 + 0.7 * k + 0.12 * t, 2.6, 0.75)))
    camera((0, -5.4, 2.4), (0, 0.3, 0.35), 36)
    lamps(((0.35, 0.75, -0.85), 2.5), ((-0.6, 0.5, -0.8), 1.2))


def slant():
    """Balls spin under slanted light and the camera moves: no shadow moves; few samples."""
    ground()
    for x, y, degrees in ((-1.4, 0.6, 14), (0.2, 1.2, -20), (1.5, 0.3, 9)):
        ball = add("uv_sphere", material("checker", (0.7, 0.1, 0.06), (0.9, 0.9, 0.8), 8),
                   radius=0.5, segments=48, ring_count=24, location=(x, y, 0.5))  # fmt: skip
        animate(ball, "rotation_euler", lambda t, w=degrees: math.radians(w * t), 2)
        box(
            material("brick", (0.1, 0.2, 0.5), (0.6, 0.6, 0.6), 5),
            (0.6, 0.6, 0.6),
            (x + 0.7, y - 1, 0.3),
        )
    head, _ = camera((0, -4.6, 3.5), (0, 0.3, 0.1), 34)
    animate(head, "location", lambda t: Vector((0.2 * t, -4.6 + 0.15 * t, 3.5)))
    lamps(((0.3, -0.95, -0.75), 3.6), ((-0.7, -0.35, -0.8), 1.8))


LIGHT = {
    make.__name__: Scene(make, SIZE, sharp, 160, light=True, bounces=bounces)
    for make, sharp, bounces in (
        (shadows, 128, (0, 0, 0)),
        (shadows_pan, 128, (0, 0, 0)),
        (reflections, 128, (0, 1, 0)),
        (slant, 24, (0, 0, 0)),
    )
}
