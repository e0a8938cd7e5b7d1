"""One file: EXR, still images, names and numbers of frames, atomic writing; no GPU."""
