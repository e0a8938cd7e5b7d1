"""Parts of the set-up that only some tests need: `./run test` makes one when the first test asks.

Elsewhere, a test whose part is not there is skipped with the reason. WGMB_WITHOUT=core,dawn does
without some of core, dawn, chromium and blender.
"""

import os
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TIER = os.environ.get("WGMB_TIER")
"""The tier that `./run test` runs: "default" or "all"; None where pytest was called by itself."""
READY = {
    "core": ROOT / "build/core/ready",
    "dawn": ROOT / "tests/dawn/node_modules/.ready",
    "blender": ROOT / "build/blender/ready",
}
"""The file that each part has when it is complete; Chromium is a program."""


def need(*parts: str) -> None:
    """Skip the test where a part is missing; fail where `./run test` could not make it."""
    for part in parts:
        if why := why_not(part):
            (pytest.fail if is_required(part) else pytest.skip)(why)


def is_required(part: str) -> bool:
    """Return True if a missing part is a failure.

    Chromium is taken where there is one, except that CI installs it; Blender's module where it can
    be had, unless WGMB_BLENDER=required.
    """
    if part in _without() or not TIER:
        return False
    return {
        "chromium": bool(os.environ.get("CI")),
        "blender": os.environ.get("WGMB_BLENDER") == "required",
    }.get(part, True)


@cache
def why_not(part: str) -> str:
    """Make a part, where `./run test` runs the tests; the reason why it is not there, or ""."""
    if part in _without():
        return f"WGMB_WITHOUT={part}"
    failed = _make(part) if is_required(part) or (TIER and part == "blender") else ""
    if shutil.which(part) if part == "chromium" else READY[part].exists():
        return failed
    return failed or f"{part} is missing" + (part in READY) * "; `./run test` makes it"


def _without() -> list[str]:
    return os.environ.get("WGMB_WITHOUT", "").split(",")


def _make(part: str) -> str:
    """Let `run` set a part up, one process at a time; what it said if it could not."""
    import fcntl

    (ROOT / "build").mkdir(exist_ok=True)
    with open(ROOT / "build" / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        line = ["sh", ROOT / "run", "part", part]
        done = subprocess.run(line, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    return f"./run part {part}: {done.stderr.strip()[-2000:]}" if done.returncode else ""
