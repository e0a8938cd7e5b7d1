"""Colours: spaces, transfer, primaries, and what a display shows."""
