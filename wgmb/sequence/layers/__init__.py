"""Layers of a rendered frame, found by the names that programs give them."""
