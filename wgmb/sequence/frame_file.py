"""One frame as stored on disk: the layers of all its files, in one data window."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..color.spaces import ColorSpace
from ..errors import InputError, size_text
from ..io import data_files, exr, limits, record, stills
from ..io.frame_numbers import frame_range, has_view, in_view, readable
from .data_windows import Window, laid
from .layers import light, names, stereo, vectors

_SUFFIXES = (".exr", *stills.SUFFIXES, data_files.FLO)
_BEFORE_PICTURE = 1 << 16  # bytes of a PNG
_NO_PICTURE = "view {} has no picture and is left as it is"


@dataclass(frozen=True, eq=False)
class FrameFile:
    """One frame as it came from disk: one view of it, if its file names views."""

    number: int
    path: Path
    file: exr.Exr | None  # None: a still. All views of a file share it.
    channels: dict[str, np.ndarray]  # of all its files, in the picture's data window
    attributes: dict[str, Any]
    wanted: str | None = None  # the picture's layer, if its name does not say so
    part: exr.Part | None = None  # of the file, that the picture is in
    view: str | None = None  # channels have their names without it
    origin: stereo.Places = field(default_factory=dict)  # of the channels that are in `file`
    shared: frozenset[str] = frozenset()  # names of channels in no view
    further: frozenset[str] = frozenset()  # of channels of other files than the picture's
    units: dict[str, data_files.Unit] = field(default_factory=dict)  # of vectors, by their layer
    space: ColorSpace | None = None  # of the picture, where it is not for attributes to say
    made_linear: bool = False  # the picture is not as it is stored, but in `space`
    notes: tuple[str, ...] = ()  # what a user should know about it

    @property
    def name(self) -> str:
        """The file, and the view if it has one, for messages."""
        return str(self.path) if self.view is None else f"{self.path}: view {self.view}"

    @property
    def rate(self) -> Fraction | None:
        """Frames per second, as the file's attribute `framesPerSecond` states them."""
        stated = self.attributes.get("framesPerSecond")
        return stated if isinstance(stated, Fraction) and stated > 0 else None

    @cached_property
    def color(self) -> list[str]:
        """Names of the picture's channels, 3 or 4 (see layers.find_color)."""
        with about(self.name):
            own = [name for name in self.channels if name not in self.shared]
            with contextlib.suppress(InputError):
                return names.find_color([n for n in own if n not in self.further], self.wanted)
            return names.find_color(own, self.wanted)

    @property
    def reference_channel(self) -> str | None:
        """A channel whose neighbours are preferred: the picture's first, if there is one."""
        with contextlib.suppress(InputError):
            return next(name for name in self.color if name)
        return None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        height, width = next(iter(self.channels.values())).shape
        return width, height

    @property
    def data_window(self) -> Window:
        """The window that the picture fills."""
        if self.part is not None:
            return self.part.data_window
        return 0, 0, self.size[0] - 1, self.size[1] - 1

    @property
    def display_window(self) -> Window:
        """The window of the whole picture, of which the data window may be a part, or more."""
        return self.part.display_window if self.part is not None else self.data_window

    @property
    def whole(self) -> tuple[int, int]:
        """Width and height [px] of the whole picture, of which an EXR may hold a window."""
        return self.size if self.window is None else self.window[2:]

    @cached_property
    def rgba(self) -> np.ndarray:
        """The picture, (height, width, 3 or 4), as stored (float16 or float32); read-only.

        Its channels, in the file too, become views of it, so that they are in memory once.
        """
        names = [name for name in self.color if name]
        half = all(self.channels[name].dtype == np.float16 for name in names)
        rgba = np.zeros((*self.size[::-1], len(self.color)), np.float16 if half else np.float32)
        locked = rgba.view()
        locked.flags.writeable = False
        for i, name in enumerate(self.color):
            if name:
                rgba[..., i] = self.channels[name]
                self._share(name, locked[..., i])
        return locked

    def share(self, array: np.ndarray) -> None:
        """Let channels that are, bit for bit, a component of `array` be views of it.

        Nobody may write to `array`: of Blender's vectors, two components are as stored.
        """
        for name, stored in self.channels.items():
            for plane in np.moveaxis(array, 2, 0):
                if _is_same(stored, plane):
                    self._share(name, plane)
                    break

    def _share(self, name: str, plane: np.ndarray) -> None:
        """Let a channel be `plane`, which has the same values."""
        stored = self.channels[name]
        if stored.dtype == plane.dtype:
            self.channels[name] = plane
            if self.part is not None:
                part, own = self.origin.get(name, (self.part, name))
                if part.channels.get(own) is stored:
                    part.channels[own] = plane

    @property
    def pixel_aspect(self) -> Fraction:
        """Width of a pixel to its height, as an EXR says; 1 where that makes no sense."""
        stated = self.part.attributes.get("pixelAspectRatio") if self.part else None
        if not isinstance(stated, float) or not 1e-3 < stated < 1e3:
            return Fraction(1)
        return Fraction(stated).limit_denominator(1000)

    @property
    def window(self) -> Window | None:
        """Offset of the image in the full image, and the full size: x, y, width, height [px]."""
        if self.part is None:
            return None
        left, top, right, bottom = self.part.display_window
        x, y = self.part.data_window[:2]
        return x - left, y - top, right - left + 1, bottom - top + 1


