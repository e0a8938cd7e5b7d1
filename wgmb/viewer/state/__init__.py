"""The viewer's settings: one value, TOML, and words of a command line."""
