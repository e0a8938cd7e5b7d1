"""One motion as vectors of every program's convention."""

import numpy as np

import make_frames as make
from wgmb.sequence.layers.vectors import Vectors

BOTH = ("blender", "nuke", "plain")  # the others write one direction only
ONE = ("arnold", "vray", "rsmb", "velocity")


def told(convention: str, **more) -> Vectors:
    """Options that read `make.written(convention)`."""
    if convention == "rsmb":
        more = {"scale": 2 * make.MAX_DISPLACE} | more
    return Vectors("plain" if convention == "velocity" else convention, **more)


def side_by_side(motion) -> np.ndarray:
    return np.concatenate(motion, axis=2)


def moving(rng_seed=0):
    """Two different displacements for every pixel, so that no mix-up stays unseen."""
    rng = np.random.default_rng(rng_seed)
    shape = (make.HEIGHT, make.WIDTH, 2)
    return (rng.uniform(-12, 12, shape).astype("f4"), rng.uniform(-12, 12, shape).astype("f4"))
