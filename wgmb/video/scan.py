"""Facts about a video that only its decoded pictures tell: cuts, flashes, repeated pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ..io.frame_numbers import numbered
from ..shots.reader import Picture, ShotReader
from ..threads import ahead
from .read.reader import VideoReader
from .thumbnail import Thumbnail, change, is_cut

_READ_AHEAD = 2  # coded pictures


def scan_video(reader: VideoReader, tell: Callable[[int, str, str], None]) -> list[tuple[str, str]]:
    """(name, text) lines about all pictures of a video, which are decoded for them.

    `tell`: called after every picture, see `terminal.progress`.
    """
    times = reader.times

    def pictures() -> Iterator[Picture[Thumbnail]]:
        for number, coded in ahead(reader.pictures(), _READ_AHEAD):
            yield Picture(float(times[number]), Thumbnail(coded), number)
            tell(number, "done", "picture")

    shots = ShotReader(pictures(), is_cut=is_cut, change=change)
    for time in times:
        shots.at(float(time))
    lines = [("cuts", _cuts(reader, sorted(shots.cuts)))]
    if shots.flashes:
        lines.append(("flashes", f"at {_pictures(shots.flashes)}"))
    if shots.doubles:
        lines.append(("repeated", f"{len(shots.doubles)}: {_pictures(shots.doubles)}"))
    return lines


def _cuts(reader: VideoReader, numbers: Sequence[int]) -> str:
    """Every cut with its time."""
    if not numbers:
        return "none found"
    parts = (f"{number} ({float(reader.times[number]):.2f} s)" for number in numbers)
    return f"before picture {', '.join(parts)}"


def _pictures(numbers: Sequence[int]) -> str:
    found = sorted(numbers)
    return numbered(found, "picture")
