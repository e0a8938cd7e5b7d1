"""A run: one thread reads frames, the caller's blurs them on the GPU, a third takes the results.

    input.read  ->  input.blur  ->  sink.put

`run` puts results into a sink; with `frames`, the caller takes the sink's place. A thread
begins its next frame when the one before was taken from it, so that three frames at most are in
memory, each with all its views.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeVar

from .. import gpu
from ..errors import Error, reason
from ..threads import Behind, Stop, ahead
from .report import BatchReport, Failure, Progress

HOPELESS = 3  # frames one after the other that cannot be written for the same reason
ON_REQUEST = "on request"  # why a run stopped whose `stop` was set
_END: Any = object()  # what follows the last item


@dataclass(frozen=True)
class RunOptions:
    """The course of a run, whatever it makes: skipped frames, progress, errors and the end."""

    resume: bool = False
    """Frames that the sink has are skipped."""
    progress: Progress | None = None
    """Called with a frame's number and "done", "skipped" or "failed", in the thread where that
    happens."""
    stop: Stop | None = None
    """Once it is set, no other frame is begun; those that are blurred are put, and the report's
    `stopped` is ON_REQUEST."""
    on_error: Literal["stop", "go on"] = "stop"
    """"stop" raises the first error and abandons the sink. "go on" reports a frame that fails, and
    makes the others. Where HOPELESS frames one after the other fail to be put for the same reason
    (a full disk), or a whole sink fails, the run ends, and the report's `stopped` is the reason."""


IsDone = Callable[[int, dict[str, Any]], bool]
"""Called with a frame's number and its dependencies: True if the sink has it already."""


class Blurred(Protocol):
    """A frame that was blurred, or that failed."""

    number: int
    failed: str
    """The reason why it could not be read or blurred; "" if it could."""
    bad: dict[str, int]
    """Pixels that are not finite, by input."""


_Read = TypeVar("_Read")
_Blurred = TypeVar("_Blurred", bound=Blurred)
_BlurredIn = TypeVar("_BlurredIn", bound=Blurred, contravariant=True)
_BlurredOut = TypeVar("_BlurredOut", bound=Blurred, covariant=True)


class Input(Protocol[_Read, _BlurredOut]):
    """Frames to be made."""

    ahead: int
    """Number of them that are made ahead of each thread: 1 takes the least memory, more smooth out
    occasional slow frames; 0 reads on the thread that blurs, and `frames` blurs on
    the caller's."""

    @property
    def total(self) -> int:
        """Number of frames; 0 where nobody knows it beforehand, and the report lists none."""
        ...

    def read(self, is_done: IsDone) -> Iterator[_Read]:
        """Read for the frames that are not done; runs in the first thread."""
        ...

    def blur(self, read: Iterator[_Read]) -> Iterator[_BlurredOut]:
        """Make frames of it, as many as there turn out to be; runs in the second thread."""
        ...


class Sink(Protocol[_BlurredIn]):
    """Destination of frames."""

    is_whole: bool
    """True if it is complete or not there at all, as a video is."""

    def done(self, number: int, made_of: dict[str, Any]) -> bool:
        """Return True if a frame of an earlier run is there, made of the same."""
        ...

    def put(self, frame: _BlurredIn) -> None:
        """Take a frame; runs in the third thread."""
        ...

    def why_hopeless(self, error: BaseException) -> str:
        """The reason, if an error of `put` will also affect the next frames; else ""."""
        ...

    def close(self) -> None:
        """Complete it; OSError if it cannot be."""
        ...

    def abandon(self) -> None:
        """Leave nothing unfinished behind."""
        ...


def frames(
    input: Input[Any, _Blurred], stop: Stop | None = None
) -> Generator[_Blurred, None, None]:
    """Every frame that `input` makes, blurred in a thread of its own while the caller works.

    Errors arrive where the frames are taken. Once `stop` is set, no other frame is begun, and the
    generator ends. One that is not read to its end should be closed.
    """
    is_over = (stop or Stop()).is_set
    with (
        gpu.reported(),
        closing(_read_ahead(input, lambda number, made_of: False, is_over)) as read,
    ):
        blurred = input.blur(_until(is_over, read))
        yield from ahead(blurred, input.ahead, "blur", patience=math.inf)


