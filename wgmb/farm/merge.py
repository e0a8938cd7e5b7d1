"""Reports of workers, each on some of the frames, become one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..run.report import BatchReport


def share(report: BatchReport, numbers: Iterable[int]) -> None:
    """Let a report refer to these objects where a frame has such a number.

    A report from another process has numbers of its own, four times as large as a reference.
    """
    known = {number: number for number in numbers}
    for its in (report.done, report.skipped, *report.notes.values(), *report.sizes.values()):
        its[:] = [known.get(number, number) for number in its]


def add(whole: BatchReport, part: BatchReport) -> None:
    """Add the outcome of other frames of the same sequence."""
    if part.done:  # whoever has read no frame has seen no mask
        is_first = not whole.done
        whole.unseen = _both(whole.unseen, part.unseen, is_first)
        whole.lacking = _both(whole.lacking, part.lacking, is_first)
    whole.done += part.done
    whole.skipped += part.skipped
    whole.failed |= part.failed
    whole.bad |= part.bad
    whole.cuts |= part.cuts
    for text, numbers in part.notes.items():
        whole.notes.setdefault(text, []).extend(numbers)
    for size, numbers in part.sizes.items():
        whole.sizes.setdefault(size, []).extend(numbers)


def sort(whole: BatchReport) -> None:
    """Put numbers into order, after the last `add`."""
    for numbers in (whole.done, whole.skipped, *whole.notes.values()):
        numbers.sort()


def _both(whole: Sequence[str], part: Sequence[str], is_first: bool) -> list[str]:
    return list(part) if is_first else [one for one in whole if one in part]
