"""Motion of pictures by dense inverse search and blocks, in WGSL alone: for devices with a GPU."""

from .search import DenseInverseSearch, DenseShot

__all__ = ["DenseInverseSearch", "DenseShot"]
