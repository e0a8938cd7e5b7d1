"""Texts of a video file, such as its title and comment: which of them a new file holds."""

from __future__ import annotations

import io
import re
from typing import cast

import av
from av.video.stream import VideoStream

from ...io import record

_OF_THE_FILE = ("major_brand", "minor_version", "compatible_brands", "encoder")  # of the input's
_APPLE = "com.apple."
_ANY_KEY = {"movflags": "use_metadata_tags"}  # Apple's newer form, which players of MP4 do not read
_LONGEST = 40  # characters of a name that are shown
_SECOND_NAME = re.compile(r"(.+)-[a-z]{3}")  # of a text that states its language


def fitting(suffix: str, texts: dict[str, str]) -> tuple[dict[str, str], dict[str, str], list[str]]:
    """The texts that a file of this kind holds, the muxer's options for them, and the losses.

    `texts`: by FFmpeg's names. What is lost is in words, for the reader. Facts about the input's
    file and records of it (see io/record.py) are no texts of the new file. MP4 has a list of
    texts that players know. MOV has one, too, and where that is too short another form, which
    holds any. Matroska and WebM hold all, a GIF one comment.
    """
    wanted = {
        key: text
        for key, text in texts.items()
        if key and text and key.lower() not in _OF_THE_FILE and not record.is_begun(text)
    }
    options: dict[str, str] = {}
    lost: list[str] = []
    if suffix == ".gif":
        lost = [key for key in wanted if key.lower() != "comment"]
    elif suffix in (".mp4", ".mov") and wanted:
        lost = _lost(suffix[1:], wanted)
        if lost and (suffix == ".mov" or any(key.startswith(_APPLE) for key in lost)):
            options, lost = _ANY_KEY, []
    held = {key: text for key, text in wanted.items() if key not in lost}
    return held, options, _message(suffix, lost)


def _lost(container: str, texts: dict[str, str]) -> list[str]:
    """The names of texts that are missing or cut off in a trial file."""
    file = io.BytesIO()
    with av.open(file, "w", format=container) as trial:
        stream = cast(VideoStream, trial.add_stream("mpeg4", rate=24))
        stream.width = stream.height = 16
        trial.metadata.update(texts)
        trial.start_encoding()
    file.seek(0)
    with av.open(file, metadata_errors="replace") as trial:
        held = {key.lower(): text for key, text in trial.metadata.items()}
    return [
        key
        for key, text in texts.items()
        if _is_lost(text, held.get(key.lower())) and not _is_said_twice(key, texts)
    ]


def _is_lost(text: str, held: str | None) -> bool:
    """Places and dates may be written in another way, which is no loss."""
    return held is None or (len(held) < len(text) and text.startswith(held))


def _is_said_twice(key: str, texts: dict[str, str]) -> bool:
    match = _SECOND_NAME.fullmatch(key)
    return match is not None and texts.get(match[1]) == texts[key]


def _message(suffix: str, lost: list[str]) -> list[str]:
    if not lost:
        return []
    names = ", ".join(_quoted(key) for key in lost)
    texts = f"texts {names} are" if len(lost) > 1 else f"text {names} is"
    them = "them" if len(lost) > 1 else "it"
    return [f"{texts} left out: {suffix} cannot hold {them} (.mkv holds {them})"]


def _quoted(key: str) -> str:
    plain = key.isascii() and key.isprintable() and len(key) <= _LONGEST
    return key if plain else ascii(key[:_LONGEST])
