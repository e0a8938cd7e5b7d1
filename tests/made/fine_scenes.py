"""Scenes in which a simple method may be as good as a clever one: fine structure, leaves, soft
edges, and the first scene that everybody makes."""

import numpy as np

from images import frame_of
from wgmb import Blur, Body, CameraPath, Frame, Render, Scene, Shutter
from wgmb.scene.bodies import at, moving, rotation, translation

FPS = 24.0
SIZE = (160, 90)
CREAM, GREEN, BLUE, RED = (0.88, 0.84, 0.74), (0.1, 0.35, 0.08), (0.1, 0.2, 0.6), (0.7, 0.1, 0.08)
BRICK, MORTAR, GREY = (0.5, 0.2, 0.13), (0.62, 0.58, 0.53), (0.6, 0.6, 0.6)


def _room():
    wall = Body("box", (14, 6, 0.3), at(0, 3, -3), BRICK, MORTAR, "BRICKS", (6, 6))
    return wall, _floor()


def _floor():
    return Body("box", (40, 0.5, 40), at(0, -0.5, 0), GREY, specular=0.1)


def shaken():
    """A camera in a hand, 1.6 radians of phase per frame, before thin bars and a detailed wall."""
    phase = 1.6 * FPS
    shot = CameraPath(
        lambda t: (0.05 * np.sin(phase * t), 1.4, 2.6),
        yaw=lambda t: 0.05 * np.sin(phase * t + 0.4),
        pitch=lambda t: -0.04 + 0.035 * np.sin(1.3 * phase * t + 2),
    )
    upright = [Body("box", (0.02, 1.6, 0.02), at(x, 1.4, 0), CREAM) for x in np.arange(-3, 3, 0.23)]
    across = [Body("box", (4, 0.015, 0.015), at(0, y, 0.05), BLUE) for y in np.arange(0.2, 3, 0.31)]
    return Scene("shaken", (*_room(), *upright, *across), shot)


def foliage():
    """Leaves that flutter before a detailed wall."""
    random = np.random.default_rng(7)
    leaves = []
    for _ in range(220):
        x, y, z = random.uniform((-2.2, 0.1, -1.2), (2.2, 2.7, 0.2))
        turn, lean, phase, swing = random.uniform((0, 0, 0, 0.08), (6, 3, 6, 0.25))
        tone = random.uniform(0.4, 2.2)
        path = _flutter(x, y, z, turn, lean, phase, swing)
        leaves.append(Body("sphere", (0.1, 0.05, 0.012), path, tuple(tone * c for c in GREEN)))
    shot = CameraPath(lambda t: (0 * t, 1.4, 2.6), pitch=lambda t: -0.04 + 0 * t)
    return Scene("foliage", (*_room(), *leaves), shot)


def _flutter(x, y, z, turn, lean, phase, swing):
    way = 0.9 * FPS

    def path(t):
        aside = swing * np.sin(way * t + phase)
        up = 0.6 * swing * np.sin(1.2 * way * t + 2 * phase)
        turned = rotation("z", turn + 0.4 * np.sin(way * t + phase), t)
        return translation(x + aside, y + up, z, t) @ turned @ rotation("x", lean, t)

    return path


def beginner():
    """The first scene of a beginner: a ball and a cube slide over a floor, under a sun."""
    v = 5.0
    bodies = (
        Body("box", (0.5, 0.5, 0.5), moving((0.7, 0.5, -1.4), (-v, 0, 0.3 * v)), BLUE),
        Body("sphere", (0.55,) * 3, moving((-1.0, 0.55, -1.0), (v, 0, 0)), RED, specular=0.3),
    )
    shot = CameraPath(lambda t: (0 * t, 1.9, 1.1), pitch=lambda t: -0.5 + 0 * t)
    return Scene("beginner", (_floor(), *bodies), shot)


def wires():
    """Wires about as thick as a pixel slide before a detailed wall; a camera rolled a little."""
    wires = [
        Body("box", (0.012, 1.5, 0.012), moving((x, 1.4, 0), (2.5, 0, 0)), (0.9, 0.9, 0.9))
        for x in np.arange(-3, 3, 0.4)
    ]
    shot = CameraPath(lambda t: (0 * t, 1.4, 2.6), roll=lambda t: 0.13 + 0 * t)
    return Scene("wires", (*_room(), *wires), shot)


