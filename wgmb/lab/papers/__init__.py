"""Experiments of the papers that wgmb grew from."""