def _is_same(a: np.ndarray, b: np.ndarray) -> bool:
    """Return True for two planes of the same bits."""
    if a.dtype != b.dtype or a.shape != b.shape:
        return False
    a, b = (plane.view(f"u{plane.itemsize}") for plane in (a, b))
    return np.array_equal(a[::61], b[::61]) and np.array_equal(a, b)


def is_video(pattern: str | Path) -> bool:
    """Return True for a file that is neither an EXR nor a still; an animated PNG is none."""
    path = Path(pattern)
    suffix = path.suffix.lower()
    return readable(path) and (suffix not in _SUFFIXES or (suffix == ".png" and _moves(path)))


def _moves(png: Path) -> bool:
    """Return True for a PNG that states, before its first picture, that it has several."""
    with contextlib.suppress(OSError), open(png, "rb") as file:
        return b"acTL" in file.read(_BEFORE_PICTURE).split(b"IDAT", 1)[0]
    return False


def odd_sizes(sizes: dict[int, tuple[int, int]]) -> str | None:
    """Return a message about frames of an unusual size; None if all have the same size."""
    by_size: dict[tuple[int, int], list[int]] = {}
    for number in sorted(sizes):
        by_size.setdefault(sizes[number], []).append(number)
    if len(by_size) < 2:
        return None
    usual = max(by_size, key=lambda size: len(by_size[size]))
    odd = [f"{frame_range(n)}: {size_text(s)}" for s, n in by_size.items() if s != usual]
    return f"frames of another size than most, {size_text(usual)}: {'; '.join(odd)}"


@contextlib.contextmanager
def about(name: str | Path) -> Iterator[None]:
    """Name the file in errors that do not."""
    try:
        yield
    except InputError as error:
        if str(name) in str(error):
            raise
        raise type(error)(f"{name}: {error}") from None


def read(
    paths: list[Path],
    number: int,
    wanted: str | None,
    max_mb: float = limits.MAX_MB,
    named: Sequence[str] = (),
    space: ColorSpace | None = None,
    layers: Sequence[str] = (),
    titles: Sequence[str] = ("",),
    is_blurred: bool = False,
) -> tuple[FrameFile, ...]:
    """Every view of a frame, the default one first; the channels of its files together.

    `titles`: a name for each path. Of files other than the first, layers without a name of their
    own, or with one that is taken, have that of their file; stills among them hold numbers, which
    are not decoded as light.

    `wanted`: the picture's layer. `max_mb`: megabytes that each file may unpack to. `named`: the
    views, if %V stands for them in the first path; else that file tells them. In the other paths
    %V stands for them too; of a file without %V and without views, they are the default view's.
    `space`: of the samples of a still (stills.read) that is the first path. `layers`: names of
    layers that may begin with a part's (see views.by_view). `is_blurred`: a picture alone is
    refused by its header where a search for its motion would hold too much of it.
    `InputError` names the file that is missing, damaged, too large, or of another size.
    """
    is_searched = is_blurred and len(paths) == 1
    files = _Files(max_mb, (*layers, *((wanted,) if wanted else ())), is_searched)
    first = files.content(in_view(paths[0], named[0] if named else None), space)
    full = tuple(view for view in first.named if first.views[view])
    there = tuple(named) or full or (None,)
    sources = []
    for view in there:
        contents = [
            (
                files.content(in_view(path, view), None if i else space, title if i else ""),
                has_view(path) and view is not None,
            )
            for i, (path, title) in enumerate(zip(paths, titles, strict=True))
        ]
        chosen = [(c, c.chosen(view, there[0], whole)) for c, whole in contents]
        sources.append(_together(chosen, number, wanted, view))
    empty = () if named else tuple(v for v in first.named if not first.views[v])
    return _noted(tuple(sources), empty)


