"""Scenes that are rendered: bodies, volumes, figures, and the built-in ones."""

from .bodies import Body, at, moving, rotation, scaling, translation
from .builtin import SCENES, make
from .scene import CameraPath, Scene
from .volumes import Backdrop, OrbitingSphere, Torus

__all__ = [
    "SCENES",
    "Backdrop",
    "Body",
    "CameraPath",
    "OrbitingSphere",
    "Scene",
    "Torus",
    "at",
    "make",
    "moving",
    "rotation",
    "scaling",
    "translation",
]
