"""Blur the sample: EXR and PNG frames, a short MP4, and a picture of before and after."""

import os
import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np

from wgmb.cli import app
from wgmb.color.srgb import to_display
from wgmb.sequence import clip

HERE = Path(os.path.relpath(Path(__file__).parent))
OUT = HERE.parent / "out"
FRAMES = str(HERE / "crossing.####.exr")


def picture(pattern: str) -> np.ndarray:
    """Frame 10 of a pattern of EXR files as display values."""
    source = clip.Clip(pattern, frames="10").source(10)
    return to_display(source.rgba[..., :3].astype(np.float32), 8)


def main() -> int:
    """Run what a person would type, then put two of the pictures side by side."""
    for output in ("blurred.####.exr", "blurred.####.png", "blurred.mp4"):
        command = ["blur", FRAMES, "-o", str(OUT / output), "--shutter", "180", "--fps", "2"]
        sys.stderr.write(f"wgmb {' '.join(command)}\n")
        if code := app.main([*command, "--overwrite"]):
            return code
    before, after = picture(FRAMES), picture(str(OUT / "blurred.####.exr"))
    gap = np.full((before.shape[0], 4, 3), 255, np.uint8)
    iio.imwrite(OUT / "before_after.png", np.hstack([before, gap, after]))
    sys.stderr.write(f"look at {OUT / 'before_after.png'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
