"""Frame sequences on disk: a pattern in, Frames out.

`Clip` reads frames, finds their layers, detects the vector convention and caches neighbours.
"""

# pyright: reportMissingParameterType=true, reportMissingTypeArgument=true

from __future__ import annotations

import contextlib
import copy
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..camera import MAX_INDEX
from ..display import ColorSpace
from ..errors import InputError, check_choice, did_you_mean
from ..frame import Frame
from ..highlights import check as check_highlights
from ..highlights import expanded
from ..motion_source import MotionSource
from ..reach import Reach
from . import detect, exr, layers, light_passes, limits, vectors, views
from .camera_file import CameraFile
from .cut_list import CutList
from .frame_file import FrameFile, about, read
from .frame_numbers import (
    MOST_FRAMES,
    frame_list,
    frame_numbers,
    frame_path,
    has_view,
    in_view,
    is_pattern,
    number_in,
    numbers_on_disk,
    readable,
    views_on_disk,
)
from .input_space import in_space
from .layers import MissingLayerError
from .masks import Masks
from .neighbours import Neighbours, extras
from .picture_motion import FAR, PictureMotion
from .settled import Settled
from .windows import Placement, Window, laid, near_enough, union

DEPTHS = ("planar", "inverse", "clip")
_OBJECT_STEMS = ("indexob", "objectindex", "object_id")


@dataclass(frozen=True)
class Passes:
    """Layers to read from the files, and their conventions.

    `color`, `depth`: names of layers that cannot be found automatically. `depth_kind`: "planar"
    (distance along the view axis), "inverse" (its reciprocal, Nuke), or "clip" (z after
    projection). `camera`: JSON file (see CameraFile) for motion where vectors are missing.
    `object_layer`: index layer that identifies the camera file's objects. `object_motion`:
    vectors exclude the camera's motion. `holdout`, `scale`: masks, each a layer, `LAYER=VALUE`,
    or an image file or pattern; VALUE is an index, or a name (with wildcards) or id of a
    Cryptomatte. Held out is what any of the masks has. The scales multiply; `MASK:AMOUNT`
    stands for 1 + (AMOUNT - 1) * mask. `also`: patterns of files with additional layers of the
    same frames. In the names of files, %V stands for the view (see Clip.views). `outside`: what
    lies beyond a data window that ends within the display window: "nothing", "edge" (unknown: the
    pixels at its edge stand for it) or "auto" (unknown if it cuts through the picture).
    """

    color: str | None = None
    vectors: vectors.Vectors = field(default_factory=vectors.Vectors)
    depth: str | None = None
    depth_kind: str = "planar"
    far: float = 1e9
    camera: Path | None = None
    object_layer: str | None = None
    object_motion: bool = False
    holdout: str | tuple[str, ...] = ()
    scale: str | tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    outside: str = "auto"

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of layers that are asked for, other than the picture's."""
        masks = (mask.partition("=")[0] for mask in (*self.holdout, *self.scale))
        named = self.vectors.layer, self.depth, self.object_layer, *masks
        return tuple(name for name in named if name)

    def __post_init__(self) -> None:
        if not isinstance(self.vectors, vectors.Vectors):
            given = f"got {self.vectors!r}"
            raise InputError(f"`vectors` must be Vectors, such as Vectors('none'), {given}")
        for name in ("holdout", "scale"):
            given = getattr(self, name)
            object.__setattr__(self, name, (given,) if isinstance(given, str) else tuple(given))
        check_choice("`depth_kind`", self.depth_kind, DEPTHS)
        if not self.far > 0:
            raise InputError(f"far must be over 0, got {self.far}")