def run(
    input: Input[Any, _Blurred], sink: Sink[_Blurred], options: RunOptions = RunOptions()
) -> BatchReport:
    """Put every frame that `input` makes into `sink`, and close it."""
    return _Run(input, sink, options)()


def _read_ahead(
    input: Input[_Read, Any], is_done: IsDone, is_over: Callable[[], bool]
) -> Generator[_Read, None, None]:
    """The items that `input` reads, in a thread of its own."""
    return ahead(_until(is_over, input.read(is_done)), input.ahead, "read")


def _until(is_over: Callable[[], bool], items: Iterator[_Read]) -> Iterator[_Read]:
    """The items that are there before a run is over; none of them is held here."""

    def step() -> Any:
        return _END if is_over() or (item := next(items, _END)) is _END or is_over() else item

    return iter(step, _END)


class _Run:
    """One call of `run`."""

    def __init__(self, input: Input[Any, Any], sink: Sink[Any], options: RunOptions):
        self._input, self._sink = input, sink
        self._resume, self._goes_on = options.resume, options.on_error == "go on"
        self._tell = options.progress or (lambda number, state: None)
        self._stop = options.stop or Stop()
        self._report = BatchReport(total=input.total)
        self._reasons: list[str] = []

    def __call__(self) -> BatchReport:
        report = self._report
        try:
            with (
                gpu.reported(),
                closing(_read_ahead(self._input, self._is_done, self._is_over)) as read,
                Behind(self._put, max(1, self._input.ahead), "write") as put,
            ):
                for frame in self._input.blur(_until(self._is_over, read)):
                    put(frame)
                    del frame
            if self._stop.is_set() and not report.stopped and report.rest:
                report.stopped = ON_REQUEST
            self._end()
        except BaseException:
            self._sink.abandon()
            raise
        return report

    def _is_over(self) -> bool:
        return bool(self._report.stopped) or self._stop.is_set()

    def _is_done(self, number: int, made_of: dict[str, Any]) -> bool:
        if not (self._resume and self._sink.done(number, made_of)):
            return False
        self._report.skipped.append(number)
        self._tell(number, "skipped")
        return True

    def _put(self, frame: Blurred) -> None:
        """The third stage, for one frame."""
        report, number = self._report, frame.number
        if frame.failed:
            self._fail(number, frame.failed)
            return
        if report.stopped:
            return
        if frame.bad:
            report.bad[number] = frame.bad
        try:
            self._sink.put(frame)
        except (Error, OSError, MemoryError, RuntimeError) as error:
            if not self._goes_on:
                raise
            self._fail(number, reason(error))
            self._give_up(self._sink.why_hopeless(error))
        else:
            self._reasons.clear()
            if self._input.total:  # what comes through a pipe may never end
                report.done.append(number)
            self._tell(number, "done")

    def _fail(self, number: int, why: str) -> None:
        self._report.failed[number] = why
        self._tell(number, Failure(why))

    def _give_up(self, why: str) -> None:
        """End the run where the next frames will fail for the same reason."""
        self._reasons.append(why)
        if why and (self._sink.is_whole or self._reasons[-HOPELESS:] == HOPELESS * [why]):
            self._report.stopped = why

    def _end(self) -> None:
        """Close the sink, or abandon it where it is not whole."""
        report, sink = self._report, self._sink
        try:
            if (self._goes_on and not report.done) or (sink.is_whole and report.stopped):
                sink.abandon()
            else:
                sink.close()
        except OSError as error:
            if not self._goes_on:
                raise
            report.stopped = str(error)
        if sink.is_whole and report.stopped:  # it is not there at all
            report.done.clear()
