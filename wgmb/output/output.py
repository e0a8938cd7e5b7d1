"""Output files: images or a video, each complete under its name or absent."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..color.spaces import Display
from ..color.srgb import ToDisplay, to_display
from ..errors import InputError, check_choice
from ..extras import needed_by
from ..io import atomic, exr, record, stills
from ..io.frame_numbers import frame_path, has_view, in_view, is_pattern
from ..io.suffixes import DEEP, STILLS, VIDEOS
from ..sequence.frame_file import FrameFile, about
from ..sequence.input_color import space_of
from ..sequence.layers import alpha, vectors
from . import finished_videos
from .names import ENDS, check_suffix, prepare, refuse_inputs, that_exist
from .result import Result

if TYPE_CHECKING:
    from ..video.write.frames import FrameVideo
from dataclasses import replace

from ..sequence.data_windows import laid, union
from ..sequence.input_color import chromaticities, relabelled
from ..sequence.layers import stereo

WINDOWS = ("grow", "keep")


class Output:
    """Output files: an image sequence, a single image, or a video.

    `pattern`: a name, with `####` for several frames. `numbers`: of the frames. `bits`: 8 or 16 per
    sample of PNG and TIFF. `fps`: rate of a video. `settings`: written into the record of every
    file (see record.py), and compared when a run is resumed. `inputs`: the files that are read; an
    output that is one of them is always refused. `overwrite` replaces any file, `resume` only
    unfinished ones of wgmb. `layers`: "all" layers of an EXR input are copied to the EXR output, or
    only those of the "picture". `compression` of EXR: a name in exr.COMPRESSIONS, or "same" as the
    input's. `views`: names of the views for which %V in the pattern stands; each has its own file
    or video. `display`: the display for PNG, JPEG, TIFF and videos; sRGB by default. `window`: the
    data window of an EXR may "grow" with the streaks, or "keep" its size; stills and videos hold
    the display window. `since`: older files [ns since 1970] count as unfinished. No file is
    readable by anybody who may not read all `inputs` and the frame's own file. InputError for a
    name or a setting that does not fit, and for existing files.
    """

    _ENDS: ClassVar[tuple[str, ...]] = ENDS
    _has_record = True  # every file holds one

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
        views: Sequence[str] = (),
        display: Display | None = None,
        window: str = "grow",
        since: int | None = None,
    ):
        check_uses(pattern, bits=bits, layers=layers, compression=compression, window=window)
        if has_view(pattern) and not views:
            raise InputError(f"output {pattern}: %V stands for a view, but the frames have none")
        self._layers, self._compression, self._display = layers, compression, display
        self._grows = window == "grow"
        self.pattern, self.bits, self.numbers = Path(pattern), bits, numbers
        self.settings = json.dumps(settings or {}, sort_keys=True)
        suffix = self.pattern.suffix.lower()
        self._views = tuple(views) if has_view(pattern) else (None,)
        self._videos: dict[str | None, FrameVideo] = {}
        self._overwrite, self._resume, self._since = overwrite, resume, since
        self._abandoned, self._is_whole, self._count, self._replaces = False, True, 0, overwrite
        self._under_way: Path | None = None
        check_suffix(pattern, self._ENDS)
        is_video = suffix in VIDEOS
        if is_video:
            with needed_by(f"output {pattern}", "video"):
                from ..video.write import frames
        elif suffix in STILLS:
            stills.require(suffix)
        if not is_video and len(numbers) > 1 and not is_pattern(pattern):
            raise InputError(
                f"output {pattern}: {len(numbers)} frames need a pattern such as out.####.exr"
            )
        inputs = list(inputs)
        is_output = self._check_names(inputs, is_video)
        self._modes = {folder: atomic.mode_of(folder, inputs) for folder in is_output}
        for path in is_output:
            atomic.sweep(path, is_output[path])
        if is_video:
            from ..video.write import frames

            for view in self._views:
                path = in_view(self.pattern, view)
                temporary = atomic.temporary_name(path)
                names = display.names if display else frames.SRGB_DISPLAY
                self._videos[view] = frames.FrameVideo(path, temporary, fps, display=names)
            self._settle({"fps": str(fps)})

    def _settle(self, more: dict[str, Any]) -> None:
        """Write `more` into the record of a video."""
        self.settings = json.dumps(json.loads(self.settings) | more, sort_keys=True)
        for video in self._videos.values():
            video.record = record.blank(json.loads(self.settings))

    def is_finished(self, frames: Iterable[tuple[int, dict[str, Any]]]) -> bool:
        """Return True if this is a video that an earlier run made of the same (finished_videos.py).

        `frames`: the numbers of all frames, and the inputs of each (see Clip.made_of), which its
        record then has. To be asked before the first frame is written. InputError where a video is
        there that is not to be replaced.
        """
        if not self._videos:
            return False
        crc = 0
        for number, made_of in frames:
            crc = zlib.crc32(json.dumps([number, made_of]).encode(), crc)
        self._settle({"frames": f"{crc:08x}"})
        expected = self._expected(None)
        paths = [video.path for video in self._videos.values()]
        done = [
            finished_videos.is_finished(
                path, expected, resume=self._resume, overwrite=self._overwrite
            )
            for path in paths
        ]
        self._replaces = self._overwrite or any(path.exists() for path in paths)
        return all(done)

    def _check_names(self, inputs: list[Path], is_video: bool) -> dict[Path, list[str]]:
        """Make the folders; return the names of the outputs in each.

        InputError where an output is an input, or exists and is not to be replaced.
        """
        names: dict[Path, list[str]] = {}
        for pattern in (in_view(self.pattern, view) for view in self._views):
            paths = [pattern] if is_video else [frame_path(pattern, n) for n in self.numbers]
            names.setdefault(pattern.parent, []).extend(path.name for path in paths)
        there: list[Path] = []
        for folder in names:
            existing = that_exist(folder, names[folder])
            refuse_inputs(folder, names[folder], existing, inputs)
            there += existing
        for folder in names:
            prepare(folder)
        if folders := [p for p in there if not p.is_file()]:
            raise InputError(f"output {folders[0]} exists and is not a file")
        if there and not (self._overwrite or self._resume):
            exists, it = "exists", "it"
            if len(there) > 1:
                exists, it = f"and {len(there) - 1} more exist", "them"
            raise InputError(
                f"{there[0]} {exists}; `overwrite=True` replaces {it}"
                + ("" if is_video else ", `resume=True` keeps finished frames")
            )
        return names

    @property
    def is_video(self) -> bool:
        """True if all frames go into one file."""
        return bool(self._videos)

    @property
    def takes_views(self) -> bool:
        """True if the output holds more than one view of a frame."""
        return self.pattern.suffix.lower() == ".exr" or has_view(self.pattern)

    def why_hopeless(self, error: BaseException) -> str:
        """The reason, if an error in writing one frame will also affect the next ones; else ""."""
        if not isinstance(error, OSError):
            return ""
        if self._videos:
            return str(error)
        what = os.strerror(error.errno) if error.errno else type(error).__name__
        return f"{self.pattern.parent}: {what}"

    def path(self, number: int, view: str | None = None) -> Path:
        """The file of frame `number`, and of its `view` if %V is in the pattern."""
        pattern = in_view(self.pattern, view)
        return pattern if self._videos else frame_path(pattern, number)

    def done(self, number: int, made_of: dict[str, Any] | None = None) -> bool:
        """Return True if frame `number` exists and is complete, with the same settings and inputs.

        `made_of`: the frame's inputs (see Clip.made_of). The whole file is read and its checksum
        compared. Raises InputError if another program wrote it. A video is never done in part.
        """
        return not self._videos and all(
            self._is_done(self.path(number, view), made_of) for view in self._views
        )

    def _is_done(self, path: Path, made_of: dict[str, Any] | None) -> bool:
        try:
            if self._since is not None and path.stat().st_mtime_ns < self._since:
                return False
            data = path.read_bytes()
        except FileNotFoundError:
            return False
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        content = record.read(data)
        if content is None and not (record.is_ours(data) or self._overwrite):
            raise InputError(
                f"{path} exists and was not written by wgmb; `overwrite=True` replaces it"
            )
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
        """Write one frame, or one view of it; see `write_views`."""
        self.write_views([Result(source, result, confidence or {})], made_of)

    def write_views(self, results: Sequence[Result], made_of: dict[str, Any] | None = None) -> None:
        """Write the views of one frame.

        An EXR also gets all other layers and views of the input file. Other files hold the first
        view; with %V in the name, each view gets a file. Confidence, from Blur.with_confidence,
        becomes channels `confidence.NAME` of an EXR. `made_of`: the frame's inputs (see
        Clip.made_of), for its record. In a resumed run, a frame that another process has finished
        meanwhile is not replaced.
        """
        if self._abandoned:
            return
        self._count += 1
        self._is_whole = self._is_whole and "unread" not in (made_of or {})
        told = {f"confidence.{name}": None for result in results for name in result.confidence}
        if told and self.pattern.suffix.lower() != ".exr":
            raise InputError(f"{self.pattern}: only an .exr can store {', '.join(told)}")
        if self._views == (None,):
            self._write(None, results, made_of)
            return
        by_name = {result.source.view: result for result in results}
        if lacking := [view for view in self._views if view not in by_name]:
            raise InputError(f"{results[0].source.path}: no picture of view {lacking[0]}")
        for view in self._views:
            self._write(view, [by_name[view]], made_of)

    def _write(
        self, view: str | None, results: Sequence[Result], made_of: dict[str, Any] | None
    ) -> None:
        """Write the file of `view`, or of all."""
        first = results[0]
        if self._videos:
            aspect, video = first.source.pixel_aspect, self._videos[view]
            video.mode = self._mode(video.path, results)
            video.add(first.displayed, self._to_display(first), aspect)
            return
        path = self.path(first.source.number, view)
        text = record.blank(self._expected(made_of))
        data = self._encoded(path, view, results, text)
        if self._resume and self._is_done(path, made_of):
            return
        if not (self._resume or self._overwrite) and path.exists():
            raise InputError(f"{path} was written by another process during this run")
        self._under_way = atomic.temporary_name(path)
        pieces = record.seal(data, text) if self._has_record else [data]
        mode = self._mode(path, results)
        atomic.write_file(path, *pieces, temporary=self._under_way, mode=mode)

    def _mode(self, path: Path, results: Sequence[Result]) -> int:
        """Permissions of a file that is made of the inputs, and of these results' files."""
        sources = [result.source.path for result in results]
        return self._modes[path.parent] & atomic.mode_of(path.parent, sources)

    def _encoded(self, path: Path, view: str | None, results: Sequence[Result], text: str) -> bytes:
        """The file at `path`, with the record's text."""
        if path.suffix.lower() == ".exr":
            only_picture = self._layers == "picture"
            content = with_results(results, view, text, only_picture, self._grows)
            return exr.encode(content, self._compression, vectors.holds_numbers)
        shown, picture = self._to_display(results[0]), results[0].displayed
        picture = picture[..., :3] if alpha.is_void(picture) else picture
        return stills.encode(picture, path.suffix, self.bits, text, shown)

    def _to_display(self, result: Result) -> ToDisplay:
        """Conversion of the picture to display values."""
        if self._display is None:
            return to_display
        with about(result.source.name):
            return self._display.of(space_of(result.source, self._display.config))

    def close(self) -> None:
        """Finish a video; OSError if that fails. Files of single frames are finished already.

        The record of one that lacks frames has no seal.
        """
        is_complete = self._is_whole and self._count == len(self.numbers)
        for one in self._videos.values():
            try:
                if not self._replaces and one.path.exists():
                    raise OSError("was written by another process during this run")
                one.close(is_complete=is_complete)
            except OSError as error:
                self.abandon()
                raise atomic.about(one.path, error) from None

    def abandon(self) -> None:
        """Remove unfinished files, after an interruption or an error."""
        self._abandoned = True
        for one in self._videos.values():
            one.abandon()
        if self._under_way is not None:
            atomic.remove(self._under_way)