def barrel():
    """A barrel turns about its axis, by 8.6 degrees a frame: its outline rests, its surface does
    not."""
    pattern = CREAM, RED, "CHECKER", (12, 8)
    body = Body("cylinder", (0.8, 0.8, 1.0), _turning(0.1, 1.2, -0.6, 0.15, lean=0.1), *pattern)
    return Scene("barrel", (*_room(), body), _before_the_wall())


def ball():
    """A ball turns about an upright axis, by 23 degrees a frame."""
    pattern = CREAM, BLUE, "BRICKS", (14, 10)
    body = Body("sphere", (0.9,) * 3, _turning(0.1, 1.3, -0.6, 0.4, lean=0.3), *pattern)
    return Scene("ball", (*_room(), body), _before_the_wall())


def passed_barrel():
    """The same barrel before a camera that moves aside: its outline moves, but not as its surface
    does."""
    return Scene("passed_barrel", barrel().bodies, _before_the_wall(2.0))


def passed_ball():
    return Scene("passed_ball", ball().bodies, _before_the_wall(2.0))


def _before_the_wall(speed=0.0):
    return CameraPath(lambda t: (speed * t, 1.4, 2.6), pitch=lambda t: -0.04 + 0 * t)


def _turning(x, y, z, turn, lean):
    """A place, upright but for the angle `lean`, with `turn` radians a frame about its axis."""
    return lambda t: (
        translation(x, y, z, t)
        @ rotation("z", lean, t)
        @ rotation("x", np.pi / 2, t)
        @ rotation("z", turn * FPS * t, t)
    )


TURNING = (barrel, ball, passed_barrel, passed_ball)
SCENES = {scene.__name__: scene for scene in (shaken, foliage, beginner, wires, *TURNING)}


def soft_disk(t, size=(90, 160), speed=18.0, soft=10.0):
    """Colour, motion and depth of a disk out of focus before a detailed wall, `t` frames later.

    Its rim is `soft` px wide. Vectors are averaged over the lens, depth is one sample's.
    """
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    wall = 0.45 + 0.3 * np.sign(np.sin(0.9 * x) * np.sin(0.7 * y + 0.2 * x))
    far = np.hypot(x - 80 - speed * t, y - 45)
    cover = np.clip((28 - far) / soft + 0.5, 0, 1)[..., None]
    color = wall[..., None] * (0.9, 0.7, 0.5) * (1 - cover) + np.multiply((0.1, 0.3, 0.8), cover)
    motion = cover * np.array([-speed, 0, speed, 0])
    depth = np.where(cover[..., 0] >= 0.5, 3.0, 9.0)
    return tuple(a.astype("f4") for a in (color, motion, depth))


NAMES = (*SCENES, "soft_disk")


def sharp(name, scene=None):
    """The frame of a scene, or of that of this name, between its neighbours."""
    if name == "soft_disk":
        return frame_of([soft_disk(t) for t in (0, -1, 1)])
    scene = scene or SCENES[name]()
    render = Render(scene, Blur("gather", shutter=0), size=SIZE, antialias=6)
    own, prev, after = (
        Frame(f.color, depth=f.depth, motion=_vectors(render, f, t))
        for t, f in ((t, render.frame(t / FPS)) for t in (0, -1, 1))
    )
    return own.between(prev, after)


def _vectors(render, frame, t, fine=4):
    """Those of the middles of pixels; of bodies that turn, means over pixels, as Blender's are."""
    if render.scene.name not in [scene.__name__ for scene in TURNING]:
        return render.blur.motion(frame)
    width, height = SIZE
    larger = Render(render.scene, render.blur, size=(fine * width, fine * height))
    parts = render.blur.motion(larger.frame(t / FPS)).reshape(height, fine, width, fine, 4)
    return parts.mean(axis=(1, 3)) / fine


def truth(name, degrees, scene=None):
    """The same with a shutter of so many degrees: (height, width, 3)."""
    if name == "soft_disk":
        times = Shutter(degrees).sample_times(128).astype(float)
        return np.mean([soft_disk(t)[0] for t in times], axis=0)
    blur = Blur("distributed", samples=256, shutter=degrees, seed=1)
    return Render(scene or SCENES[name](), blur, size=SIZE)(0.0)[..., :3]
