"""A frame on the GPU: its textures, constants and motion, and what surrounds a method."""
