"""Conventions of motion vectors: layers that programs write, and the meaning of their numbers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Convention:
    """A program's convention. `signs` turn its vectors into displacements [px], y down."""

    about: str
    stems: tuple[str, ...]  # end of the layer's name: lower case, letters and digits (names.ending)
    prev: tuple[int, int] | None  # which components lead to the previous frame
    next: tuple[int, int] | None
    prev_sign: tuple[int, int] = (1, 1)
    next_sign: tuple[int, int] = (1, 1)
    components: tuple[str, ...] = ()  # the layer must have these, if any are named
    offset: float = 0.0  # what stands for no motion
    of_picture: bool = False  # 1 is the picture's width and height, not a pixel


CONVENTIONS: dict[str, Convention] = {
    "blender": Convention(
        "Vector pass: pixels, y up; XY = P(n-1) - P(n), ZW = P(n) - P(n+1)",
        ("vector",),
        (0, 1),
        (2, 3),
        (1, -1),
        (-1, 1),
        ("x", "y", "z", "w"),
    ),
    "nuke": Convention(
        "forward.u/v to the next, backward.u/v to the previous frame: pixels, y up",
        ("forward", "backward"),
        (0, 1),
        (0, 1),
        (1, -1),
        (1, -1),
    ),
    "arnold": Convention(
        "motionvector: pixels to the next frame, y up; scale by 2 if rendered for half a frame",
        ("motionvector",),
        None,
        (0, 1),
        (1, -1),
        (1, -1),
    ),
    "vray": Convention(
        "velocity: pixels to the next frame, y up, 0.5 added; scale by 2 x max velocity if clamped",
        ("velocity", "vrayvelocity"),
        None,
        (0, 1),
        (1, -1),
        (1, -1),
        ("r", "g"),
        0.5,
    ),
    "rsmb": Convention(
        "0..1, 0.5 is no motion, y up, to the next frame; scale by 2 x MaxDisplace",
        ("rsmb", "mv2dtoxik", "mv2dtoonz", "mv2d", "lm2dmv", "2dmotionvector",
         "velocityfield"),
        None,
        (0, 1),
        (1, -1),
        (1, -1),
        (),
        0.5,
    ),
    "unreal": Convention(
        "MovieRenderQueue_MotionVectors: from the previous frame, 0..1 is the picture, 0.5 added",
        ("movierenderqueuemotionvectors",),
        None,
        (0, 1),
        (1, -1),
        (1, -1),
        ("r", "g"),
        0.5,
        True,
    ),
    "plain": Convention(
        "to_prev.x/y, to_next.x/y or velocity.x/y (to the next frame): pixels, y down",
        (
            "toprev", "tonext", "velocity", "velocities", "motion", "motionvectors", "mv", "mvs",
            "motionvec", "motionvecs", "motionvect", "vector", "vectors", "vect", "vec",
            "motionfore", "motionback", "backvector", "backwardvector", "forwardvector",
            "fwd", "bwd", "flow", "opticalflow", "forwardflow", "backwardflow",
        ),
        (0, 1),
        (0, 1),
    ),
}  # fmt: skip
STEMS = frozenset(stem for convention in CONVENTIONS.values() for stem in convention.stems)
