"""Frame sequences on disk: a pattern in, Frames out.

`Clip` reads frames, finds their layers, settles what the vectors mean and keeps neighbours.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from fileseq.constants import PAD_STYLE_HASH1
from fileseq.exceptions import FileSeqException
from fileseq.filesequence import FileSequence
from fileseq.frameset import FrameSet

from . import exr, layers, stills, vectors
from .cameras import CameraFile
from .errors import InputError
from .frame import Frame

_PATTERN = re.compile(r"[#@]|%\d*d|\$F\d*|<UDIM>")
DEPTHS = ("planar", "inverse", "clip")


# ---- names ----------------------------------------------------------------------------------


def is_pattern(path: str | Path) -> bool:
    """Whether a path stands for many frames: `shot.####.exr`, `shot.%04d.exr`, `$F4`."""
    return bool(_PATTERN.search(Path(path).name))


def _sequence(pattern: str | Path) -> FileSequence:
    try:
        return FileSequence(str(pattern), pad_style=PAD_STYLE_HASH1)
    except FileSeqException as error:
        raise InputError(f"{pattern}: not a frame pattern: {error}") from None


def frame_path(pattern: str | Path, number: int) -> Path:
    """The file of frame `number`; a path that is no pattern stands for itself."""
    if not is_pattern(pattern):
        return Path(pattern)
    return Path(_sequence(pattern).frame(number))


def frame_numbers(text: str) -> list[int]:
    """`1-100x2`, `1,3,5-8` -> frame numbers."""
    try:
        numbers = [int(n) for n in FrameSet(text)]
    except (FileSeqException, ValueError) as error:
        raise InputError(f"frames {text!r}: {error}") from None
    if not numbers:
        raise InputError(f"frames {text!r}: none")
    return numbers


def numbers_on_disk(pattern: str | Path) -> list[int]:
    """The frames of a pattern that exist, in order."""
    try:
        found = FileSequence.findSequenceOnDisk(str(pattern), pad_style=PAD_STYLE_HASH1)
    except FileSeqException:
        raise InputError(f"{pattern}: no such frames") from None
    return sorted(int(n) for n in found.frameSet() or [])


def _number_in(path: Path) -> int:
    """The frame number at the end of a file's name; 0 if there is none."""
    m = re.search(r"(\d+)(?=\.[^.\d][^.]*$)", path.name)
    return int(m[1]) if m else 0


# ---- reading --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Passes:
    """Which layers of the files to use, and what they mean.

    `color`, `depth`: layer names where they are unusual. `depth_kind`: "planar" distance
    along the view axis, "inverse" 1 / that (Nuke), "clip" z after projection. `camera`: a
    JSON file (see CameraFile) for motion where there are no vectors. `object_layer`: the
    index layer by which the camera file's objects are told apart. `object_motion`: vectors
    leave the camera's motion out. `keep`, `scale`: a layer, `LAYER=VALUE`, or an image file
    or pattern. `also`: patterns of files that hold further layers of the same frames.
    """

    color: str | None = None
    vectors: vectors.Vectors = field(default_factory=vectors.Vectors)
    depth: str | None = None
    depth_kind: str = "planar"
    far: float = 1e9
    camera: Path | None = None
    object_layer: str | None = None
    object_motion: bool = False
    keep: str | None = None
    scale: str | None = None
    also: tuple[str, ...] = ()

    def __post_init__(self):
        if self.depth_kind not in DEPTHS:
            raise InputError(f"depth must be one of {', '.join(DEPTHS)}, got {self.depth_kind!r}")


@dataclass(frozen=True, eq=False)
class Source:
    """One frame as it came from disk."""

    number: int
    path: Path
    file: exr.Exr | None  # None: a still
    channels: dict[str, np.ndarray]
    attributes: dict
    color: list[str]  # names of the picture's channels

    @property
    def rgba(self) -> np.ndarray:
        """The picture, (height, width, 3 or 4), as stored (float16 or float32)."""
        planes = [self.channels[name] for name in self.color]
        kind = np.float16 if all(p.dtype == np.float16 for p in planes) else np.float32
        rgba = np.empty((*planes[0].shape, len(planes)), kind)
        for i, plane in enumerate(planes):
            rgba[..., i] = plane
        return rgba