@dataclass
class _Content:
    """Contents of one file: channels by view."""

    path: Path
    file: exr.Exr | None  # None: a still
    planes: dict[str, np.ndarray]  # of a still, or a flow file
    views: dict[str | None, stereo.Places]
    title: str = ""  # what its layers without a name are called; "": it is the picture's file
    unit: data_files.Unit | None = None  # of its vectors, if it says so

    @property
    def named(self) -> tuple[str, ...]:
        return tuple(view for view in self.views if view is not None)

    def chosen(self, view: str | None, default: str | None, whole: bool) -> list[str | None]:
        """Keys in `views` of the layers of a frame's `view`; `whole`: those of all the file."""
        if whole and len(self.named) > 1:
            raise InputError(
                f"{self.path}: has the views {', '.join(self.named)}; write its name without %V"
            )
        if view is None or whole:
            own = self.named[:1]
        elif self.named:
            own = (view,)
        elif view == default:
            own = ()
        else:
            return []
        return [*(v for v in own if v in self.views), None]


class _Files:
    """The files of one frame, each read once."""

    def __init__(self, max_mb: float, layers: Sequence[str], is_searched: bool):
        """`is_searched`: the motion of a picture without other layers is searched."""
        self._max_mb, self._layers, self._is_searched = max_mb, layers, is_searched
        self._read: dict[Path, _Content] = {}

    def content(self, path: Path, space: ColorSpace | None, title: str = "") -> _Content:
        """Contents of the file; `space`: of a still."""
        if path not in self._read:
            self._read[path] = self._content(path, space, title)
        return self._read[path]

    def _content(self, path: Path, space: ColorSpace | None, title: str) -> _Content:
        suffix = path.suffix.lower()
        if suffix == ".exr":
            stems = vectors.STEMS
            file = exr.read(path, max_mb=self._max_mb, data_layers=stems, held=self._held)
            unit = data_files.unit_of(record.content_of(file.parts[0].attributes.get(record.KEY)))
            return _Content(path, file, {}, stereo.by_view(file, self._layers), title, unit)
        if suffix == data_files.FLO:
            data = data_files.read(path, max_mb=self._max_mb)
            return _Content(path, None, vectors.named_as_flow(data.planes, title), {}, title)
        if suffix in stills.SUFFIXES and title and not light.is_pass(title):
            data = data_files.read(path, max_mb=self._max_mb)
            return _Content(path, None, data.planes, {}, title, data.unit)
        if suffix in stills.SUFFIXES:
            held = self._held("RGB")
            rgba = stills.read(path, max_mb=self._max_mb, space=space, held=held)
            planes = {c: rgba[..., i] for i, c in enumerate("RGBA"[: rgba.shape[2]])}
            return _Content(path, None, planes, {}, title)
        raise InputError(
            f"{path}: cannot read this kind of file; frames may be {', '.join(_SUFFIXES)}"
        )

    def _held(self, channels: Collection[str]) -> int:
        """Values of 32 bits that a run holds of a pixel of a file with these channels.

        0 where it may have motion vectors.
        """
        with contextlib.suppress(InputError):
            if self._is_searched and set(names.find_color(channels)) >= set(channels):
                return limits.AVERAGED
        return 0


def _together(
    contents: list[tuple[_Content, list[str | None]]],
    number: int,
    wanted: str | None,
    view: str | None,
) -> FrameFile:
    """One view of a frame: the layers of each of its files under the given keys."""
    main = contents[0][0]
    channels: dict[str, np.ndarray] = {}
    attributes: dict[str, Any] = {}
    origin: stereo.Places = {}
    shared: set[str] = set()
    notes: dict[str, None] = {}
    further: set[str] = set()
    units: dict[str, data_files.Unit] = {}
    onto: exr.Part | None = None
    size: tuple[int, int] | None = None
    for content, keys in contents:
        if not keys:
            continue
        more = content.planes
        if content.file is not None:
            own = {k: v for key in keys[:-1] for k, v in content.views[key].items()}
            others = content.views.get(None, {})
            onto = onto or _picture_part(content.file, own or others, wanted)
            places = own | {name: at for name, at in others.items() if name not in own}
            more = _one_window(content.file.path, places, onto)
            if content is main:
                origin, shared = (
                    places,
                    (set(others) - set(own) if view is not None and len(keys) > 1 else set()),
                )
            of_view = {id(part) for part, _ in own.values()}
            notes |= dict.fromkeys(n for part, _ in places.values() for n in part.notes)
            ranked = sorted(content.file.parts, key=lambda part: id(part) not in of_view)
            for part in reversed(ranked):
                attributes = {**part.attributes, **attributes}
        title = content.title
        while title and any(name.startswith(f"{title}.") for name in channels):
            title += "_2"
        if content is not main:
            more = _titled(more, title, channels)
            further |= more.keys()
        if content.unit is not None:
            units[title] = content.unit
        for name, plane in more.items():
            size = size or plane.shape[::-1]
            if plane.shape[::-1] != size:
                raise InputError(
                    f"{content.path}: layer {name} is {size_text(plane)}, "
                    f"{main.path.name} is {size_text(size)}"
                )
            channels[name] = plane
    return FrameFile(
        number,
        main.path,
        main.file,
        channels,
        attributes,
        wanted,
        onto if main.file else None,
        view,
        origin,
        frozenset(shared),
        frozenset(further),
        units,
        notes=tuple(notes),
    )


