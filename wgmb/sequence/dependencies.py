"""Files on which the results of a sequence's frames depend."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from .files import SequenceFiles
from .layers.masks import Masks


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
