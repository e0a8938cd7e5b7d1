"""Frame sequences on disk: a pattern in, Frames out."""

from __future__ import annotations

import contextlib
import copy
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..color.highlights import Expansion
from ..color.spaces import ColorSpace
from ..errors import InputError
from ..extent import Extent
from ..frame import Frame
from ..io import limits
from ..io.frame_numbers import numbered, patterns_in
from ..io.suffixes import KNOWN_VIDEOS, STILLS
from ..shots.cut_list import CutList
from ..shots.held_poses import may_be_held
from ..shots.motion import MotionSource
from .data_windows import Placement
from .files import SequenceFiles
from .findings import SequenceFindings
from .flow_motion import PictureMotion, standing
from .frame_builder import OPTIONAL, FrameBuilder
from .frame_cache import FrameCache
from .frame_file import FrameFile, is_video
from .layers.light import LightPasses
from .layers.masks import Masks
from .layers.passes import Passes
from .layers.vector_convention import ConventionFinder
from .neighbours import HELD, Neighbours


class Dependencies:
    """The files of a sequence's frames, their masks, and `others`, on which all of them depend."""

    def __init__(self, files: SequenceFiles, masks: Masks, others: tuple[Path | None, ...]):
        self._files, self._masks = files, masks
        self._others = [one for path in others if path for one in files.of_views(path)]

    def of(self, number: int) -> list[Path]:
        """Every file that frame `number` depends on."""
        return [*self._files.every_path(number), *self._masks.files(number), *self._others]

    def every(self) -> Iterator[Path]:
        """All files that may be read, of all frames on disk."""
        for number in self._files.on_disk:
            yield from self.of(number)

    def states(self, number: int, reach: int) -> list[list[str | int]]:
        """Name, size [bytes] and time of change [ns] of every file that the result of frame
        `number` depends on; among them those of up to `reach` frames before and after it.
        """
        around = [number]
        for side in (-1, 1) if self._files.is_sequence else ():
            for n in range(number + side, number + side * (reach + 1), side):
                if not self._files.is_there(n):
                    break
                around.append(n)
        paths = (p for n in around for p in (*self.of(n), *self._masks.manifests(n)))
        return [[path.name, *_size_and_time(path)] for path in dict.fromkeys(paths)]


def _size_and_time(path: Path) -> tuple[int, int]:
    """Of a file; -1 where there is none."""
    try:
        found = path.stat()
    except OSError:
        return -1, -1
    return found.st_size, found.st_mtime_ns


_SHOWN = 5  # sequences of a folder that are named


def _check_kind(pattern: str | Path) -> None:
    """InputError for a video, or a folder, whose sequences are named."""
    path = Path(pattern)
    if path.is_dir():
        kinds = ".exr", *STILLS
        found = [str(path / name) for name in patterns_in(path) if name.lower().endswith(kinds)]
        holds = f"its frames are {', '.join(found[:_SHOWN])}" if found else "it holds no frames"
        raise InputError(f"{pattern}: a folder; {holds}")
    if path.suffix.lower() in KNOWN_VIDEOS and is_video(path):
        raise InputError(f"{pattern}: a video; wgmb.blur_video takes it, a Clip takes frames")


