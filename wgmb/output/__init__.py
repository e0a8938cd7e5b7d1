"""Results on their way to files."""
