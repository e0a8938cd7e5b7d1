"""Scenes that are rendered: bodies, volumes, figures, and the built-in ones."""

from .bodies import Body, at, moving, rotation, scaling, translation
from .builtin import SCENES, make
from .scene import Scene, Shot
from .volumes import Orbit, Stage, Torus

__all__ = [
    "SCENES",
    "Body",
    "Orbit",
    "Scene",
    "Shot",
    "Stage",
    "Torus",
    "at",
    "make",
    "moving",
    "rotation",
    "scaling",
    "translation",
]
