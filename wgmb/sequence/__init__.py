"""Rendered frames on disk: a pattern in, Frames out."""
