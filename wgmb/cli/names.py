"""Names of several videos: folders and patterns of inputs, and an output for each."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ..errors import InputError
from ..io import stills
from ..io.frame_numbers import is_pattern
from ..io.suffixes import KNOWN_VIDEOS, VIDEOS
from ..output.names import refuse_inputs
from ..sequence.folder import frames_in
from ..sequence.frame_file import is_video
from ..settings import InputSettings

NAME = "{name}"
"""In an output: the name of the input without folder and suffix."""
_ELSE = ".mkv"  # what holds every stream, for inputs whose own container is not written


@dataclass(frozen=True)
class FramesNamed:
    """Frames on the command line: their pattern, the settings of the input, and what to say."""

    pattern: str
    input: InputSettings
    text: str = ""


def frames_at(pattern: str, input: InputSettings, output: str = "") -> FramesNamed:
    """The frames that a pattern, a file or a folder stands for; `output`: no input in a folder.

    Of a folder, files that `input` adds are the only ones beside the picture.
    """
    if not Path(pattern).is_dir():
        return FramesNamed(pattern, input)
    found = frames_in(pattern, input.also, leave_out=output)
    return FramesNamed(found.pattern, replace(input, also=found.also), found.text)


def holds_videos(folder: str) -> bool:
    """True if there are videos in a folder, by their names."""
    return any(p.suffix.lower() in KNOWN_VIDEOS for p in Path(folder).iterdir())


def is_frames_output(output: str) -> bool:
    """True if an output is named as frames are."""
    return Path(output).suffix.lower() in (".exr", *stills.SUFFIXES)


def is_batch(patterns: Sequence[str], output: str) -> bool:
    """Return True if the inputs may be several videos, or the output is named after a video."""
    if len(patterns) > 1 or any(Path(p).is_dir() or _has_wildcard(p) for p in patterns):
        return True
    return (NAME in output or is_folder(output)) and is_video(patterns[0])


def videos_of(patterns: Sequence[str]) -> list[Path]:
    """The videos that files, folders and patterns such as clips/*.mp4 stand for, in order."""
    paths: list[Path] = []
    for pattern in patterns:
        path = Path(pattern)
        if path.is_dir():
            inside = sorted(
                p for p in path.iterdir() if p.suffix.lower() in KNOWN_VIDEOS and p.is_file()
            )
            if not inside:
                known = " ".join(KNOWN_VIDEOS)
                raise InputError(
                    f"{pattern}: a folder without videos ({known}); frames need a pattern such as "
                    f"{path / 'shot.####.exr'}"
                )
            paths += inside
        elif _has_wildcard(pattern):
            matches = sorted(map(Path, glob.glob(pattern)))
            if not matches:
                raise InputError(f"{pattern}: no such files")
            paths += matches
        else:
            paths.append(path)
    for path in paths:
        is_frames = is_pattern(path) and not path.is_file()
        if is_frames or path.suffix.lower() in (".exr", *stills.SUFFIXES):
            such = next((p.replace("*", "####") for p in patterns if _is_of_frames(p)), "")
            raise InputError(
                f"{path}: several inputs must be videos; frames need one pattern such as "
                f"'{such or 'shot.####.exr'}', in quotes"
            )
    return paths


def outputs_of(videos: Sequence[Path], output: str) -> list[str]:
    """The output of each video, in a folder or with its name in the place of {name}.

    InputError where two would be one, or one is an input.
    """
    if not is_folder(output) and NAME not in output and len(videos) > 1:
        raise InputError(
            f"output {output}: {len(videos)} videos need a folder that is there or ends in "
            f"{os.sep}, or {NAME} in the name, which stands for the input's"
        )
    names = [_output_of(video, output) for video in videos]
    taken: dict[Path, Path] = {}
    for video, name in zip(videos, names, strict=True):
        key = Path(os.path.normcase(Path(name).parent.resolve() / Path(name).name))
        if key in taken:
            raise InputError(f"{taken[key]} and {video} would both be written to {name}")
        taken[key] = video
    for name in map(Path, names):
        there = [name] if name.exists() else []
        refuse_inputs(name.parent, [name.name], there, videos)
    return names


def _output_of(video: Path, output: str) -> str:
    if NAME in output:
        return output.replace(NAME, video.stem)
    if not is_folder(output):
        return output
    suffix = video.suffix if video.suffix.lower() in VIDEOS else _ELSE
    return str(Path(output) / f"{video.stem}{suffix}")


def is_folder(output: str) -> bool:
    """True if an output is a folder: it is there, or ends as one."""
    return output.endswith(("/", os.sep)) or Path(output).is_dir()


def _is_of_frames(pattern: str) -> bool:
    """Return True for shot.*.exr."""
    return Path(pattern).name.count("*") == 1 and "." in pattern.partition("*")[2]


def _has_wildcard(pattern: str) -> bool:
    """Return True for clips/*.mp4, unless there is a file of just that name."""
    wild = any(c in pattern for c in "*?[")
    return wild and not is_pattern(pattern) and not Path(pattern).exists()
