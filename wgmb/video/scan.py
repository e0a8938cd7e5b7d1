"""Facts about a video that only its decoded pictures tell: cuts, flashes, repeated pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ..io.frame_numbers import frame_list
from ..shots.reader import Picture, ShotReader
from ..threads import ahead
from .read.reader import VideoReader
from .thumbnail import Thumbnail, is_cut, is_double

_READ_AHEAD = 2  # coded pictures


def scan_video(
    footage: VideoReader, tell: Callable[[int, str, str], None]
) -> list[tuple[str, str]]:
    """(name, text) lines about all pictures of a video, which are decoded for them.

    `tell`: called after every picture, see `terminal.progress`.
    """
    times = footage.times

    def pictures() -> Iterator[Picture[Thumbnail]]:
        for number, coded in ahead(footage.pictures(), _READ_AHEAD):
            yield Picture(float(times[number]), Thumbnail(coded), number)
            tell(number, "done", "picture")

    reel = ShotReader(pictures(), is_cut=is_cut, is_double=is_double)
    for time in times:
        reel.at(float(time))
    lines = [("cuts", _cuts(footage, sorted(reel.cuts)))]
    if reel.flashes:
        lines.append(("flashes", f"at {_pictures(reel.flashes)}"))
    if reel.doubles:
        lines.append(("repeated", f"{len(reel.doubles)}: {_pictures(reel.doubles)}"))
    return lines


def _cuts(footage: VideoReader, numbers: Sequence[int]) -> str:
    """Every cut with its time."""
    if not numbers:
        return "none found"
    parts = (f"{number} ({float(footage.times[number]):.2f} s)" for number in numbers)
    return f"before picture {', '.join(parts)}"


def _pictures(numbers: Sequence[int]) -> str:
    found = sorted(numbers)
    return f"picture{'s' if len(found) > 1 else ''} {frame_list(found)}"
