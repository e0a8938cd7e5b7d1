"""A frame on the GPU: its textures, constants and motion, and the passes around a method."""
