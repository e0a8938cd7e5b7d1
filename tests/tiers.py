"""Three tiers of tests, and the processor time of each file.

`./run test fast` runs the cases marked fast, `./run test` all but those marked full, and `./run
test all` every case. A run ends with its dearest files. With WGMB_BUDGET, it fails where the cases
of the default tier in one file take more than MOST seconds, so that this tier stays short; the
workflow sets it for a second run, as the first one compiles every kernel.
"""

import json
import os
import resource
from collections import Counter, defaultdict
from itertools import combinations

import pytest

MOST = 20  # seconds of processor time, for a file in the default tier
SHOWN = 15  # files at the end of a run
spent: Counter[str] = Counter()
"""Seconds of processor time by file, all cases."""
default_spent: Counter[str] = Counter()
"""The same for the cases of the default tier."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """The cases of a test marked covers(n) that add nothing to the others are full."""
    products = defaultdict(list)
    for item in items:
        if item.get_closest_marker("covers") and not item.get_closest_marker("full"):
            products[item.nodeid.partition("[")[0]].append(item)
    for cases in products.values():
        (n,) = cases[0].get_closest_marker("covers").args
        values = [{name: id(value) for name, value in c.callspec.params.items()} for c in cases]
        chosen = covering(values, n)
        for i, case in enumerate(cases):
            if i not in chosen:
                case.add_marker("full")


def covering(cases: list[dict[str, int]], n: int) -> set[int]:
    """Indices of a few of the cases that meet every combination of n values of all cases.

    A case is the value of each parameter, as a number. Greedy: the next one is that which meets
    most combinations not met yet. With n = 0, it is the first case.
    """
    met = [set(combinations(sorted(case.items()), min(n, len(case)))) for case in cases]
    open_ = set().union(*met)
    chosen: set[int] = set()
    while open_:
        best = max(range(len(cases)), key=lambda i: len(met[i] & open_))
        chosen.add(best)
        open_ -= met[best]
    return chosen


def _processor_time() -> float:
    """Seconds, of this process and the children that have ended."""
    uses = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(use.ru_utime + use.ru_stime for use in uses)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """Add up the time of each case."""
    before = _processor_time()
    try:
        return (yield)
    finally:
        took = _processor_time() - before
        spent[item.location[0]] += took
        if not item.get_closest_marker("full"):
            default_spent[item.location[0]] += took


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """A worker of xdist has ended: take over its times."""
    for total, more in zip((spent, default_spent), _told(node), strict=True):
        total.update(more)


def _told(node) -> list[dict]:
    return json.loads(getattr(node, "workeroutput", {}).get("spent", "[{}, {}]"))


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    """Hand the times to the first process, which judges them if WGMB_BUDGET asks it to."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["spent"] = json.dumps([spent, default_spent])
    elif os.environ.get("WGMB_BUDGET") and too_long():
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def too_long() -> list[str]:
    """A line for each file whose cases of the default tier take too long."""
    return [
        f"{file}: {seconds:.0f} s of processor time in the default tier, at most {MOST}: "
        "smaller pictures, one run for several tests, or pytest.mark.full"
        for file, seconds in default_spent.most_common()
        if seconds > MOST
    ]


def pytest_terminal_summary(terminalreporter):
    """The dearest files of the run."""
    if spent.total() < MOST:
        return
    terminalreporter.section(f"processor time: {spent.total():.0f} s")
    for file, seconds in spent.most_common(SHOWN):
        terminalreporter.write_line(f"{seconds:6.1f} s  {file}")
    for line in too_long():
        terminalreporter.write_line(line)
