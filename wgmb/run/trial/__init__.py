"""A trial of the settings of a video at some places of it."""
