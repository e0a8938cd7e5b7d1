"""Files: pictures, videos, layers, sequences. Nothing here knows a GPU."""
