"""Output files: images or a video, each complete under its name or absent."""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from . import atomic, exr, record, stills, video
from .frame_file import FrameFile
from .frame_numbers import frame_path, is_pattern


class Output:
    """Output files: an image sequence, a single image, or a video.

    `settings`: written into the record of every file (see record.py), and compared when a run is
    resumed. `inputs`: the files that are read; an output that is one of them is refused, always.
    `overwrite` replaces any file that exists, `resume` only what wgmb wrote and is not done.
    `layers`: "all" that an EXR input holds go into the EXR output, or those of the "picture"
    only. `compression` of EXR: a name in exr.COMPRESSIONS, or "same" as the input's.
    """

    def __init__(
        self,
        pattern: str | Path,
        *,
        settings: dict[str, Any] | None = None,
        numbers: list[int],
        bits: int = 8,
        fps: Fraction = Fraction(24),
        inputs: Iterable[Path] = (),
        overwrite: bool = False,
        resume: bool = False,
        layers: str = "all",
        compression: str = "zip",
    ):
        _check_exr_options(pattern, layers, compression)
        self._layers, self._compression = layers, compression
        self.pattern, self.bits, self.numbers = Path(pattern), bits, numbers
        self.settings = json.dumps(settings or {}, sort_keys=True)
        suffix = self.pattern.suffix.lower()
        self._video: video.Video | None = None
        self._overwrite, self._resume = overwrite, resume
        self._abandoned = False
        self._under_way: Path | None = None
        if suffix not in (".exr", *stills.SUFFIXES, *video.SUFFIXES):
            known = ", ".join((".exr", *stills.SUFFIXES, *video.SUFFIXES))
            raise InputError(f"output {pattern}: the name must end in one of {known}")
        if bits not in (8, 16) or (bits == 16 and suffix in (".jpg", ".jpeg")):
            raise InputError(f"bits must be 8 or 16 (JPEG: 8), got {bits}")
        is_video = suffix in video.SUFFIXES
        if is_video and resume:
            raise InputError("--resume is not available for videos, only for frame files")
        if not is_video and len(numbers) > 1 and not is_pattern(pattern):
            raise InputError(
                f"output {pattern}: {len(numbers)} frames need a pattern such as out.####.exr"
            )
        names = [self.pattern.name] if is_video else [self.path(n).name for n in numbers]
        there = _that_exist(self.pattern.parent, names)
        refuse_inputs(self.pattern.parent, names, there, inputs)
        self._prepare_folder()
        if folders := [p for p in there if not p.is_file()]:
            raise InputError(f"output {folders[0]} exists and is not a file")
        if there and not (overwrite or resume):
            more = f" and {len(there) - 1} more" if len(there) > 1 else ""
            raise InputError(
                f"{there[0]}{more} exists; --overwrite replaces it"
                + ("" if is_video else ", --resume keeps finished frames")
            )
        atomic.sweep(self.pattern.parent, names)
        if is_video:
            temporary = atomic.temporary_name(self.pattern)
            self._video = video.Video(self.pattern, temporary, fps, self.settings)

    def _prepare_folder(self) -> None:
        folder = self.pattern.parent
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"output folder {folder}: {error.strerror}") from None
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(f"output folder {folder}: not writable")

    @property
    def is_video(self) -> bool:
        """True if all frames go into one file."""
        return self._video is not None

    def why_hopeless(self, error: BaseException) -> str:
        """The reason, if an error in writing one frame will meet the next ones too, else ""."""
        if not isinstance(error, OSError):
            return ""
        if self._video is not None:
            return str(error)
        what = os.strerror(error.errno) if error.errno else type(error).__name__
        return f"{self.pattern.parent}: {what}"

    def path(self, number: int) -> Path:
        """The file that frame `number` goes to."""
        return self.pattern if self._video else frame_path(self.pattern, number)

    def done(self, number: int, made_of: dict[str, Any] | None = None) -> bool:
        """Return True if frame `number` exists and is complete, with the same settings and inputs.

        `made_of`: what the frame depends on (see Clip.made_of). The file is read whole and
        its checksum compared. Raises InputError if another program wrote it.
        """
        path = self.path(number)
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            return False
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        content = record.read(data)
        if content is None and not (record.is_ours(data) or self._overwrite):
            raise InputError(f"{path} exists and was not written by wgmb; --overwrite replaces it")
        return content is not None and content == self._expected(made_of)

    def _expected(self, made_of: dict[str, Any] | None) -> dict[str, Any]:
        return json.loads(self.settings) | json.loads(json.dumps(made_of or {}))

    def write(
        self,
        result: np.ndarray,
        source: FrameFile,
        confidence: Mapping[str, np.ndarray] | None = None,
        made_of: dict[str, Any] | None = None,
    ) -> None:
        """Write one frame: into an EXR with all the other layers of `source`, if it is one.

        `confidence`: from Blur.with_confidence, becomes channels `confidence.NAME` of an EXR.
        `made_of`: what the frame depends on (see Clip.made_of), for its record. Where runs
        are resumed, a frame that another process has finished meanwhile is left as it is.
        """
        if self._abandoned:
            return
        layers = {f"confidence.{name}": plane for name, plane in (confidence or {}).items()}
        if layers and self.pattern.suffix.lower() != ".exr":
            raise InputError(f"{self.pattern}: only an .exr can store {', '.join(layers)}")
        if self._video is not None:
            self._video.add(result)
            return
        path = self.path(source.number)
        text = record.blank(self._expected(made_of))
        if path.suffix.lower() == ".exr":
            content = _with_result(source, result, text, layers, self._layers == "picture")
            data = exr.encode(content, self._compression)
        else:
            data = stills.encode(result, path.suffix, self.bits, text)
        if self._resume and self.done(source.number, made_of):
            return
        if not (self._resume or self._overwrite) and path.exists():
            raise InputError(f"{path} was written by another process during this run")
        self._under_way = atomic.temporary_name(path)
        atomic.write_file(path, *record.seal(data, text), temporary=self._under_way)

    def close(self) -> None:
        """Finish a video (OSError if it cannot be); pictures are finished one by one."""
        if self._video is None:
            return
        try:
            if not self._overwrite and self.pattern.exists():
                raise OSError("was written by another process during this run")
            self._video.close()
        except OSError as error:
            self.abandon()
            raise atomic.about(self.pattern, error) from None

    def abandon(self) -> None:
        """After an interruption or an error: leave no unfinished file."""
        self._abandoned = True
        if self._video is not None:
            self._video.abandon()
        elif self._under_way is not None:
            self._under_way.unlink(missing_ok=True)


