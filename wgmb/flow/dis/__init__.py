"""Dense inverse search by OpenCV, what it loses, and a search where that matches better."""

from .inverse_search import Dis, DisShot, Found

__all__ = ["Dis", "DisShot", "Found"]
