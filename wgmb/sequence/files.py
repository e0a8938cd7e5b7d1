"""Frames of a sequence on disk, their files, and the views in them."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from pathlib import Path

from ..errors import InputError, did_you_mean
from ..files import bounded
from ..io import exr
from ..io.frame_numbers import (
    MOST_FRAMES,
    frame_numbers,
    frame_path,
    has_view,
    in_view,
    is_pattern,
    number_in,
    numbered,
    numbers_on_disk,
    readable,
    titles,
    views_on_disk,
)
from .findings import SequenceFindings
from .layers import stereo
from .layers.camera_file import CameraFile


class SequenceFiles:
    """The files of a sequence or a single image, `also` those of additional layers.

    `on_disk` has the numbers of all frames that there are; `view_names` the names that %V in the
    pattern stands for. `settled`: what was found out before, instead of looking again.
    """

    def __init__(self, pattern: str, also: tuple[str, ...], settled: SequenceFindings | None):
        self.pattern, self._also, self._settled = pattern, also, settled
        self.view_names = self._view_names()
        self._leading = str(in_view(pattern, self.view_names[0] if self.view_names else None))
        self.on_disk = self._on_disk()
        self._existing = frozenset(self.on_disk)

    def settle(self, settled: SequenceFindings) -> None:
        """Keep to what was found, whatever lies on disk from now on."""
        self._settled = settled

    @property
    def is_sequence(self) -> bool:
        """True if there may be several frames."""
        return is_pattern(self._leading)

    def path(self, number: int) -> Path:
        """The file of frame `number`; of its default view, if there is one for each."""
        return frame_path(self._leading, number)

    def paths(self, number: int) -> list[Path]:
        """The files that frame `number` is read from; %V stands for its views."""
        return [frame_path(pattern, number) for pattern in (self.pattern, *self._also)]

    @cached_property
    def titles(self) -> list[str]:
        """Names of the files of a frame (see frame_numbers.titles)."""
        return titles([self.pattern, *self._also])

    def every_path(self, number: int) -> list[Path]:
        """The same, once for each view."""
        return [frame_path(p, number) for p in self.every_pattern]

    @property
    def every_pattern(self) -> list[Path]:
        """The patterns of all files, once for each view."""
        return [path for p in (self.pattern, *self._also) for path in self.of_views(p)]

    def of_views(self, pattern: str | Path) -> list[Path]:
        """A pattern, once for each view if %V in it stands for them."""
        return [in_view(pattern, v) for v in (self.views if has_view(pattern) else (None,))]

    def is_there(self, number: int) -> bool:
        """Return True if frame `number` is on disk."""
        if self._settled is not None or not self.is_sequence:
            return number in self._existing
        return self.path(number).is_file()

    @cached_property
    def views(self) -> tuple[str, ...]:
        """Names of the views of the first readable frame, the default one first; none if its
        files do not name any.
        """
        if self._settled is not None:
            return self._settled.views
        if self.view_names:
            return self.view_names
        for number in self.on_disk:
            path = self.path(number)
            if path.suffix.lower() != ".exr":
                return ()
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                file = exr.read(path, header_only=True)
                return tuple(v for v, places in stereo.by_view(file).items() if v and places)
        return ()

    def check_view(self, view: str | None) -> None:
        """InputError where there is no view of this name; None is no view."""
        if view is None or view in self.views:
            return
        there = f"there are {', '.join(self.views)}{did_you_mean(view, self.views)}"
        if not self.views:
            there = "its frames do not name any"
        raise InputError(f"{self.pattern}: no view {view!r}; {there}")

    def cameras(self, path: Path | None, view: str | None) -> dict[str | None, CameraFile]:
        """The camera file of every view to blur, all or `view`; %V in `path` stands for it."""
        if path is None:
            return {}
        if has_view(path) and self.views:
            return {name: CameraFile(in_view(path, name)) for name in self.views}
        if len(self.views) > 1 and view is None:
            raise InputError(
                f"{path}: is the camera of one view, {self.pattern} has "
                f"{', '.join(self.views)}; %V in its name stands for the view"
            )
        return dict.fromkeys((None, *self.views), CameraFile(path))

    def _view_names(self) -> tuple[str, ...]:
        """The names for %V, where the views have files of their own."""
        if not has_view(self.pattern):
            return ()
        return self._settled.views if self._settled else views_on_disk(self.pattern)

    def _on_disk(self) -> list[int]:
        if not self.is_sequence:
            path = Path(self._leading)
            if not readable(path):
                raise bounded.missing(path)
            return [number_in(path)]
        return list(self._settled.on_disk if self._settled else numbers_on_disk(self._leading))

    def gaps(self, numbers: Sequence[int]) -> dict[str, list[int]]:
        """Notes on those of `numbers` that lack a neighbour within the sequence."""
        if not self.is_sequence:
            return {}
        first, last = self.on_disk[0], self.on_disk[-1]
        apart = {b - a for a, b in pairwise(self.on_disk)}
        if len(apart) == 1 and (step := apart.pop()) > 1:
            text = (
                f"frames are {step} apart, but the shutter and the vectors count intervals of one "
                f"frame: {180 * step} degrees expose half of the time between two of these frames"
            )
            return {text: list(numbers)}
        around = {n: [m for m in (n - 1, n + 1) if first <= m <= last] for n in numbers}
        lacking = [n for n in numbers if not self._existing.issuperset(around[n])]
        return {"a neighbouring frame is missing": lacking} if lacking else {}

    def chosen(self, frames: str | None, skip_missing: bool) -> list[int]:
        """The numbers that `frames` asks for (see Clip); InputError where some are missing."""
        there = self.on_disk
        if not self.is_sequence:
            if frames is not None:
                name = Path(self._leading).name
                raise InputError(f"`frames` needs a pattern such as shot.####.exr, got {name}")
            return there
        if not frames and skip_missing:
            return there
        if not frames and there[-1] - there[0] - len(there) >= MOST_FRAMES:
            raise InputError(
                f"{self.pattern}: only {len(there)} of the frames {there[0]} to {there[-1]} exist; "
                "`skip_missing=True` accepts gaps, `frames` selects"
            )
        wanted = frame_numbers(frames) if frames else list(range(there[0], there[-1] + 1))
        missing = sorted(set(wanted) - self._existing)
        if missing and not skip_missing:
            raise InputError(
                f"{self.pattern}: missing {numbered(missing)}; `skip_missing=True` leaves them out"
            )
        if not self._existing & set(wanted):
            raise InputError(f"{self.pattern}: none of the frames {frames} exist")
        return [n for n in wanted if n in self._existing]
