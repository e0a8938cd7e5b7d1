"""Files: images, videos, layers, sequences. Independent of the GPU."""
