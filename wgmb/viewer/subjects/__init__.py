"""Subjects of the viewer: scenes, frames and videos, drawn into textures."""