class Clip:
    """Reader of a frame sequence or a single image.

    Iteration gives Frames in the order of `numbers`, and `clip[7]` frame 7, each with its
    neighbours; `len(clip)` counts them. `numbers` are the requested frames, `on_disk` all existing
    ones; `stray_cuts` are the given cuts at frames that do not exist. `inspect` determines what
    holds for the whole sequence; `has`, `finding` and `views` report it. Of the frames read so far,
    `cuts` are those after a camera cut, `unread` the neighbours that could not be read, `sizes` the
    sizes, `notes` messages for the user, each with its frames, and `absent` the masks by index or
    id (`IndexOB=4`, `CryptoObject=0x...`) that none of them has.

    Its parts, for needs without a method of their own: `cache` (files), `builder` (layers),
    `masks`, and `dependencies` (the files that a result depends on).

    Stereo frames have `views`. Each view has its own picture, vectors, depth and masks; cuts and
    the vector convention are determined from the default view.
    """

    def __init__(
        self,
        pattern: str | Path,
        *,
        frames: str | None = None,
        passes: Passes | None = None,
        skip_missing: bool = False,
        cuts: str | None = None,
        view: str | None = None,
        space: ColorSpace | None = None,
        max_mb: float = limits.MAX_MB,
        settled: SequenceFindings | None = None,
    ):
        """`frames`: "1-100x2", "1,3,5-8"; by default all existing ones, without gaps unless
        `skip_missing`. `cuts`: frames that begin a new shot, in the same form, or a file with them
        (see CutList), in addition to the detected ones. `view`: the only view to blur; by default
        all. `space`: colour space of the pictures, instead of that in their files; pictures that
        are not linear are converted. `max_mb`: largest decoded size of a file in megabytes. In
        `pattern`, %V stands for the view, with one file for each. `settled`: the findings of
        another Clip of the same sequence (`settle()`), which are then not determined again.
        InputError for missing files, gaps and settings that do not fit.
        """
        _check_kind(pattern)
        self._space, self._findings, self.max_mb = space, settled, max_mb
        self._cut_list = CutList(cuts or "")
        self.pattern, self.passes, self.view = str(pattern), passes or Passes(), view
        self._files = SequenceFiles(self.pattern, self.passes.also, settled)
        self.on_disk = self._files.on_disk
        self.numbers = self._files.chosen(frames, skip_missing)
        self._files.check_view(view)
        self._cameras = self._files.cameras(self.passes.camera, view)
        known = settled.cuts if settled else self._cut_list.frames(self.on_disk[0])
        self._known_cuts, there = frozenset(known), frozenset(self.on_disk)
        self.stray_cuts = sorted(cut for cut in known if not there & {cut, cut - 1})
        self._begin()

    def _begin(self) -> None:
        """Nothing has been read yet."""
        self.expansion = Expansion()
        known, files, passes = self._findings, self._files, self.passes
        self.cache = cache = FrameCache(
            files,
            passes,
            numbers=self.numbers,
            known_cuts=self._known_cuts,
            view=self.view,
            space=self._space,
            max_mb=self.max_mb,
        )
        self.sizes, self.notes, self.unread = cache.sizes, cache.notes, cache.unread
        self.notes |= files.gaps(self.numbers)
        patterns = [str(pattern) for pattern in files.every_pattern]
        self.masks = Masks(
            passes.holdout, passes.scale, patterns, self.numbers, self.max_mb, files.of_views
        )
        self._finder = ConventionFinder(cache, known.finding if known else None)
        self.dependencies = Dependencies(files, self.masks, (passes.camera, self._cut_list.path))
        self.builder = FrameBuilder(cache, self._finder, self.masks, self._cameras)
        self._neighbours = Neighbours(cache, self.builder, self._cut_list.is_search)
        if known is not None:
            self._neighbours.settle(known.beyond, known.is_joined)
            self.masks.take_names_as_found()
            self.notes |= {text: list(self.numbers) for text in known.notes}

    def inspect(self) -> SequenceFindings:
        """Look at the sequence, once: views, meaning of vectors and depth, inputs, and edges.

        A run begins with this: here the first file is opened, and vectors are tested on pictures.
        All frames on disk are considered, so that the findings are independent of `frames`.
        Afterwards, no property of the Clip opens a file.
        """
        if self._findings is None:
            views, finding = self.views, self._finder.finding
            has, depth_kind = self._has(), self._finder.depth_kind
            beyond, is_joined = self._neighbours.beyond, self._neighbours.is_joined
            of_all = [text for text, at in self.notes.items() if at == self.numbers]
            if (note := self._neighbours.beyond_note) and note not in of_all:
                of_all.append(note)
            self._findings = SequenceFindings(
                tuple(self.on_disk),
                views,
                tuple(sorted(has)),
                finding,
                depth_kind,
                tuple(sorted(self._known_cuts)),
                beyond,
                is_joined,
                tuple(of_all),
            )
        return self._findings

    def _has(self) -> frozenset[str]:
        """Inputs of the first readable frame."""
        for number in self.on_disk:
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                return self._neighbours.frame(self.source(number), frozenset()).has
        return frozenset()

    def settle(self) -> SequenceFindings:
        """Keep to the findings of `inspect` from now on; they are for `Clip(settled=)` too.

        Parts of the sequence that are blurred separately then give the same pictures as the whole,
        even if the files on disk have changed.
        """
        self.masks.check()
        findings = self.inspect()
        self._files.settle(findings)
        return findings

    def part(self, numbers: Sequence[int]) -> Clip:
        """A Clip of some of the frames, with the findings of this one and nothing read yet."""
        self.settle()
        made = copy.copy(self)
        made.numbers = list(numbers)
        made._begin()
        return made

    def __repr__(self) -> str:
        known = self._finder.known or self.passes
        name = (known.vectors or self.passes.vectors).convention
        vectors = {"auto": "", "none": ", no vectors"}.get(name, f", {name} vectors")
        pattern = self.pattern if len(self.pattern) <= 200 else f"...{self.pattern[-200:]}"
        return f'Clip("{pattern}", {numbered(list(self.numbers))}{vectors})'

    def move_by(self, motion: MotionSource | None) -> None:
        """Find motion in the pictures (see wgmb/flow) if the files hold none; None: all stand."""
        around = self._neighbours.goes_around
        found = PictureMotion(self.cache, motion, around) if motion else standing
        self.builder.picture_motion = found
        self.cache.margin = 0  # a source of motion widens it
        self._neighbours.forget_all()

    def expand_highlights(self, highlights: float) -> None:
        """Brighten white by this factor in frames, for the blur alone (color/highlights.py).

        `blurred` and `blur_sequence` compress it again. InputError unless it is 1 (off) to 32.
        Frames that hold light above white can then not be read.
        """
        self.expansion = Expansion(highlights)
        self.builder.brighten = self.expansion.expanded
        self._neighbours.forget_all()

    def __len__(self) -> int:
        return len(self.numbers)

    def __contains__(self, number: object) -> bool:
        return number in self.numbers

    def __iter__(self) -> Iterator[Frame]:
        return map(self.__getitem__, self.numbers)

    def __getitem__(self, number: int) -> Frame:
        """The frame with this number, of the default view or the chosen one.

        Its arrays are read-only (Frame.locked). Its `prev` and `next` are read when they are asked
        for, as by a Blur whose method uses neighbours; none lie beyond a camera cut. InputError for
        a number that is not among `numbers`.
        """
        if number not in self.numbers:
            raise InputError(f"frame {number} is not in {self}")
        return self._neighbours.opened(self.source(number), OPTIONAL)

    @property
    def views(self) -> tuple[str, ...]:
        """Names of the views of the first readable frame, the default one first; none if its
        files do not name any.
        """
        return self._files.views

    @property
    def chosen(self) -> tuple[str, ...]:
        """Names of the views to blur: all, or the one chosen."""
        return self.views if self.view is None else (self.view,)

    @property
    def has(self) -> frozenset[str]:
        """Inputs available in the first readable frame (see Frame.has), as `inspect` finds them."""
        return frozenset(self.inspect().has)

    def made_of(self, number: int, reach: int) -> dict[str, Any]:
        """Return the inputs of frame `number` apart from the settings, as values for JSON.

        Name, size [bytes] and time of change [ns] of every file, those of up to `reach` frames
        before and after too; and the detected vector convention.
        """
        convention = self._finder.finding.vectors
        return {
            "files": self.dependencies.states(number, reach),
            "vectors_mean": str(convention) if convention else None,
        }

    def source(self, number: int, view: str | None = None) -> FrameFile:
        """Frame `number` as stored: `view`, by default the chosen view, or else the default one."""
        return self.cache.source(number, view)

    def sources(self, number: int) -> list[FrameFile]:
        """The views of frame `number` that are to be blurred, the default one first.

        These are all views with a picture, or the chosen one.
        """
        return self.cache.sources(number)

    def held_poses(self, most: int) -> list[int]:
        """Numbers of those of the first `most` frames whose poses are held (`twos`)."""
        held: list[int] = []
        for number in self.numbers[:most]:
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                held += [number] if self._holds_poses(number) else []
        return held

    def _holds_poses(self, number: int) -> bool:
        """True if poses in frame `number` are held, so that their jumps are left out: `twos`."""
        source = self.source(number)
        frame = self.frame(source, picture=False, normal=False, light=False)
        if frame.motion is None or not may_be_held(frame.motion):
            return False
        self.with_neighbours(source, normal=False, light=False)
        return number in self.notes.get(HELD, ())

    def forget(self, number: int) -> None:
        """Drop a frame from the cache."""
        self.cache.forget(number)
        self._neighbours.forget(number)

    @property
    def finding(self) -> str:
        """Readable description of the detected vector convention."""
        return self._finder.finding.text

    @property
    def is_finding_notable(self) -> bool:
        """True if the vectors do not follow the convention of their names, or should be checked."""
        return self._finder.finding.notable

    def vector_mask(self, source: FrameFile) -> str | None:
        """The channel of a frame that is 1 where its vectors are valid, if there is one."""
        return self._finder.mask_of(source)

    def with_neighbours(
        self,
        source: FrameFile,
        normal: bool = True,
        extent: Extent | None = None,
        light: bool = True,
        reach: int = 1,
    ) -> Frame:
        """`frame`, and the same view of `reach` frames before and after it, as its `prev` and
        `next`, and theirs, as far as they can be read; none beyond a camera cut.

        Frames whose files hold parts of the picture (data windows) are placed on one canvas
        (Frame.window); `extent`, that of the Blur, makes room for streaks that leave them. The
        arrays are read-only (Frame.locked): a frame is made, and uploaded by a Blur, only once,
        although three or five outputs use it.
        """
        wanted = _wanted(True, normal, light)
        return self._neighbours.between(source, wanted, extent, reach)[0]

    def placed(
        self,
        source: FrameFile,
        extent: Extent,
        reach: int,
        uses: Collection[str] = ("normal", "diffuse_light"),
    ) -> tuple[Frame, Placement]:
        """Input of a Blur of this `extent`: with_neighbours, or `frame` for a `reach` of 0; and its
        placement. `uses`: inputs that its method uses (Method.uses).
        """
        wanted = OPTIONAL & {"color", *uses}
        if not reach:
            return self._neighbours.alone(source, wanted, extent)
        return self._neighbours.between(source, wanted, extent, reach)

    def frame(
        self,
        source: FrameFile,
        picture: bool = True,
        normal: bool = True,
        light: bool = True,
    ) -> Frame:
        """Return the Frame of `source`; without `picture`, its colour is 0; without `normal`, it
        has no normals; without `light`, no passes of light.

        Motion across a camera cut is omitted (see cuts.jumps).
        """
        return self._neighbours.frame(source, _wanted(picture, normal, light))

    @property
    def cuts(self) -> set[int]:
        """Frames after a camera cut, of those read so far."""
        return self._neighbours.cuts

    def light_passes(self, source: FrameFile) -> LightPasses:
        """The passes of light of a frame's picture."""
        return self.builder.light_passes(source)

    @property
    def absent(self) -> list[str]:
        """Masks by index or id that no frame read so far has."""
        return self.masks.absent


def _wanted(picture: bool, normal: bool, light: bool) -> frozenset[str]:
    """OPTIONAL, without those that three options switch off."""
    named = ("color", picture), ("normal", normal), ("diffuse_light", light)
    return OPTIONAL - {name for name, is_wanted in named if not is_wanted}
