"""Dense inverse search by OpenCV, and a search of blocks where that loses something."""

from .inverse_search import Dis, DisShot, Found

__all__ = ["Dis", "DisShot", "Found"]
