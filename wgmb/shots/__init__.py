"""Shots: where they begin, and their pictures read once from first to last."""
