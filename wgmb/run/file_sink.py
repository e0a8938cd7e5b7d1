"""Frames as arrays, and image files as their destination."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..errors import Error, reason
from ..output.output import Output
from ..output.result import Result
from .engine import Input, RunOptions, run
from .report import BatchReport


@dataclass
class BlurredFrame:
    """One frame of `blurred`."""

    number: int
    views: list[Result] = field(default_factory=list)
    """A Result for every view, the default one first."""
    made_of: dict[str, Any] = field(default_factory=dict)
    """Files and facts on which it depends (see Clip.made_of), for Output.write_views."""
    failed: str = ""
    """The reason why it could not be read or blurred; then it has no views."""
    bad: dict[str, int] = field(default_factory=dict)
    """Pixels that are not finite, by input."""


class FileSink:
    """Frames into an Output: image files, or a video of rendered frames."""

    def __init__(self, output: Output):
        self._output, self.is_whole = output, output.is_video
        self.done, self.why_hopeless = output.done, output.why_hopeless
        self.close, self.abandon = output.close, output.abandon

    def put(self, frame: BlurredFrame) -> None:
        """Write a frame."""
        self._output.write_views(frame.views, frame.made_of)


def run_into(
    output: Output,
    input: Input[Any, BlurredFrame],
    numbers: Sequence[int],
    options: RunOptions,
    made_of: Callable[[int], dict[str, Any]] = lambda number: {},
) -> BatchReport:
    """`engine.run` into an Output; nothing where a resumed run finds its video finished.

    `made_of`: the files and facts on which each of the `numbers` depends.
    """

    def frames() -> Iterator[tuple[int, dict[str, Any]]]:
        for number in numbers:
            try:
                yield number, made_of(number)
            except (Error, OSError) as error:  # its turn to fail comes
                yield number, {"failed": reason(error)}

    try:
        is_finished = output.is_finished(frames())
    except BaseException:
        output.abandon()
        raise
    if not is_finished:
        return run(input, FileSink(output), options)
    output.abandon()
    for number in numbers:
        if options.progress is not None:
            options.progress(number, "skipped")
    return BatchReport(total=len(numbers), skipped=list(numbers))