_OF_EXR = {"layers": "all", "compression": "zip", "window": "grow"}  # with their defaults


def check_uses(
    pattern: str | Path, *, bits: int, layers: str, compression: str, window: str
) -> None:
    """InputError for an option that is wrong, or has no use for this kind of output."""
    check_choice("`layers`", layers, ("all", "picture"))
    check_choice("`window`", window, WINDOWS)
    exr.check_compression(compression)
    if bits not in (8, 16):
        raise InputError(f"`bits` must be 8 or 16, got {bits}")
    suffix = Path(pattern).suffix.lower()
    if bits == 16 and suffix not in DEEP:
        raise InputError(f"`bits` 16 needs a .png or .tif output, got {pattern}")
    given = {"layers": layers, "compression": compression, "window": window}
    for name, value in given.items():
        if value != _OF_EXR[name] and suffix != ".exr":
            raise InputError(f"`{name}` {value} needs an .exr output, got {pattern}")


# ---- the EXR file of a result: its source's file with the pictures replaced -------------------


_OF_TIME = "framesPerSecond", "timeCode", "keyCode"  # attributes


def with_results(
    results: Sequence[Result], view: str | None, text: str, only_picture: bool, grows: bool
) -> exr.Exr:
    """The source's file with its pictures replaced, confidence and the record's text added.

    `view`: without layers of other views. `only_picture`: without all other layers, and
    without the description of Cryptomattes. `grows`: parts with a picture have a data window that
    holds it.
    """
    source = results[0].source
    if source.file is None:
        made = exr.new(results[0].picture, chromaticities(source.space) | {record.KEY: text})
        made.parts[0].channels |= _confidence(results[0], made.parts[0])
        return made
    parts = [_twin(part, results if grows else ()) for part in source.file.parts]
    twins = dict(zip(map(id, source.file.parts), parts, strict=True))
    new: set[tuple[int, str]] = set()
    for result in results:
        home, space = result.source.part, result.source.space
        assert home is not None
        if space is not None and result.source.made_linear:
            twins[id(home)].attributes = relabelled(twins[id(home)].attributes, space)
        written = {full: i for i, full in enumerate(result.source.color) if full}
        for full, i in written.items():
            part, name = _place(result.source, full)
            kind = result.source.channels[full].dtype
            plane = laid(result.picture[..., i], result.canvas, twins[id(part)].data_window)
            plane = exr.to_half(plane) if kind == np.float16 else plane.astype(kind)
            twins[id(part)].channels[name] = plane
            new.add((id(twins[id(part)]), name))
    if any(result.is_converted for result in results):
        for part in parts:
            for name in _OF_TIME:
                part.attributes.pop(name, None)
    if only_picture:
        _keep(parts, new)
        for part in parts:
            for name in [n for n in part.attributes if n.startswith("cryptomatte/")]:
                del part.attributes[name]
    elif view is not None:
        _keep(parts, {(id(twins[id(part)]), name) for part, name in source.origin.values()} | new)
    for result in results:
        home = twins[id(result.source.part)]
        home.channels |= _confidence(result, home)
    if view is not None:
        for part in parts:
            stereo.leave_only(part, view)
    parts = [part for part in parts if part.channels]
    parts[0].attributes[record.KEY] = text
    return exr.Exr(source.path, parts)


