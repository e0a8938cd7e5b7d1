"""Videos: read, as linear light on the GPU, and written."""
