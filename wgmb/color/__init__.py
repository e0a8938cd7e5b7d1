"""Colours: spaces, transfer, primaries, and display values."""
