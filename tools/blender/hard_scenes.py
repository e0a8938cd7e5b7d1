"""Scenes of what no method was tuned on: grass, glass, a swarm, a car, light that glows, and the
first scene that everybody makes."""

import math
import random

import bpy
from blender_kit import Scene, add, animate, box, camera, material, sun
from mathutils import Matrix, Vector

SIZE = (320, 180)


def mesh_of(name, color, points, faces, keys=()):
    """A mesh with shape keys: name and a function of a point's index and place, for each."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.materials.append(color)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(made)
    if keys:
        made.shape_key_add(name="rest")
    for key, moved in keys:
        block = made.shape_key_add(name=key)
        block.slider_min, block.slider_max = -10, 10
        for i, (point, place) in enumerate(zip(points, block.data, strict=True)):
            place.co = Vector(point) + Vector(moved(i, point))
    return made


def glowing(color, strength):
    """Light of one colour and nothing else."""
    made = bpy.data.materials.new("glow")
    made.use_nodes = True
    nodes, link = made.node_tree.nodes, made.node_tree.links.new
    nodes.clear()
    glow, out = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    glow.inputs["Color"].default_value = (*color, 1)
    glow.inputs["Strength"].default_value = strength
    link(glow.outputs[0], out.inputs["Surface"])
    made.cycles.emission_sampling = "NONE"  # it lights nothing
    return made


def grass():
    """A meadow of blades thinner than a pixel sways; the camera walks through it."""
    soil = material("noise", (0.05, 0.04, 0.02), (0.12, 0.1, 0.05), 6)
    add("plane", soil, size=40)
    rng = random.Random(7)
    hues = ((0.06, 0.2, 0.02), (0.16, 0.3, 0.04), (0.35, 0.33, 0.1))
    for hue in hues:
        points, faces, blades = [], [], []
        for _ in range(900):
            far = rng.random() ** 1.5
            x, y = rng.uniform(-1, 1) * (1.2 + 4 * far), -2.6 + 7.5 * far
            high, wide, turn = rng.uniform(0.35, 0.8), rng.uniform(0.006, 0.014), rng.uniform(-1, 1)
            side = Vector((math.cos(turn), math.sin(turn), 0)) * wide
            first, lean = len(points), rng.uniform(-0.2, 0.2)
            for k in range(4):
                up = k / 4
                middle = Vector((x + lean * up * up, y, high * up))
                points += [tuple(middle - side * (1 - up)), tuple(middle + side * (1 - up))]
                blades += [(x, y, up, high)] * 2
            points.append((x + lean, y, high))
            blades.append((x, y, 1.0, high))
            for k in range(3):
                a = first + 2 * k
                faces.append((a, a + 1, a + 3, a + 2))
            faces.append((first + 6, first + 7, first + 8))

        def sway(wave, blades=blades):
            def moved(i, _):
                x, y, up, high = blades[i]
                bend = 0.35 * high * up * up
                phase = 1.6 * x + 1.1 * y
                return bend * wave(phase), 0.3 * bend * wave(phase + 1), -0.3 * bend * up

            return moved

        keys = (("cos", sway(math.sin)), ("sin", sway(math.cos)))
        made = mesh_of("grass", material("plain", hue), points, faces, keys)
        blocks = made.data.shape_keys.key_blocks
        animate(blocks["cos"], "value", lambda t: math.cos(0.5 + 0.6 * t))
        animate(blocks["sin"], "value", lambda t: math.sin(0.5 + 0.6 * t))
    box(
        material("noise", (0.25, 0.22, 0.18), (0.5, 0.45, 0.4), 5), (1.4, 0.7, 1.2), (0.9, 3.2, 0.6)
    )
    head, _ = camera((-0.2, -4.2, 0.75), (0.1, 0, 0.45), 32)
    animate(head, "location", lambda t: Vector((-0.2 + 0.05 * t, -4.2 + 0.06 * t, 0.75)))
    sun((0.5, 0.6, -0.8))


def glass():
    """Balls of glass and of chrome roll before a mirror and a wall of bricks."""

    def polished(kind):
        made = bpy.data.materials.new(kind)
        made.use_nodes = True
        nodes, link = made.node_tree.nodes, made.node_tree.links.new
        nodes.clear()
        node = nodes.new(f"ShaderNodeBsdf{kind}")
        node.inputs["Roughness"].default_value = 0
        if kind == "Glossy":
            node.inputs["Color"].default_value = (0.85, 0.85, 0.88, 1)
        link(node.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        return made

    add("plane", material("checker", (0.12, 0.1, 0.08), (0.6, 0.55, 0.45), 1.5), size=40)
    wall = add("plane", material("brick", (0.5, 0.2, 0.12), (0.65, 0.4, 0.25), 1.6), size=30,
               location=(0, 4, 0))  # fmt: skip
    wall.rotation_euler[0] = math.radians(90)
    mirror = box(polished("Glossy"), (1.7, 0.05, 1.7), (-1.2, 2.6, 0.95))
    mirror.rotation_euler[2] = math.radians(20)
    clear, chrome = polished("Glass"), polished("Glossy")
    for color, x, y, radius, speed in (
        (clear, 0.55, 0.2, 0.5, -0.22), (chrome, -0.9, 0.7, 0.4, 0.2), (clear, 1.7, 1.6, 0.6, -0.1),
    ):  # fmt: skip
        ball = add("uv_sphere", color, radius=radius, segments=64, ring_count=32)
        ball.data.polygons.foreach_set("use_smooth", [True] * len(ball.data.polygons))
        animate(
            ball, "location", lambda t, p=(x, y, radius), v=speed: Vector(p) + Vector((v * t, 0, 0))
        )
    cube = box(
        material("checker", (0.05, 0.2, 0.6), (0.9, 0.9, 0.8), 5), (0.4, 0.4, 0.4), (0, 0, 0)
    )
    animate(cube, "location", lambda t: Vector((-0.3 + 0.25 * t, 1.5, 0.5)))
    animate(cube, "rotation_euler", lambda t: math.radians(12 * t), 2)
    bpy.context.scene.world.cycles_visibility.glossy = True
    bpy.context.scene.world.cycles_visibility.transmission = True
    camera((0, -4.6, 1.5), (0, 0.6, 0.6), 36)
    sun((0.4, 0.8, -0.8))


def swarm():
    """700 small balls fly apart, each its own way, past a wall and through a frame of bars."""
    wall = add("plane", material("noise", (0.1, 0.12, 0.2), (0.4, 0.42, 0.5), 2), size=30,
               location=(0, 4, 0))  # fmt: skip
    wall.rotation_euler[0] = math.radians(90)
    for k in range(7):
        bar = material("plain", (0.5, 0.4, 0.15))
        box(bar, (0.05, 0.05, 3.2), (-1.8 + 0.6 * k, -0.3, 0))
    rng = random.Random(11)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1)
    ball = bpy.context.object
    shape = [v.co.copy() for v in ball.data.vertices]
    sides = [tuple(p.vertices) for p in ball.data.polygons]
    bpy.data.objects.remove(ball)
    for hue in ((0.8, 0.15, 0.05), (0.9, 0.75, 0.2), (0.1, 0.5, 0.2), (0.85, 0.85, 0.85)):
        points, faces, speeds, bends = [], [], [], []
        for _ in range(175):
            at = Vector((rng.gauss(0, 0.8), rng.gauss(0.2, 0.8), rng.gauss(0, 0.55)))
            speed = 0.14 * at + Vector([rng.gauss(0, 0.11) for _ in range(3)])
            bend = Vector([rng.gauss(0, 0.015) for _ in range(3)])
            radius, first = rng.uniform(0.015, 0.06), len(points)
            points += [tuple(at + radius * p) for p in shape]
            faces += [tuple(first + i for i in side) for side in sides]
            speeds += [speed] * len(shape)
            bends += [bend] * len(shape)
        keys = (("t", lambda i, _, v=speeds: v[i]), ("t2", lambda i, _, a=bends: a[i]))
        made = mesh_of("swarm", material("plain", hue), points, faces, keys)
        made.data.polygons.foreach_set("use_smooth", [True] * len(faces))
        blocks = made.data.shape_keys.key_blocks
        animate(blocks["t"], "value", lambda t: t)
        animate(blocks["t2"], "value", lambda t: t * t)
    camera((0, -4.6, 0.1), (0, 0, 0), 36)
    sun((0.4, 0.8, -0.6))


def car():
    """A car with spoked wheels drives past posts; the camera drives beside it."""
    add("plane", material("noise", (0.06, 0.06, 0.065), (0.16, 0.16, 0.16), 3), size=80)
    field = add("plane", material("noise", (0.05, 0.15, 0.03), (0.3, 0.32, 0.1), 1.5), size=60,
                location=(0, 32.6, 0.01))  # fmt: skip
    field.scale[0] = 2
    for k in range(24):
        post = material("plain", (0.75, 0.7, 0.6))
        box(post, (0.07, 0.07, 0.8), (-8 + 0.75 * k, 2.4, 0.4))
        box(material("plain", (0.85, 0.8, 0.2)), (0.45, 0.09, 0.01), (-8 + 0.75 * k, -0.95, 0.006))
    rng = random.Random(5)
    for k in range(9):
        leaves = material("noise", (0.02, 0.1, 0.02), (0.15, 0.35, 0.06), 6)
        add("ico_sphere", leaves, radius=rng.uniform(0.5, 0.9), subdivisions=4,
            location=(-7 + 1.7 * k, 4.2 + rng.random(), 1.2))  # fmt: skip
    speed, radius = 0.42, 0.28
    bpy.ops.object.empty_add(location=(0, 0, 0))
    body = bpy.context.object
    animate(body, "location", lambda t: speed * t, 0)
    paint = material("checker", (0.65, 0.05, 0.04), (0.75, 0.1, 0.06), 2)
    dark, metal = material("plain", (0.03, 0.03, 0.035)), material("plain", (0.7, 0.7, 0.72))
    box(paint, (2.3, 0.95, 0.36), (0, 0, 0.46), body)
    box(material("plain", (0.12, 0.17, 0.22)), (1.15, 0.85, 0.32), (-0.12, 0, 0.8), body)
    box(paint, (1.0, 0.87, 0.06), (-0.12, 0, 0.98), body)
    box(material("plain", (0.95, 0.9, 0.7)), (0.05, 0.5, 0.1), (1.16, 0, 0.5), body)
    for x in (-0.72, 0.74):
        for y in (-0.5, 0.5):
            tyre = add("torus", dark, major_radius=radius - 0.07, minor_radius=0.07,
                       major_segments=48)  # fmt: skip
            tyre.data.transform(Matrix.Rotation(math.radians(90), 4, "X"))
            tyre.parent, tyre.location = body, (x, y, radius)
            for k in range(7):
                spoke = box(metal, (0.035, 0.05, radius - 0.08), (0, 0, 0), tyre)
                spoke.data.transform(Matrix.Translation((0, 0, (radius - 0.08) / 2)))
                spoke.rotation_euler[1] = 2 * math.pi * k / 7
            animate(tyre, "rotation_euler", lambda t: speed * t / radius + 0.2, 1)
    head, _ = camera((-0.3, -4.2, 1.25), (0.05, 0, 0.55), 36)
    animate(head, "location", lambda t: -0.3 + 0.3 * t, 0)
    sun((0.45, 0.75, -0.85))


def fireworks():
    """Sparks fly, a ring of lamps turns and veils of fire rise, all brighter than white."""
    add("plane", material("checker", (0.05, 0.05, 0.06), (0.2, 0.19, 0.17), 1.2), size=40,
        location=(0, 0, -1.1))  # fmt: skip
    wall = add("plane", material("brick", (0.15, 0.09, 0.08), (0.25, 0.15, 0.12), 2), size=30,
               location=(0, 4, 0))  # fmt: skip
    wall.rotation_euler[0] = math.radians(90)
    rng = random.Random(9)
    for _ in range(70):
        angle, lift = rng.uniform(0, 2 * math.pi), rng.uniform(-0.3, 1)
        way = Vector((math.cos(angle), 0.5 * math.sin(angle), lift)) * rng.uniform(0.1, 0.3)
        start = Vector((-0.9, 0.4, -0.1)) + way * rng.uniform(0, 5)
        spark = add("ico_sphere", glowing((1, rng.uniform(0.3, 0.7), 0.12), rng.uniform(4, 14)),
                    radius=rng.uniform(0.008, 0.022), subdivisions=2)  # fmt: skip
        animate(spark, "location",
                lambda t, p=start, v=way: p + v * t - Vector((0, 0, 0.012)) * t * t)  # fmt: skip
    bpy.ops.object.empty_add(location=(1.2, 0.6, 0.15))
    hub = bpy.context.object
    for k in range(8):
        turn = 2 * math.pi * k / 8
        color = ((0.2, 0.5, 1), (1, 0.2, 0.6))[k % 2]
        bulb = add("uv_sphere", glowing(color, 6), radius=0.07, segments=24, ring_count=12)
        bulb.parent, bulb.location = hub, (0.75 * math.cos(turn), 0, 0.75 * math.sin(turn))
        arm = box(material("plain", (0.3, 0.3, 0.32)), (0.75, 0.03, 0.03), (0, 0, 0), hub)
        arm.data.transform(Matrix.Translation((0.375, 0, 0)))
        arm.rotation_euler[1] = -turn
    animate(hub, "rotation_euler", lambda t: math.radians(14 * t), 1)
    for k in range(4):
        veil = glowing((1, 0.35, 0.06), 1.6)
        nodes, link = veil.node_tree.nodes, veil.node_tree.links.new
        out = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
        clear, mixed = nodes.new("ShaderNodeBsdfTransparent"), nodes.new("ShaderNodeMixShader")
        noise, ramp = nodes.new("ShaderNodeTexNoise"), nodes.new("ShaderNodeValToRGB")
        place = nodes.new("ShaderNodeTexCoord").outputs["Object"]
        noise.inputs["Scale"].default_value = 4
        link(place, noise.inputs["Vector"])
        ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.45, 0.75
        link(noise.outputs[0], ramp.inputs[0])
        link(ramp.outputs["Color"], mixed.inputs[0])
        glow = out.inputs["Surface"].links[0].from_socket
        link(clear.outputs[0], mixed.inputs[1])
        link(glow, mixed.inputs[2])
        link(mixed.outputs[0], out.inputs["Surface"])
        sheet = add("plane", veil, size=1)
        sheet.data.transform(Matrix.Rotation(math.radians(90), 4, "X"))
        start, rise = (
            Vector((-0.4 + 0.35 * k, 0.9 + 0.3 * k, -0.55)),
            Vector((0, 0, 0.1 + 0.04 * k)),
        )
        animate(sheet, "location", lambda t, p=start, v=rise: p + t * v)
    camera((0, -4.6, 0.3), (0, 0.3, 0), 36)
    sun((0.4, 0.8, -0.8), 1.0)


def beginner():
    """The first scene that everybody makes: a monkey and a cube pass over a floor, under a sun."""
    floor = material("checker", (0.8, 0.8, 0.8), (0.2, 0.2, 0.2), 0.5)
    add("plane", floor, size=40, location=(0, 0, -1))
    grey = material("plain", (0.8, 0.8, 0.8))
    monkey = add("monkey", grey, location=(0, 0, 0.3))
    cube = box(grey, (1, 1, 1), (0, -1.6, -0.3))
    for thing, speed in ((monkey, 0.35), (cube, -0.29)):
        animate(thing, "location", lambda t, v=speed: v * t, 0)
        animate(thing, "rotation_euler", lambda t: 0.75 + 0.1 * t, 2)
    camera((0, -9, 2.2), (0, 0, 0.35), 50)
    sun((0.45, 0.6, -0.85))


HARD = {
    make.__name__: Scene(make, SIZE, 64, half, light=True, bounces=bounces)
    for make, half, bounces in (
        (grass, 128, (0, 0, 0)),
        (glass, 96, (0, 3, 6)),
        (swarm, 96, (0, 0, 0)),
        (car, 96, (0, 0, 0)),
        (fireworks, 96, (0, 0, 0)),
        (beginner, 96, (0, 0, 0)),
    )
}
