"""Parts of Blender's scenes: materials, moving objects, a camera, lamps."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy
from mathutils import Matrix, Vector

FRAME = 10  # the middle one
SPAN = 2.25  # frames from the middle one to the last key: vectors of 9 and 11 lead to 8 and 12
STEP = 0.125  # frames between keys
AMBIENT = 0.3


@dataclass(frozen=True)
class Scene:
    """A scene, and how it is rendered."""

    make: Callable[[], str | None]
    """Fills the file that `begin` made; says what the scene shows, or its documentation does."""
    size: tuple[int, int] = (640, 360)
    """Width, height [px]."""
    sharp: int = 192
    """Samples of a sharp frame."""
    half: int = 192
    """Samples of one half of a truth."""
    light: bool = False
    """Write the passes of light too."""
    bounces: tuple[int, int, int] = (0, 0, 0)
    """Most bounces of light: diffuse, glossy, transmitted."""


def material(kind: str, a, b=(1, 1, 1), scale=4.0, space="Object", ambient=AMBIENT):
    """Diffuse and a little emission of one colour, or of a pattern of two."""
    made = bpy.data.materials.new(kind)
    made.use_nodes = True
    nodes, link = made.node_tree.nodes, made.node_tree.links.new
    nodes.clear()
    a, b = (*a, 1.0), (*b, 1.0)
    diffuse, glow = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeEmission")
    glow.inputs["Strength"].default_value = ambient
    both, out = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeOutputMaterial")
    link(diffuse.outputs[0], both.inputs[0])
    link(glow.outputs[0], both.inputs[1])
    link(both.outputs[0], out.inputs["Surface"])
    if kind == "plain":
        diffuse.inputs["Color"].default_value = glow.inputs["Color"].default_value = a
        return made
    place = nodes.new("ShaderNodeTexCoord").outputs[space]
    if kind == "brick":
        texture = nodes.new("ShaderNodeTexBrick")
        texture.inputs["Color1"].default_value = a
        texture.inputs["Color2"].default_value = b
        texture.inputs["Mortar"].default_value = (0.1, 0.1, 0.1, 1)
        color = texture.outputs["Color"]
    elif kind == "checker":
        texture = nodes.new("ShaderNodeTexChecker")
        texture.inputs["Color1"].default_value = a
        texture.inputs["Color2"].default_value = b
        color = texture.outputs["Color"]
    else:  # noise, over a checker of a third of its frequency
        texture, ramp = nodes.new("ShaderNodeTexNoise"), nodes.new("ShaderNodeValToRGB")
        texture.inputs["Detail"].default_value = 4
        ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.4, 0.6
        ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = a, b
        link(texture.outputs[0], ramp.inputs[0])
        color = ramp.outputs["Color"]
    texture.inputs["Scale"].default_value = scale
    link(place, texture.inputs["Vector"])
    link(color, diffuse.inputs["Color"])
    link(color, glow.inputs["Color"])
    return made


def add(kind: str, color, **how):
    """A Blender primitive of that material."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**how)
    bpy.context.object.data.materials.append(color)
    return bpy.context.object


def box(color, size, at, parent=None):
    """A box of these sides around `at`."""
    made = add("cube", color, size=1)
    made.data.transform(Matrix.Diagonal((*size, 1)))
    made.location, made.parent = at, parent
    return made


def limb(color, radius, length, at, parent=None):
    """A rounded rod that hangs from its joint at `at`."""
    made = add("cylinder", color, radius=radius, depth=length, vertices=24)
    made.data.transform(Matrix.Translation((0, 0, -length / 2)))
    for end in (0.0, -length):
        ball = add("uv_sphere", color, radius=radius, segments=24, ring_count=12)
        ball.location, ball.parent = (0, 0, end), made
    made.location, made.parent = at, parent
    return made


def animate(of, path: str, value, index: int = -1):
    """Key a property with `value(t)`, t in frames from the middle one."""
    for i in range(int(-SPAN / STEP), int(SPAN / STEP) + 1):
        t = i * STEP
        now = value(t)
        if index < 0:
            setattr(of, path, now)
        else:
            getattr(of, path)[index] = now
        of.keyframe_insert(path, index=index, frame=FRAME + t)
    for curve in of.id_data.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def camera(at, toward, lens=35.0):
    """A camera below an empty that looks `toward`; both, for animation."""
    bpy.ops.object.empty_add(location=at)
    head = bpy.context.object
    head.rotation_euler = (Vector(toward) - Vector(at)).to_track_quat("-Z", "Y").to_euler()
    bpy.ops.object.camera_add()
    eye = bpy.context.object
    eye.parent, eye.data.lens, eye.data.clip_end = head, lens, 300
    bpy.context.scene.camera = eye
    return head, eye


def sun(toward, strength=3.0, degrees=0.0):
    """Light from infinitely far, as a disk that appears `degrees` wide."""
    bpy.ops.object.light_add(type="SUN")
    lamp = bpy.context.object
    lamp.rotation_euler = Vector(toward).to_track_quat("-Z", "Y").to_euler()
    lamp.data.energy, lamp.data.angle = strength, math.radians(degrees)
