"""Cuts that are known beforehand: frame numbers, an edit decision list, or an OpenTimelineIO file.

OpenTimelineIO is optional (the extra `edit`) and loaded when a file of it is read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..extras import needed_by
from ..files import bounded
from ..io.frame_numbers import frame_numbers, readable

_ONLY, _NONE = "only:", "none"
_FILE = re.compile(r"(?P<path>.*\.(?P<kind>edl|otio))(?:@(?P<fps>.*))?", re.IGNORECASE | re.DOTALL)
_MOST_BYTES = 16 << 20
_DEEPEST = 500  # lists within lists
_FPS = 24.0  # of an edit decision list, which does not say it
_TIMECODE = r"(\d\d):(\d\d):(\d\d)([:;.,])(\d\d\d?)"
_EVENT = re.compile(r"\d+\s.*?" + r"\s+".join([_TIMECODE] * 4) + r"\s*")
_AUDIO = re.compile(r"(A\d*|AA|NONE)", re.IGNORECASE)  # the tracks of an event


@dataclass(frozen=True)
class CutList:
    """Cuts as the user gives them.

    `text`: frames that begin a new shot, such as "101,155", or a file, `cut.edl[@FPS]` or
    `cut.otio[@FPS]`; "only:" before it switches the search for other cuts off; "none": there are
    no cuts, and none are searched for.
    """

    text: str = ""

    @property
    def is_search(self) -> bool:
        """True if cuts are searched for in the pictures too."""
        return self.text != _NONE and not self.text.startswith(_ONLY)

    @property
    def path(self) -> Path | None:
        """The file, if the text names one."""
        found = _FILE.fullmatch(self._plain)
        return Path(found["path"]) if found else None

    @property
    def _plain(self) -> str:
        return "" if self.text == _NONE else self.text.removeprefix(_ONLY)

    def anchored(self, folder: Path) -> CutList:
        """The same, its file named from `folder` on."""
        found = _FILE.fullmatch(self._plain)
        if found is None:
            return self
        begin = self.text.removesuffix(self._plain)
        return CutList(f"{begin}{folder / found['path']}{self._plain[found.end('path') :]}")

    def frames(self, first: int) -> frozenset[int]:
        """The frames that begin a new shot; `first`: the frame with which a file's edit begins."""
        if not self._plain:
            if self.text not in ("", _NONE):
                raise InputError(
                    f"`cuts` {self.text!r} must name cuts, such as only:101,155; "
                    "`cuts=none` means no cuts"
                )
            return frozenset()
        found = _FILE.fullmatch(self._plain)
        if found is None:
            if re.search(r"\.[A-Za-z]\w*(@.*)?$", self._plain):
                raise InputError(
                    f"cuts {self._plain}: must be frames such as 101,155, or a file .edl or .otio"
                )
            return frozenset(frame_numbers(self._plain, "cuts"))
        path, fps = Path(found["path"]), _rate(found["fps"], self._plain)
        if not readable(path):
            raise bounded.missing(path)
        read = _read_edl if found["kind"].lower() == "edl" else _read_otio
        edges = read(path, bounded.read(path, _MOST_BYTES, "an edit"), fps)
        begin, end = min(edges), max(edges)
        return frozenset(first + edge - begin for edge in edges - {begin, end})


def _rate(text: str | None, whole: str) -> float | None:
    if text is None:
        return None
    number, _, divisor = text.partition("/")
    try:
        fps = float(number) / float(divisor or 1)
    except (ValueError, ZeroDivisionError):
        fps = 0.0
    if not 1 <= fps <= 1000:
        raise InputError(f"cuts {whole}: a rate of 1 to 1000 must follow @, got {text!r}")
    return fps


def _read_edl(path: Path, data: bytes, fps: float | None) -> set[int]:
    """Begins and ends of the events of an edit decision list (CMX 3600), in frames."""
    nominal = round(fps or _FPS)  # timecode counts whole frames
    edges: set[int] = set()
    for line in data.decode("utf-8-sig", "replace").splitlines():
        if re.match(r"\s*FCM:\s*DROP", line, re.IGNORECASE):
            raise _dropped(path)
        event = _EVENT.fullmatch(line.strip())
        if event is None or all(_AUDIO.fullmatch(word) for word in _tracks(line)):
            continue
        parts = event.groups()
        for hours, minutes, seconds, mark, frames in (parts[10:15], parts[15:20]):
            if mark in ";,":
                raise _dropped(path)
            if int(frames) >= nominal:
                raise InputError(
                    f"{path}: timecode {hours}:{minutes}:{seconds}{mark}{frames} is not one of "
                    f"{nominal} frames per second; {path}@25 sets 25"
                )
            passed = 3600 * int(hours) + 60 * int(minutes) + int(seconds)
            edges.add(nominal * passed + int(frames))
    if not edges:
        raise InputError(f"{path}: no video events of an edit decision list (CMX 3600)")
    return edges


def _tracks(line: str) -> list[str]:
    """The tracks of an event, the word before its kind of edit: V, A2, AA/V."""
    words = line.split()
    kinds = [i for i, word in enumerate(words) if i > 1 and re.fullmatch(r"[CDWK]\d*[BO]?", word)]
    return words[kinds[0] - 1].split("/") if kinds else ["V"]


def _dropped(path: Path) -> InputError:
    return InputError(f"{path}: drop frame timecode is not supported; export it as non-drop frame")


def _read_otio(path: Path, data: bytes, fps: float | None) -> set[int]:
    """Begins and ends of the clips on all video tracks of a timeline, in frames."""
    text = data.decode("utf-8", "replace")
    if _depth(text) > _DEEPEST:  # the library would crash
        raise InputError(f"{path}: lists are nested over {_DEEPEST} deep, too deep for an edit")
    with needed_by(str(path)):
        import opentimelineio as otio
    try:
        timeline = otio.core.deserialize_json_from_string(text)
        is_timeline = isinstance(timeline, otio.schema.Timeline)
        tracks = timeline.video_tracks() if is_timeline else ()
        moments = [moment for track in tracks for moment in _edges(otio, track)]
        edges = {round(m.rescaled_to(fps or m.rate).value) for m in moments}
    except Exception as error:  # the library raises what it likes
        lines = str(error).splitlines() or [type(error).__name__]
        raise InputError(f"{path}: not a readable OpenTimelineIO file: {lines[0]}") from None
    if not edges:
        raise InputError(f"{path}: no clips on video tracks")
    return edges | {0}  # a timeline may begin with a gap


def _depth(json: str) -> int:
    """Nesting depth of lists and objects."""
    bare = re.sub(r'"(?:[^"\\]|\\.)*"', "", json, flags=re.DOTALL).encode()
    marks = np.frombuffer(bare, np.uint8)
    steps = np.isin(marks, list(b"[{")).astype(int) - np.isin(marks, list(b"]}"))
    return int(steps.cumsum().max(initial=0))


def _edges(otio: Any, track: Any) -> Iterator[Any]:
    """Begins and ends of a track's clips, and of the clips within them."""
    for item in track:
        if isinstance(item, (otio.schema.Gap, otio.schema.Transition)) or not item.enabled:
            continue
        place = track.range_of_child(item)
        yield place.start_time
        yield place.end_time_exclusive()
        for clip in item.find_clips() if isinstance(item, otio.core.Composition) else ():
            begin = track.range_of_child(clip).start_time
            if place.contains(begin):
                yield begin
