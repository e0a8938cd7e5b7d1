"""The rows of `tools/soak.py`, by what they try, and what they share.

table      a row, its lines, and how they are run and written down
processes  other processes: run, limited, asked for memory; functions in a process of their own
forked     many cases in forked processes, of which a crash costs one
kinds      a sound file of every kind, and what reads it; spoiled: bytes that are wrong
shots      frames on disk, and what an unbroken run makes of them
parts      all that may draw a frame: every method and variant, scenes, the viewer

memory, viewing, damage, hostile, stopping, resuming, numbers, devices, disks, names, videos,
footage, strangers, stated: the rows
stated/stills: a sound file of each kind, and the numbers that it states; stated/copies: a changed
file as another library reads it
"""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
CRASHERS = ROOT / "tests" / "crashers"
"""Inputs that once did what none may do; tests/run/test_soak.py reads them all."""

PATHS = [str(ROOT), str(ROOT / "tools"), str(ROOT / "tests" / "made")]
"""Paths of wgmb, which lies beside this harness, of these modules, and of make_frames.py."""

sys.path[:0] = [path for path in PATHS if path not in sys.path]