def _place(source: FrameFile, channel: str) -> tuple[exr.Part, str]:
    """The part that a channel of the picture is in, and its name there."""
    assert source.part is not None
    return source.origin.get(channel, (source.part, channel))


def _twin(part: exr.Part, results: Sequence[Result]) -> exr.Part:
    """A copy of `part` whose window holds the pictures that are in it."""
    windows = [
        result.window
        for result in results
        if any(_place(result.source, name)[0] is part for name in result.source.color)
    ]
    onto = union([part.data_window, *windows])
    channels = {k: laid(plane, part.data_window, onto) for k, plane in part.channels.items()}
    return replace(part, channels=channels, attributes=dict(part.attributes), data_window=onto)


def _confidence(result: Result, part: exr.Part) -> dict[str, np.ndarray]:
    """Confidence as channels of `part`."""
    view = result.source.view or ""
    return {
        stereo.joined("confidence", view, name, part): exr.to_half(
            laid(plane, result.canvas, part.data_window)
        )
        for name, plane in result.confidence.items()
    }


def _keep(parts: list[exr.Part], wanted: set[tuple[int, str]]) -> None:
    """Drop all other channels; `wanted`: ids of parts, and names in them."""
    for part in parts:
        part.channels = {k: v for k, v in part.channels.items() if (id(part), k) in wanted}
