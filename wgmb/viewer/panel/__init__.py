"""The panel beside the picture, and text over it."""
