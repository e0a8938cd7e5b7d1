"""The frames of a sequence as stored: read once, the last few kept for their neighbours."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np

from ..color.spaces import ColorSpace
from ..errors import InputError
from .files import SequenceFiles
from .frame_file import FrameFile, read
from .input_color import in_space
from .layers.passes import Passes


class FrameCache:
    """Reads the frames of `files`, in all their views.

    `numbers`: the requested ones. `known_cuts`: frames that begin a new shot. `view`: the only one
    asked for. Of the frames read so far, `sizes` has the sizes, `notes` lines that a user should
    know, each with its frames, and `unread` the neighbours that could not be read. Kept are as many
    as a blur takes, `reach` to either side of its own, and the `margin` that each is made of.
    """

    def __init__(
        self,
        files: SequenceFiles,
        passes: Passes,
        *,
        numbers: Sequence[int],
        known_cuts: frozenset[int],
        view: str | None,
        space: ColorSpace | None,
        max_mb: float,
    ):
        self.files, self.passes = files, passes
        self.numbers, self.known_cuts = numbers, known_cuts
        self._view, self._space, self._max_mb = view, space, max_mb
        self.sizes: dict[int, tuple[int, int]] = {}
        self.notes: dict[str, list[int]] = {}
        self.unread: set[int] = set()
        self.reach = 1
        self.margin = 0
        self._kept: OrderedDict[int, tuple[FrameFile, ...]] = OrderedDict()

    @property
    def most_kept(self) -> int:
        """Frames that are kept at once."""
        return 2 * (self.reach + self.margin) + 1

    @property
    def views(self) -> tuple[str, ...]:
        """Names of the views, the default one first."""
        return self.files.views

    def all(self, number: int) -> tuple[FrameFile, ...]:
        """All views of frame `number`; those of the last `most_kept` frames are kept."""
        if number not in self._kept:
            while len(self._kept) >= self.most_kept:
                self._kept.popitem(last=False)
            passes, paths = self.passes, self.files.paths(number)
            names, titles = self.files.view_names, self.files.titles
            sources = read(
                paths,
                number,
                passes.color,
                self._max_mb,
                names,
                self._space,
                passes.layers,
                titles,
                is_blurred=True,
            )
            if self._space is not None:
                sources = tuple(in_space(source, self._space) for source in sources)
            if self.views:  # the first frame says which is the default
                sources = tuple(sorted(sources, key=lambda source: source.view != self.views[0]))
            self._kept[number] = sources
            self.sizes[number] = sources[0].whole
            if lacking := sorted(set(self.views) - {source.view for source in sources}):
                text = f"lacks the view {', '.join(lacking)}, which others have"
                self.notes.setdefault(text, []).append(number)
            for note in dict.fromkeys(note for source in sources for note in source.notes):
                self.notes.setdefault(note, []).append(number)
        return self._kept[number]

    def forget(self, number: int) -> None:
        """Drop a frame from the cache."""
        self._kept.pop(number, None)

    def find(self, number: int, view: str | None) -> FrameFile:
        """A view of a frame by its name."""
        found = {source.view: source for source in self.all(number)}
        if view not in found:
            there = ", ".join(name for name in found if name) or "none"
            path = self.files.path(number)
            raise InputError(f"{path}: no view {view!r}; its views: {there}")
        return found[view]

    def leader(self, number: int) -> FrameFile:
        """The view that decides for all views of a frame: the default one."""
        found = self.all(number)
        return next((s for s in found if s.reference_channel is not None), found[0])

    def source(self, number: int, view: str | None = None) -> FrameFile:
        """Frame `number` as stored: `view`, or by default the one chosen, or the default one."""
        found = self.all(number)
        wanted = view or self._view or (self.views[0] if self.views else None)
        if wanted is None:
            return found[0]
        return self.find(number, wanted)

    def sources(self, number: int) -> list[FrameFile]:
        """The views of frame `number` that are to be blurred, the default one first.

        All that have a picture, or the one chosen.
        """
        if self._view is not None:
            return [self.source(number)]
        found = self.all(number)
        return [s for s in found if s.reference_channel is not None] or [found[0]]

    def own(self, source: FrameFile) -> dict[str, np.ndarray]:
        """The channels of a view. Layers of no view belong to the default one."""
        if source.view is None or not self.views or source.view == self.views[0]:
            return source.channels
        return {k: plane for k, plane in source.channels.items() if k not in source.shared}

    def is_known_cut(self, number: int, side: int) -> bool:
        """True if the user said that a cut lies between a frame and its neighbour on `side`."""
        return number + (side > 0) in self.known_cuts

    def has_neighbour(self, number: int, side: int) -> bool:
        """True if a frame before (`side` -1) or after (1) it is on disk, and no known cut
        between.
        """
        if not self.files.is_sequence or self.is_known_cut(number, side):
            return False
        return self.files.is_there(number + side)

    def neighbour(self, source: FrameFile, side: int) -> FrameFile | None:
        """The same view of the frame before (`side` -1) or after (1).

        None beyond a known cut, where there is no such file, and where it cannot be read.
        """
        number = source.number + side
        if not self.has_neighbour(source.number, side):
            return None
        try:
            return self.find(number, source.view)
        except (InputError, OSError):  # its turn to fail comes
            self.unread.add(number)
            return None
