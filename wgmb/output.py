"""Where results go: pictures or a video, each file complete under its name or not there."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from . import exr, stills, video
from .errors import InputError
from .numbering import frame_path, is_pattern
from .source import Source

SETTINGS = "wgmb"  # attribute and keyword under which the settings are written


def replace_file(path: Path, data: bytes) -> None:
    """Put `data` at `path`: all of it under a temporary name, then renamed.

    Raises OSError, and then nothing has changed.
    """
    temporary = temporary_name(path)
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OSError(f"{path}: {error.strerror or error}") from None
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def temporary_name(path: Path) -> Path:
    """Where a file is written before it gets its name: beside it, always the same."""
    return path.with_name(f".{path.name}.part")


class Output:
    """Where results go: a pattern of pictures, one picture, or a video.

    `settings`: written into every file, and compared when a run is resumed. `layers`: "all" that
    an EXR input holds go into the EXR output, or those of the "picture" only. `compression` of
    EXR: a name in exr.COMPRESSIONS, or "same" as the input's.
    """

    def __init__(
        self,
        pattern: str | Path,
        *,
        settings: dict | None = None,
        numbers: list[int],
        bits: int = 8,
        fps: Fraction = Fraction(24),
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
        self._abandoned = False
        if suffix not in (".exr", *stills.SUFFIXES, *video.SUFFIXES):
            known = ", ".join((".exr", *stills.SUFFIXES, *video.SUFFIXES))
            raise InputError(f"output {pattern}: the name must end in one of {known}")
        if bits not in (8, 16) or (bits == 16 and suffix in (".jpg", ".jpeg")):
            raise InputError(f"bits must be 8 or 16 (JPEG: 8), got {bits}")
        is_video = suffix in video.SUFFIXES
        if is_video and resume:
            raise InputError("--resume continues frame files; a video starts anew")
        if not is_video and len(numbers) > 1 and not is_pattern(pattern):
            raise InputError(
                f"output {pattern}: {len(numbers)} frames need a pattern such as out.####.exr"
            )
        self._prepare_folder()
        paths = [self.pattern] if is_video else [self.path(n) for n in numbers]
        there = [p for p in paths if p.exists()]
        if folders := [p for p in there if not p.is_file()]:
            raise InputError(f"output {folders[0]}: is not a file")
        if there and not (overwrite or resume):
            more = f" and {len(there) - 1} more" if len(there) > 1 else ""
            raise InputError(
                f"{there[0]}{more} exists; --overwrite replaces it"
                + ("" if is_video else ", --resume keeps what is done")
            )
        for path in paths:
            temporary_name(path).unlink(missing_ok=True)
        if is_video:
            self._video = video.Video(
                self.pattern, temporary_name(self.pattern), fps, self.settings
            )

    def _prepare_folder(self) -> None:
        folder = self.pattern.parent
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"output folder {folder}: {error.strerror}") from None
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(f"output folder {folder}: not writable")

    def path(self, number: int) -> Path:
        """The file that frame `number` goes to."""
        return self.pattern if self._video else frame_path(self.pattern, number)

    def done(self, number: int, inputs: list[Path]) -> bool:
        """Whether frame `number` is there, newer than its inputs, with the same settings."""
        path = self.path(number)
        try:
            written = path.stat().st_mtime_ns
            if any(p.stat().st_mtime_ns > written for p in inputs):
                return False
            if path.suffix.lower() == ".exr":
                header = exr.read(path, header_only=True)
                return header.parts[0].attributes.get(SETTINGS) == self.settings
            return stills.settings_of(path) == self.settings
        except (OSError, InputError):
            return False

    def write(
        self,
        result: np.ndarray,
        source: Source,
        confidence: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        """Write one frame: into an EXR with all the other layers of `source`, if it is one.

        `confidence`: from Blur.with_confidence, becomes channels `confidence.NAME` of an EXR.
        """
        if self._abandoned:
            return
        layers = {f"confidence.{name}": plane for name, plane in (confidence or {}).items()}
        if layers and self.pattern.suffix.lower() != ".exr":
            raise InputError(f"{self.pattern}: only an .exr has room for {', '.join(layers)}")
        if self._video is not None:
            self._video.add(result)
            return
        path = self.path(source.number)
        if path.suffix.lower() == ".exr":
            content = _with_result(source, result, self.settings, layers, self._layers == "picture")
            data = exr.encode(content, self._compression)
        else:
            data = stills.encode(result, path.suffix, self.bits, self.settings)
        replace_file(path, data)

    def close(self) -> None:
        """Finish a video (OSError if it cannot be); pictures are finished one by one."""
        if self._video is None:
            return
        try:
            self._video.close()
        except OSError as error:
            self.abandon()
            raise OSError(f"{self.pattern}: {error.strerror or error}") from None

    def abandon(self) -> None:
        """After an interruption or an error: leave no unfinished file."""
        self._abandoned = True
        if self._video is not None:
            self._video.abandon()
        else:
            for number in self.numbers:
                temporary_name(self.path(number)).unlink(missing_ok=True)


def _check_exr_options(pattern: str | Path, layers: str, compression: str) -> None:
    if layers not in ("all", "picture"):
        raise InputError(f"layers must be all or picture, got {layers!r}")
    exr.check_compression(compression)
    if compression != "zip" and Path(pattern).suffix.lower() != ".exr":
        raise InputError(f"compression {compression} is for an .exr output, got {pattern}")


def _with_result(
    source: Source,
    result: np.ndarray,
    settings: str,
    layers: Mapping[str, np.ndarray],
    only_picture: bool,
) -> exr.Exr:
    """The source's file with the picture replaced, layers and the settings added.

    `only_picture`: without all other layers, and without what describes Cryptomattes.
    """
    more = {name: exr.to_half(plane) for name, plane in layers.items()}
    if source.file is None:
        made = exr.new(result, {SETTINGS: settings})
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
    parts[0].attributes[SETTINGS] = settings
    return exr.Exr(source.path, parts)