def _that_exist(folder: Path, names: Iterable[str]) -> list[Path]:
    """The files of these names that there are in `folder`."""
    try:
        existing = set(os.listdir(folder))
    except OSError:  # not there yet, or said when it is prepared
        return []
    return [folder / name for name in names if name in existing]


def refuse_inputs(
    folder: Path, names: Iterable[str], there: Iterable[Path], inputs: Iterable[Path]
) -> None:
    """InputError where an output, NAME in `folder`, is one of `inputs`.

    By the folder itself, however it is reached; and, for `there`, the outputs that exist, by the
    file itself, whatever links lead to it.
    """
    place, wanted, folders = _identity(folder), set(names), {}
    outputs = {_identity(path): path for path in there}
    for path in inputs:
        if path.parent not in folders:
            folders[path.parent] = _identity(path.parent)
        same = place is not None and folders[path.parent] == place and path.name in wanted
        if same or (outputs and (own := _identity(path)) is not None and own in outputs):
            written = folder / path.name if same else outputs[_identity(path)]
            raise InputError(f"output {written} is the input {path}; choose another name or folder")


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and number of a file or folder; None where there is none."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _check_exr_options(pattern: str | Path, layers: str, compression: str) -> None:
    if layers not in ("all", "picture"):
        raise InputError(f"layers must be all or picture, got {layers!r}")
    exr.check_compression(compression)
    if compression != "zip" and Path(pattern).suffix.lower() != ".exr":
        raise InputError(f"compression {compression} needs an .exr output, got {pattern}")


def _with_result(
    source: FrameFile,
    result: np.ndarray,
    text: str,
    layers: Mapping[str, np.ndarray],
    only_picture: bool,
) -> exr.Exr:
    """The source's file with the picture replaced, layers and the record's text added.

    `only_picture`: without all other layers, and without what describes Cryptomattes.
    """
    more = {name: exr.to_half(plane) for name, plane in layers.items()}
    if source.file is None:
        made = exr.new(result, {record.KEY: text})
        made.parts[0].channels |= more
        return made
    new = {name: result[..., i] for i, name in enumerate(source.color)}
    parts = [
        replace(p, channels=dict(p.channels), attributes=dict(p.attributes))
        for p in source.file.parts
    ]
    twins = dict(zip(map(id, source.file.parts), parts, strict=True))
    home = twins[id(source.part)]
    for full, part, name in source.file.places():
        if full in new:
            kind = part.channels[name].dtype
            half = kind == np.float16
            twins[id(part)].channels[name] = (
                exr.to_half(new[full]) if half else new[full].astype(kind)
            )
        elif only_picture:
            del twins[id(part)].channels[name]
    home.channels |= more
    if only_picture:
        for name in [n for n in home.attributes if n.startswith("cryptomatte/")]:
            del home.attributes[name]
        parts = [home]
    parts[0].attributes[record.KEY] = text
    return exr.Exr(source.path, parts)