class Clip:
    """A frame sequence, or one picture, being read.

    Iterating gives Frames. `finding` says what the vectors were found to mean.
    """

    def __init__(
        self,
        pattern: str | Path,
        *,
        frames: str | None = None,
        passes: Passes | None = None,
        skip_missing: bool = False,
    ):
        self.pattern, self.passes = str(pattern), passes or Passes()
        self.numbers = self._numbers(frames, skip_missing)
        self._camera = CameraFile(self.passes.camera) if self.passes.camera else None
        self._kept: OrderedDict[int, Source] = OrderedDict()
        self._vectors: vectors.Vectors | None = None
        self.finding = "none asked for"
        self._decided = self.passes.vectors.convention == "none"

    def _numbers(self, frames: str | None, skip_missing: bool) -> list[int]:
        if not is_pattern(self.pattern):
            path = Path(self.pattern)
            if not path.is_file():
                raise InputError(f"{path}: no such file")
            if frames is not None:
                raise InputError(f"--frames needs a pattern such as shot.####.exr, got {path.name}")
            return [_number_in(path)]
        there = numbers_on_disk(self.pattern)
        wanted = frame_numbers(frames) if frames else list(range(there[0], there[-1] + 1))
        missing = [n for n in wanted if n not in set(there)]
        if missing and not skip_missing:
            named = FrameSet(missing)
            raise InputError(
                f"{self.pattern}: missing frames {named}; --skip-missing leaves them out"
            )
        return [n for n in wanted if n not in set(missing)]

    def __iter__(self):
        for number in self.numbers:
            yield self.frame(self.source(number))

    def files(self, number: int) -> list[Path]:
        """Every file that frame `number` is read from."""
        return [frame_path(p, number) for p in (self.pattern, *self.passes.also)]

    def source(self, number: int) -> Source:
        """Frame `number` as stored; the last three are kept for their neighbours."""
        if number not in self._kept:
            while len(self._kept) > 2:
                self._kept.popitem(last=False)
            self._kept[number] = _read(self.files(number), number, self.passes)
        return self._kept[number]

    def forget(self, number: int) -> None:
        """Let go of a frame that nobody will ask for again."""
        self._kept.pop(number, None)

    def decide(self, source: Source) -> None:
        """Settle, once, what the vectors mean: by name, and by a neighbouring frame."""
        if self._decided:
            return
        self._decided = True
        wanted = self.passes.vectors
        self._vectors = vectors.named(source.channels, wanted)
        if self._vectors is None:
            self.finding = "no vector layer found"
            return
        self.finding = str(self._vectors)
        if wanted.convention != "auto":
            return
        near = {}
        for side, number in (("prev", source.number - 1), ("next", source.number + 1)):
            path = frame_path(self.pattern, number)
            if is_pattern(self.pattern) and path.is_file():
                near[side] = self.source(number).rgba
        found = vectors.detect(
            source.rgba,
            vectors.read(source.channels, self._vectors),
            near.get("prev"),
            near.get("next"),
            self._vectors,
        )
        self._vectors, self.finding = found.vectors, found.text
        self.forget(source.number - 1)

    def frame(self, source: Source) -> Frame:
        """What a method is given of `source`."""
        self.decide(source)
        rgba = source.rgba
        motion = None
        if self._vectors is not None:
            motion = vectors.read(source.channels, self._vectors)
        depth = reprojections = ids = None
        if self._camera is not None and source.number in self._camera.numbers():
            depth = self._depth(source)
            reprojections = self._reprojections(source)
            ids = self._object_ids(source, reprojections)
        elif self._camera is not None:
            raise InputError(f"{self._camera.path}: no camera for frame {source.number}")
        try:
            return Frame(
                rgba,
                motion=motion,
                depth=depth,
                camera=reprojections,
                object_id=ids,
                keep=self._mask(source, self.passes.keep),
                scale=self._mask(source, self.passes.scale),
                object_motion=self.passes.object_motion,
                number=source.number,
            )
        except InputError as error:
            raise InputError(f"{source.path}: {error}") from None

    def _depth(self, source: Source) -> np.ndarray:
        name = layers.find_depth(source.channels, self.passes.depth)
        if name is None:
            raise InputError(
                f"{source.path}: motion from a camera needs a depth layer; there is "
                f"{', '.join(layers.layers(source.channels))}"
            )
        depth = source.channels[name].astype(np.float32)
        if self.passes.depth_kind == "inverse":
            with np.errstate(divide="ignore"):
                depth = np.where(depth > 0, 1 / depth, np.inf).astype(np.float32)
        return depth

    def _reprojections(self, source: Source):
        window = None
        if source.file is not None:
            part = source.file.parts[0]
            x, y, right, bottom = part.display_window
            left, top = part.data_window[:2]
            window = (left - x, top - y, right - x + 1, bottom - y + 1)
        assert self._camera is not None
        kind = "clip" if self.passes.depth_kind == "clip" else "planar"
        return self._camera.around(
            source.number, depth_kind=kind, far=self.passes.far, window=window
        )

    def _object_ids(self, source: Source, reprojections) -> np.ndarray | None:
        if not reprojections.here.bodies:
            return None
        by_layer = layers.layers(source.channels)
        name = self.passes.object_layer
        if name is None:
            named = [
                k for k in by_layer if layers.stem(k) in ("indexob", "objectindex", "object_id")
            ]
            if not named:
                return None
            name = named[0]
        plane = source.channels[layers.one_channel(by_layer, name, "object index layer")]
        with np.errstate(invalid="ignore"):
            return np.where(plane > 0, np.minimum(np.rint(plane), 2**31), 0).astype(np.uint32)

    def _mask(self, source: Source, wanted: str | None) -> np.ndarray | None:
        if wanted is None:
            return None
        size = source.channels[source.color[0]].shape
        file = frame_path(wanted, source.number)
        if file.suffix.lower() in (".exr", *stills.SUFFIXES):
            image = (
                _read([file], source.number, Passes()).rgba
                if file.suffix.lower() == ".exr"
                else (stills.read(file))
            )
            plane = stills.srgb(image[..., 0]) if file.suffix.lower() != ".exr" else image[..., 0]
            if plane.shape != size:
                raise InputError(
                    f"{file}: mask must be {size[1]} x {size[0]} like "
                    f"{source.path.name}, got {plane.shape[1]} x {plane.shape[0]}"
                )
            return plane.astype(np.float32)
        try:
            return layers.mask(source.channels, source.attributes, wanted)
        except InputError as error:
            raise InputError(f"{source.path}: {error}") from None


def _read(paths: list[Path], number: int, passes: Passes) -> Source:
    """One frame's files, their channels together."""
    path = paths[0]
    file, channels, attributes = None, {}, {}
    for p in paths:
        if p.suffix.lower() == ".exr":
            read = exr.read(p)
            file = file or (read if p == path else None)
            more = read.channels()
            for part in reversed(read.parts):
                attributes = {**part.attributes, **attributes}
        elif p.suffix.lower() in stills.SUFFIXES:
            rgba = stills.read(p)
            more = {c: rgba[..., i] for i, c in enumerate("RGBA"[: rgba.shape[2]])}
        else:
            known = ", ".join((".exr", *stills.SUFFIXES))
            raise InputError(f"{p}: cannot read this kind of file; frames may be {known}")
        first = next(iter(channels.values())) if channels else None
        for name, plane in more.items():
            if first is not None and plane.shape != first.shape:
                raise InputError(
                    f"{p}: layer {name} is {plane.shape[1]} x {plane.shape[0]}, "
                    f"{path.name} is {first.shape[1]} x {first.shape[0]}"
                )
            channels.setdefault(name, plane)
    try:
        color = layers.find_color(channels, passes.color)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return Source(number, path, file, channels, attributes, color)