class Clip:
    """Reader of a frame sequence or a single image.

    Iterating gives Frames. `numbers` are the requested frames, `on_disk` all existing ones.
    `finding` describes the detected vector convention, `stray_cuts` has the cuts given that no
    frame on disk has. Of the frames read so far, `cuts` has those after a camera cut, `unread` the
    neighbours that could not be read, `sizes` the sizes, `notes` lines that a user should know,
    each with its frames, and `absent` the masks by index or id (`IndexOB=4`,
    `CryptoObject=0x...`) that none of them has.

    Stereo frames have `views`. Each view has its own picture, vectors, depth and masks; cuts and
    what the vectors mean are settled on the default view.
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
        settled: Settled | None = None,
    ):
        """`frames`: "1-100x2", "1,3,5-8"; by default all existing ones, without gaps unless
        `skip_missing`. `cuts`: frames that begin a new shot, in the same form, or a file that has
        them (see CutList), beside those that are detected. `view`: the only view to blur; by
        default all. `space`: colour space of the pictures, instead of what their files say; what
        is not linear is made so. `max_mb`: largest decoded size of a file in megabytes. In
        `pattern`, %V stands for the view: one file a view. `settled`: what another Clip of the
        same sequence has found out, `settle()`, instead of looking again.
        """
        self._space, self._settled = space, settled
        self._cut_list = CutList(cuts or "")
        self._max_mb = max_mb
        self.pattern, self.passes = str(pattern), passes or Passes()
        self._named = self._views_in_names()
        self._leading = str(in_view(pattern, self._named[0] if self._named else None))
        self.numbers = self._numbers(frames, skip_missing)
        self._there = frozenset(self.on_disk)
        self.view = view
        if view is not None and view not in self.views:
            raise InputError(f"{self.pattern}: no view {view!r}; {self._those_there}")
        self._cameras = self._open_cameras()
        known = settled.cuts if settled else self._cut_list.frames(self.on_disk[0])
        self._known_cuts = frozenset(known)
        there = self._there
        self.stray_cuts = sorted(cut for cut in known if not there & {cut, cut - 1})
        self._found: detect.Finding | None = settled.finding if settled else None
        self._begin()

    def _begin(self) -> None:
        """Nothing has been read yet."""
        self.sizes: dict[int, tuple[int, int]] = {}
        self._around = Neighbours(
            self, self._known_cuts, self._cut_list.is_search, self.passes.outside
        )
        self.unread: set[int] = set()
        patterns = tuple(
            str(path) for p in (self.pattern, *self.passes.also) for path in self._of_views(p)
        )
        self._masks = Masks(
            tuple(self.passes.holdout),
            tuple(self.passes.scale),
            patterns,
            self.numbers,
            self._max_mb,
            self._of_views,
        )
        self.notes: dict[str, list[int]] = {}
        self._kept: OrderedDict[int, tuple[FrameFile, ...]] = OrderedDict()
        self._picture_motion: PictureMotion | None = None
        self._highlights = 1.0
        self._most_kept = 3
        if self._settled is not None:
            self._around.settle(self._settled.beyond)
            self._masks.take_names_as_found()
            self.notes |= {text: list(self.numbers) for text in self._settled.notes}

    def settle(self) -> Settled:
        """Find out all that depends on the whole sequence; `Clip(settled=)` takes it.

        Parts of the sequence that are blurred by themselves then give the same pictures as the
        whole, whatever lies on disk by then.
        """
        if self._settled is None:
            self.check_names()
            beyond = self._around.beyond
            notes = tuple(text for text, at in self.notes.items() if len(at) == len(self.numbers))
            self._settled = Settled(
                tuple(self.on_disk),
                self.views,
                self._decide(),
                tuple(sorted(self._known_cuts)),
                beyond,
                notes,
            )
        return self._settled

    def part(self, numbers: Sequence[int]) -> Clip:
        """A Clip of some of the frames, with the findings of this one and nothing read yet."""
        self.settle()
        made = copy.copy(self)
        made.numbers = list(numbers)
        made._begin()
        return made

    def __repr__(self) -> str:
        asked = self.passes.vectors.convention
        known = self._found.vectors if self._found else None
        name = known.convention if known else asked
        vectors = {"auto": "", "none": ", no vectors"}.get(name, f", {name} vectors")
        pattern = self.pattern if len(self.pattern) <= 200 else f"...{self.pattern[-200:]}"
        numbers = self.numbers
        frames = f"frame{'s' if len(numbers) > 1 else ''} {frame_list(numbers)}"
        return f'Clip("{pattern}", {frames}{vectors})'

    def move_by(self, motion: MotionSource) -> None:
        """Take motion from the pictures (see wgmb/flow) where the files hold none."""
        self._picture_motion = PictureMotion(self, motion)
        self._most_kept = 2 * FAR + 3
        self._around.forget_all()

    def expand_highlights(self, highlights: float) -> None:
        """Let white be so many times white in frames, for blurs alone (see wgmb/highlights.py).

        `blurred` and `blur_sequence` compress it again. InputError unless it is 1 (off) to 32. A
        frame that holds light above white cannot be read then.
        """
        check_highlights(highlights)
        self._highlights = highlights
        self._around.forget_all()

    @property
    def highlights(self) -> float:
        """Times white that white is in frames."""
        return self._highlights

    def is_there(self, number: int) -> bool:
        """Return True if frame `number` is on disk."""
        if self._settled is not None or not is_pattern(self._leading):
            return number in self._there
        return self._path(number).is_file()

    def begins_shot(self, number: int) -> bool:
        """Return True if the user said that a new shot begins with the frame."""
        return self._around.is_known_cut(number, -1)

    def _views_in_names(self) -> tuple[str, ...]:
        """The names for %V, where the views have files of their own."""
        if not has_view(self.pattern):
            return ()
        return self._settled.views if self._settled else views_on_disk(self.pattern)

    def _numbers(self, frames: str | None, skip_missing: bool) -> list[int]:
        if not is_pattern(self._leading):
            path = Path(self._leading)
            if not readable(path):
                raise InputError(f"{path}: no such file")
            if frames is not None:
                raise InputError(f"`frames` needs a pattern such as shot.####.exr, got {path.name}")
            self.on_disk = [number_in(path)]
            return self.on_disk
        settled = self._settled
        self.on_disk = there = list(settled.on_disk if settled else numbers_on_disk(self._leading))
        if not frames and skip_missing:
            return there
        if not frames and there[-1] - there[0] - len(there) >= MOST_FRAMES:
            raise InputError(
                f"{self.pattern}: only {len(there)} of the frames {there[0]} to {there[-1]} exist; "
                "`skip_missing=True` accepts gaps, `frames` selects"
            )
        wanted = frame_numbers(frames) if frames else list(range(there[0], there[-1] + 1))
        found = set(there)
        missing = sorted(set(wanted) - found)
        if missing and not skip_missing:
            raise InputError(
                f"{self.pattern}: missing frames {frame_list(missing)}; "
                "`skip_missing=True` leaves them out"
            )
        if not found & set(wanted):
            raise InputError(f"{self.pattern}: none of the frames {frames} exist")
        return [n for n in wanted if n in found]

    def __iter__(self) -> Iterator[Frame]:
        for number in self.numbers:
            yield self.frame(self.source(number))

    @cached_property
    def views(self) -> tuple[str, ...]:
        """Names of the views of the first readable frame, the default one first; none if its
        files do not name any.
        """
        if self._settled is not None:
            return self._settled.views
        if self._named:
            return self._named
        for number in self.on_disk:
            path = self._path(number)
            if path.suffix.lower() != ".exr":
                return ()
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                file = exr.read(path, header_only=True)
                return tuple(v for v, places in views.by_view(file).items() if v and places)
        return ()

    @property
    def chosen(self) -> tuple[str, ...]:
        """Names of the views to blur: all, or the one chosen."""
        return self.views if self.view is None else (self.view,)

    @property
    def _those_there(self) -> str:
        if not self.views:
            return "its frames do not name any"
        hint = did_you_mean(self.view, self.views)
        return f"there are {', '.join(self.views)}{hint}"

    def _path(self, number: int) -> Path:
        """The file of frame `number`; of its default view, if there is one for each."""
        return frame_path(self._leading, number)

    def _open_cameras(self) -> dict[str | None, CameraFile]:
        """The camera file of every view to blur."""
        path = self.passes.camera
        if path is None:
            return {}
        if has_view(path) and self.views:
            return {view: CameraFile(in_view(path, view)) for view in self.views}
        if len(self.views) > 1 and self.view is None:
            raise InputError(
                f"{path}: is the camera of one view, {self.pattern} has "
                f"{', '.join(self.views)}; %V in its name stands for the view"
            )
        return dict.fromkeys((None, *self.views), CameraFile(path))

    @property
    def has(self) -> frozenset[str]:
        """Inputs available in the first readable frame (see Frame.has).

        All frames on disk are considered, so that the result is independent of `frames`.
        """
        for number in self.on_disk:
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                return self.frame(self.source(number), picture=False, normal=False, light=False).has
        return frozenset()

    def files(self, number: int) -> list[Path]:
        """Every file that the result of frame `number` depends on."""
        passes = self.passes
        patterns = (self.pattern, *passes.also)
        paths = [frame_path(p, number) for pattern in patterns for p in self._of_views(pattern)]
        camera = self._of_views(passes.camera) if passes.camera else ()
        edit = [self._cut_list.path] if self._cut_list.path else ()
        return [*paths, *self._masks.files(number), *camera, *edit]

    def _of_views(self, pattern: str | Path) -> list[Path]:
        """The pattern, once for each view if %V in it stands for them."""
        return [in_view(pattern, v) for v in (self.views if has_view(pattern) else (None,))]

    @property
    def inputs(self) -> Iterator[Path]:
        """Iterate over all files that may be read, of all frames on disk."""
        for number in self.on_disk:
            yield from self.files(number)

    def made_of(self, number: int, neighbours: bool) -> dict[str, Any]:
        """Return the inputs of frame `number` apart from the settings, as values for JSON.

        Name, size [bytes] and time of change [ns] of every file, those of the frames before and
        after too if the method uses `neighbours`; and what the vectors were found to mean.
        """
        around = [number]
        if neighbours and is_pattern(self._leading):
            near = (number - 1, number + 1)
            around += [n for n in near if self.is_there(n)]
        paths = (p for n in around for p in (*self.files(n), *self._masks.manifests(n)))
        files = dict.fromkeys(paths)
        meaning = self._decide().vectors
        return {
            "files": [[path.name, *_size_and_time(path)] for path in files],
            "vectors_mean": str(meaning) if meaning else None,
        }

    def source(self, number: int, view: str | None = None) -> FrameFile:
        """Frame `number` as stored: `view`, or by default the one chosen, or the default one."""
        found = self._all(number)
        wanted = view or self.view or (self.views[0] if self.views else None)
        if wanted is None:
            return found[0]
        return self._find(number, wanted)

    def sources(self, number: int) -> list[FrameFile]:
        """The views of frame `number` that are to be blurred, the default one first.

        All that have a picture, or the one chosen.
        """
        if self.view is not None:
            return [self.source(number)]
        found = self._all(number)
        return [s for s in found if s.beside is not None] or [found[0]]

    def _own(self, source: FrameFile) -> dict[str, np.ndarray]:
        """The channels of a view. What is in no view belongs to the default one."""
        if source.view is None or not self.views or source.view == self.views[0]:
            return source.channels
        return {k: plane for k, plane in source.channels.items() if k not in source.shared}

    def _find(self, number: int, view: str | None) -> FrameFile:
        """A view of a frame by its name."""
        found = {source.view: source for source in self._all(number)}
        if view not in found:
            there = ", ".join(name for name in found if name) or "none"
            raise InputError(f"{self._path(number)}: no view {view!r}; its views: {there}")
        return found[view]

    def leader(self, number: int) -> FrameFile:
        """The view on which is settled what all views of a frame share: the default one."""
        found = self._all(number)
        return next((s for s in found if s.beside is not None), found[0])

    def _all(self, number: int) -> tuple[FrameFile, ...]:
        """All views of frame `number`; those of the last three are kept for their neighbours."""
        if number not in self._kept:
            while len(self._kept) >= self._most_kept:
                self._kept.popitem(last=False)
            paths = [frame_path(p, number) for p in (self.pattern, *self.passes.also)]
            passes = self.passes
            found = read(
                paths, number, passes.color, self._max_mb, self._named, self._space, passes.layers
            )
            if self._space is not None:
                found = tuple(in_space(source, self._space) for source in found)
            if self.views:  # the first frame says which is the default
                found = tuple(sorted(found, key=lambda source: source.view != self.views[0]))
            self._kept[number] = found
            self.sizes[number] = found[0].whole
            if lacking := sorted(set(self.views) - {source.view for source in found}):
                text = f"lacks the view {', '.join(lacking)}, which others have"
                self.notes.setdefault(text, []).append(number)
            for note in dict.fromkeys(note for source in found for note in source.notes):
                self.notes.setdefault(note, []).append(number)
        return self._kept[number]

    def forget(self, number: int) -> None:
        """Drop a frame from the cache."""
        self._kept.pop(number, None)
        self._around.forget(number)

    @property
    def finding(self) -> str:
        """Readable description of the detected vector convention."""
        return self._decide().text

    @property
    def is_finding_notable(self) -> bool:
        """True if the vectors do not mean what their names say, or should be checked."""
        return self._decide().notable

    def vector_mask(self, source: FrameFile) -> str | None:
        """The channel of a frame that is 1 where its vectors are valid, if there is one."""
        meaning = self._decide().vectors
        with contextlib.suppress(InputError):  # its turn to fail comes
            return vectors.mask_of(source.channels, meaning, source.beside) if meaning else None
        return None

    def _decide(self) -> detect.Finding:
        """Determine the vector convention once for all frames.

        By name, then tested on the first frame on disk; unless that shows what the name says, on
        the middle and the last one together with it. So the result does not depend on the
        requested frames.
        """
        if self._found is None:
            self._found = self._find_out()
        return self._found

    def _find_out(self) -> detect.Finding:
        wanted, there = self.passes.vectors, self.on_disk
        if wanted.convention == "none":
            return detect.Finding(None, False, "none requested")
        found = detect.Finding(None, False, "no vector layer found")
        evidence: list[detect.Evidence] = []
        for number in dict.fromkeys(there[i] for i in (0, len(there) // 2, -1)):
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                source, named = self._named_vectors(number, wanted)
                if named is None:
                    continue
                if wanted.convention != "auto":
                    return detect.Finding(named, True, str(named))
                evidence.append(self._evidence(source, named))
                found = detect.decide(named, evidence)
                if found.sure and found.vectors == named:
                    break
        return found

    def _named_vectors(
        self, number: int, wanted: vectors.Vectors
    ) -> tuple[FrameFile, vectors.Vectors | None]:
        """The vectors that the layers' names speak for, in the first view that has any."""
        first = self.leader(number)
        for source in dict.fromkeys((first, *self._all(number))):
            if named := vectors.named(self._own(source), wanted, source.beside):
                return source, named
        return first, None

    def _evidence(self, source: FrameFile, named: vectors.Vectors) -> detect.Evidence:
        if source.beside is None:
            return detect.Evidence(doubt="no picture to test it on")
        motion = vectors.read(self._own(source), named, source.beside)
        near = [self._probe(source, side) for side in (-1, 1)]
        near = [one if one and near_enough(source.data_window, one[1]) else None for one in near]
        onto = union([source.data_window, *(window for _, window in filter(None, near))])
        color, motion = (laid(a, source.data_window, onto) for a in (source.rgba, motion))
        prev, next_ = (one and laid(*one, onto) for one in near)
        return detect.gathered(color, motion, prev, next_)

    def _probe(self, source: FrameFile, side: int) -> tuple[np.ndarray, Window] | None:
        """The picture of a neighbour and its data window, to test vectors on."""
        number = source.number + side
        if not self._has_neighbour(source.number, side):
            return None
        try:
            other = self._find(number, source.view)
            same = other.display_window == source.display_window
            return (other.rgba, other.data_window) if same else None
        except (InputError, OSError):
            return None
        finally:
            if number not in self.numbers:
                self.forget(number)

    def _has_neighbour(self, number: int, side: int) -> bool:
        if not is_pattern(self._leading) or self._around.is_known_cut(number, side):
            return False
        return self.is_there(number + side)

    def neighbour(self, source: FrameFile, side: int) -> FrameFile | None:
        """The same view of the frame before (`side` -1) or after (1).

        None beyond a known cut, where there is no such file, and where it cannot be read.
        """
        number = source.number + side
        if not self._has_neighbour(source.number, side):
            return None
        try:
            return self._find(number, source.view)
        except (InputError, OSError):  # its turn to fail comes
            self.unread.add(number)
            return None

    def with_neighbours(
        self,
        source: FrameFile,
        normal: bool = True,
        reach: Reach | None = None,
        light: bool = True,
    ) -> Frame:
        """`frame`, and the same view of the frames before and after as far as they can be read.

        Frames whose files hold parts of the picture (data windows) come on one canvas, in
        Frame.window; `reach`, the Blur's, makes room there for streaks that lead out of them.
        Their arrays cannot be written to (Frame.locked): every frame is made, and uploaded by a
        Blur, once, though it is shown in three.
        """
        return self._around.between(source, extras(normal, light), reach)[0]

    def placed(
        self,
        source: FrameFile,
        reach: Reach,
        neighbours: bool,
        normal: bool = True,
        light: bool = True,
    ) -> tuple[Frame, Placement]:
        """What a Blur of this `reach` takes: with_neighbours, or `frame`; and where that lies."""
        made = self._around.between if neighbours else self._around.alone
        return made(source, extras(normal, light), reach)

    def frame(
        self,
        source: FrameFile,
        picture: bool = True,
        normal: bool = True,
        light: bool = True,
    ) -> Frame:
        """Return the Frame of `source`; without `picture`, its colour is 0; without `normal`, it
        has no normals; without `light`, no passes of light.

        Motion that leads across a camera cut is left out (see cuts.jumps).
        """
        return self._around.frame(source, picture, extras(normal, light))

    @property
    def cuts(self) -> set[int]:
        """Frames after a camera cut, of those read so far."""
        return self._around.cuts

    def _bright(self, rgba: np.ndarray) -> np.ndarray:
        return rgba if self._highlights == 1 else expanded(rgba, self._highlights)

    def light_passes(self, source: FrameFile) -> light_passes.LightPasses:
        """The passes of light of a frame's picture."""
        return light_passes.find(self._own(source), source.beside)

    def passes_of(self, source: FrameFile, picture: bool, also: frozenset[str]) -> Frame:
        """The Frame of `source` as its layers have it; see `frame`. `also`: "normal", "light"."""
        meaning = self._decide().vectors
        with about(source.name):
            if meaning is None:  # where a layer was asked for, this says why there is none
                meaning = vectors.named(self._own(source), self.passes.vectors, source.beside)
            motion = reprojections = ids = None
            depth = self._depth(source)
            if meaning is not None:
                motion = vectors.read(self._own(source), meaning, source.beside)
            camera = self._cameras.get(source.view)
            if motion is None and camera is None and self._picture_motion is not None:
                motion, guessed = self._picture_motion(source) or (None, None)
                depth = guessed if depth is None else depth
            if camera is not None:
                if depth is None:
                    there = ", ".join(layers.layers(source.channels))
                    raise InputError(f"motion from a camera needs depth; available layers: {there}")
                kind = "clip" if self.passes.depth_kind == "clip" else "planar"
                reprojections = camera.around(
                    source.number, depth_kind=kind, far=self.passes.far, window=source.window
                )
                ids = self._object_ids(source) if reprojections.here.bodies else None
            return Frame(
                self._bright(source.rgba)
                if picture
                else np.zeros((*source.size[::-1], 3), np.float16),
                motion=motion,
                depth=depth,
                normal=self._normal(source) if "normal" in also else None,
                **(self._light(source) if "light" in also else {}),
                window=source.window,
                camera=reprojections,
                object_id=ids,
                holdout=self._masks.holdout(source),
                scale=self._masks.scale(source),
                object_motion=self.passes.object_motion,
                number=source.number,
            )

    def _depth(self, source: FrameFile) -> np.ndarray | None:
        name = layers.find_depth(self._own(source), self.passes.depth, source.beside)
        if name is None:
            return None
        depth = source.channels[name].astype(np.float32, copy=False)
        if self.passes.depth_kind == "inverse":
            with np.errstate(divide="ignore"):
                depth = np.where(depth > 0, 1 / depth, np.inf).astype(np.float32)
        return depth

    def _normal(self, source: FrameFile) -> np.ndarray | None:
        names = layers.find_normal(self._own(source), source.beside)
        if not names:
            return None
        return np.stack([source.channels[name] for name in names], 2, dtype=np.float32)

    def _light(self, source: FrameFile) -> dict[str, Any]:
        """Fields of Frame; what is there in vain is noted."""
        found = self.light_passes(source)
        if found.lacking and source.number not in (on := self.notes.setdefault(found.lacking, [])):
            on.append(source.number)
        return light_passes.read(source.channels, found)

    def _object_ids(self, source: FrameFile) -> np.ndarray | None:
        by_layer = layers.layers(source.channels, near=source.beside)
        name = self.passes.object_layer
        if name is None:
            named = [k for k in by_layer if layers.stem(k) in _OBJECT_STEMS]
            if not named:
                return None
            name = named[0]
        plane = source.channels[layers.one_channel(by_layer, name, "object index layer")]
        with np.errstate(invalid="ignore"):
            index = np.rint(plane.astype(np.float64))
            return np.where(index > 0, np.minimum(index, MAX_INDEX), 0).astype(np.uint32)

    @property
    def unseen(self) -> list[str]:
        """Masks by name that manifests list, and no pixel of the frames read so far has."""
        return self._masks.unseen

    @property
    def absent(self) -> list[str]:
        """Masks by index or id that no frame read so far has."""
        return self._masks.absent

    def check_names(self) -> None:
        """InputError where a mask names an object that no frame's Cryptomatte has.

        The headers of the frames are searched once, up to the first that has the name.
        """
        self._masks.check_names()

    def check_layers(self) -> None:
        """InputError where a layer that is asked for by its name is in none of the frames.

        The first frame is looked at, and only if it lacks one the middle and the last one.
        """
        named = self.passes.color, *self.passes.layers
        if not any(named) and self.passes.vectors.convention in ("auto", "none"):
            return
        first: MissingLayerError | None = None
        for number in dict.fromkeys(self.numbers[i] for i in (0, len(self.numbers) // 2, -1)):
            try:
                for source in self.sources(number):
                    self.frame(source)
                return
            except MissingLayerError as error:
                first = first or error
            except (InputError, OSError):  # its turn to fail comes
                return
        if first is not None:
            raise first


def _size_and_time(path: Path) -> tuple[int, int]:
    """Of a file; -1 where there is none."""
    try:
        found = path.stat()
    except OSError:
        return -1, -1
    return found.st_size, found.st_mtime_ns
