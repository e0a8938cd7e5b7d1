"""Layers: silhouettes as a surface and its background, in the light of the frame."""
