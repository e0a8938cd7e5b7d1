"""Frames, scenes and videos as an eye perceives them: each is held, and earlier ones fade."""
