"""Tiles: where something moves, and from which motions a search starts there."""
