"""A program that runs wgmb where nothing is installed but its core; test_core_alone.py calls it.

Its argument is a folder: results.npz has pictures by name, said.json what was said where a package
is missing.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np

import make_frames as make
import wgmb
from wgmb.io import stills
from wgmb.scene import builtin

SIZE = 32, 20
FRAMES = (1, 2, 3)


def results(folder: Path) -> dict[str, np.ndarray]:
    """Pictures of every method, of arrays, scenes and EXR files, by name."""
    return methods() | scenes() | batches(folder) | shown()


def methods() -> dict[str, np.ndarray]:
    """Every method that blurs frames, of frames with neighbours."""
    frames = []
    for number in FRAMES:
        to_prev, to_next = make.motion(number)
        depth = 10 - to_next[..., 0]
        color = make.picture(number)
        frames.append(wgmb.Frame(color, to_next, to_prev=to_prev, depth=depth, number=number))
    frame = frames[1].between(frames[0], frames[2])
    whole = [name for name, made in wgmb.METHODS.items() if made.needs <= frame.has]
    return {name: wgmb.Blur(name, samples=8)(frame) for name in whole}


def scenes() -> dict[str, np.ndarray]:
    """The other methods, of scenes."""
    made = {}
    for name, scene in (("distributed", "crossing"), ("accumulate", "wheel")):
        blur = wgmb.Blur(name, samples=4)
        made[name] = wgmb.Render(builtin.make(scene), blur, size=SIZE)(0.0)
    fog = wgmb.Render(builtin.make("torusphere"), wgmb.Blur("volume"), size=SIZE)
    return made | {"volume": fog(0.0)}


def batches(folder: Path) -> dict[str, np.ndarray]:
    """EXR files in, EXR files out: blurred by vectors and by the search, and vectors."""
    pattern = make.write_sequence(folder, FRAMES)
    made = {}
    for name, said, motion in (
        ("vectors", "auto", None),
        ("search", "none", wgmb.Flow(quality="fast")),
    ):
        clip = wgmb.Clip(pattern, passes=wgmb.Passes(vectors=wgmb.Vectors(said)))
        if motion:
            clip.move_by(motion)
        output = wgmb.Output(folder / f"{name}.####.exr", numbers=clip.numbers, overwrite=True)
        report = wgmb.blur_sequence(clip, wgmb.Blur("tap"), output)
        assert report.done == [*FRAMES], report.failed
        channels = make.plain_read(output.path(2))
        made |= {f"{name} {channel}": channels[channel] for channel in channels}
    return made


def shown() -> dict[str, np.ndarray]:
    """The display of a frame in a notebook: the bytes of a PNG."""
    return {"png": np.frombuffer(wgmb.Frame(make.picture(1))._repr_png_(), np.uint8)}


def said(folder: Path) -> dict[str, str]:
    """Messages about each missing extra."""
    asked = {
        "png": lambda: stills.read(_some_png(folder)),
        "png output": lambda: wgmb.Output("o.####.png", numbers=[1, 2]),
        "jpeg output": lambda: wgmb.Output("o.####.jpg", numbers=[1, 2]),
        "tiff output": lambda: wgmb.VectorOutput("o.####.tif", "rsmb", numbers=[1, 2]),
        "mp4 output": lambda: wgmb.Output("o.mp4", numbers=[1, 2]),
        "explore": lambda: wgmb.explore(wgmb.Frame(make.picture(1))),
        "config": lambda: wgmb.ColorConfig("builtin"),
    }
    told = {}
    for name, ask in asked.items():
        try:
            ask()
        except wgmb.InputError as error:
            told[name] = str(error)
    done = subprocess.run(
        [sys.executable, "-m", "wgmb", "devices"], capture_output=True, text=True, timeout=60
    )
    return told | {"command": f"{done.returncode} {done.stderr}"}


def _some_png(folder: Path) -> Path:
    """The beginning of a PNG; where it is read, that is all that is wrong with it."""
    path = folder / "some.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(4) + b"IHDR" + b"\0\0\0\x01" * 8 + b"IEND")
    return path


def main(folder: Path) -> None:
    """Write the files."""
    np.savez(folder / "results.npz", **results(folder))
    there = sorted(d.metadata["Name"].lower() for d in metadata.distributions())
    text = {"numpy": np.__version__, "installed": there, "said": said(folder)}
    (folder / "said.json").write_text(json.dumps(text))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
