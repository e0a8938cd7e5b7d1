"""Frames on disk, and what an unbroken run makes of them."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import make_frames as make

from .processes import wgmb

_DIFFERENT = 6  # pictures, however many frames
_MOST_LINKS = 30_000  # of one file; some file systems allow no more than 65,000


@dataclass(frozen=True)
class Shot:
    """Frames as files, and how they are blurred."""

    folder: Path
    count: int
    method: str = "tap"

    @property
    def pattern(self) -> str:
        """The pattern of the frames."""
        return str(self.folder / "shot.####.exr")

    def arguments(self, out: Path, *more: str, target: Path | None = None) -> list[str]:
        """`wgmb blur` of the frames into the folder `out`, or to `target`."""
        # By a constant convention, as the frames do not follow each other.
        target = target or out / "o.####.exr"
        words = ["blur", self.pattern, "-o", target, "--method", self.method]
        return [str(word) for word in (*words, "--vectors", "blender", *more)]

    def whole(self, out: Path, *more: str) -> dict[str, bytes]:
        """Files that an unbroken run writes into `out`: contents by name."""
        ended = wgmb(*self.arguments(out, *more), seconds=600)
        found = contents(out)
        if ended.code or len(found) != self.count:
            raise RuntimeError(f"{len(found)} of {self.count} files, {ended.wrong(0)}")
        return found


def shot(folder: Path, count: int, method: str = "tap", times: int = 1) -> Shot:
    """Frames 1 to `count` of 64 x 48 pixels, of a few pictures; `times` as wide and high."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures: list[Path] = []
    for n in range(1, count + 1):
        if n <= _DIFFERENT:
            channels = {k: np.tile(v, (times, times)) for k, v in make.frame(n).items()}
            pictures.append(make.write_exr(folder / f"of.{n}.exr", channels))
        elif (n - 1) % _MOST_LINKS < _DIFFERENT:
            i = (n - 1) % _DIFFERENT
            pictures[i] = Path(shutil.copy(pictures[i], folder / f"of.{n}.exr"))
        (folder / f"shot.{n:04d}.exr").hardlink_to(pictures[(n - 1) % _DIFFERENT])
    return Shot(folder, count, method)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder by its name, those with a temporary name too."""
    found = {}
    for path in folder.iterdir() if folder.exists() else ():
        try:
            found[path.name] = path.read_bytes()
        except FileNotFoundError:  # it got another name meanwhile
            continue
    return found


def apart_from(found: dict[str, bytes], whole: dict[str, bytes], *, all_there: bool) -> str:
    """Differences from the files of an unbroken run; "" if there are none.

    Without `all_there` some may be missing, and unfinished ones with temporary names be there.
    """
    temporary = [name for name in found if name.startswith(".")]
    final = {name: data for name, data in found.items() if name not in temporary}
    if wrong := sorted(name for name, data in final.items() if whole.get(name) != data):
        return f"wrong bytes in {wrong[0]}" + (f" and {len(wrong) - 1} more" if wrong[1:] else "")
    if all_there and len(final) < len(whole):
        return f"{len(final)} of {len(whole)} files"
    return f"left over: {temporary[0]}" if all_there and temporary else ""
