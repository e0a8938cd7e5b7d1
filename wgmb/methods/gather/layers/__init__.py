"""Layers: silhouettes as a surface and what is behind it, in the light of the frame."""