def _titled(
    more: dict[str, np.ndarray], title: str, taken: Collection[str]
) -> dict[str, np.ndarray]:
    """The channels of another file than the picture's: layers have names that are not `taken`."""
    found = {}
    for layer, members in names.layers(more).items():
        is_taken = any(member in taken for member in members)
        for member in members:
            is_bare = not layer and names.is_component(member)
            found[f"{title}.{member}" if is_taken or is_bare else member] = more[member]
    return found


def _noted(views: tuple[FrameFile, ...], empty: Sequence[str]) -> tuple[FrameFile, ...]:
    """The views of a frame with notes on those whose picture is not whole, if any has one."""
    if all(f.reference_channel is None for f in views):
        return views
    more = {f.view: _remarks(f) for f in views}
    more[views[0].view] += [_NO_PICTURE.format(view) for view in empty]
    return tuple(replace(f, notes=(*f.notes, *more[f.view])) if more[f.view] else f for f in views)


def _remarks(frame: FrameFile) -> list[str]:
    """Remarks on channels that a view's picture lacks."""
    if frame.reference_channel is None:
        return [_NO_PICTURE.format(frame.view)]
    lacks = ", ".join(c for c, name in zip("RGB", frame.color, strict=False) if not name)
    of = f" of view {frame.view}" if frame.view else ""
    said = [f"the picture{of} has no {lacks}, counted as 0"] if lacks else []
    if frame.pixel_aspect != 1:
        wide = f"pixels are {float(frame.pixel_aspect):g} times as wide as high"
        said.append(f"{wide}: EXR files and videos keep that, other images and GIFs do not")
    return said + _other_layers(frame)


def _other_layers(frame: FrameFile) -> list[str]:
    """A remark on view layers that are not the picture, and have colour and vectors too."""
    own = [name for name in frame.channels if name not in frame.shared]
    taken = names.layer_of(frame.color)
    others = [
        layer
        for layer in names.pictures(own)
        if layer != taken and names.view_layer(layer) != names.view_layer(taken)
        and any(
            names.stem(near) in vectors.STEMS
            for near in names.layers(own)
            if near != layer and names.view_layer(near) == names.view_layer(layer)
        )
    ]  # fmt: skip
    if not others:
        return []
    name, which = taken or "without a name", ", ".join(others)
    alike = "have vectors too, and stay as they are" if others[1:] else (
        "has vectors too, and stays as it is"
    )  # fmt: skip
    return [
        f"the layer {name} is blurred; {which} {alike}: `color={others[0]}` blurs "
        f"{'that one' if others[1:] else 'it'} in a run of its own"
    ]


def _picture_part(file: exr.Exr, places: stereo.Places, wanted: str | None) -> exr.Part:
    """The part that the picture is in; the first one where none is found."""
    with contextlib.suppress(InputError):
        return next(places[name][0] for name in names.find_color(places, wanted) if name)
    return next((part for part, _ in places.values()), file.parts[0])


def _one_window(path: Path, places: stereo.Places, onto: exr.Part) -> dict[str, np.ndarray]:
    """The channels in the data window of the part `onto`; 0 where they have none."""
    channels = {}
    for full, (part, name) in places.items():
        plane = part.channels[name]
        if part.data_window != onto.data_window:
            if part.display_window != onto.display_window:
                raise InputError(
                    f"{path}: layer {full}, {size_text(plane)}, has a different "
                    f"display window from the image, {size_text(onto.size)}"
                )
            plane = laid(plane, part.data_window, onto.data_window)
        channels[full] = plane
    return channels
