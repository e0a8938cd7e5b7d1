"""Files with wrong bytes, or cut off: read, or refused by name, and nothing else.

Every case follows from the seed, the kind and its number, so that what is found can be found
again; what did what it must not is kept in tests/crashers, one file of a kind and an outcome.
"""

from __future__ import annotations

import re
import resource
import time
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from wgmb import InputError

from . import kinds
from .forked import forked
from .processes import apart, limits
from .table import Line, Tally, Trial, row

SLOW, LARGE = 2.0, 512  # seconds of the processor, MiB: more is a fault
_ALLOWED = 8192  # MiB of address space, so that what is large does not stop the machine
_HEADER = 1024  # bytes that no checksum covers, at most
_KEPT = 1 << 16  # bytes: longer ones are not kept
_REFUSED, _SAME, _OTHER = "refused", "the same", "another picture"
_EXTREME = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes changed, dropped, put in or copied, most of them near the beginning."""
    changed, how = bytearray(data), rng.integers(5)
    near = min(len(data), 600)
    places = rng.integers(0, np.where(rng.random(8) < 0.6, near, len(data)))
    count = int(rng.integers(1, 120))
    at, other = int(places[0]), int(places[1])
    if how == 0:
        for place in places:
            changed[place] = int(rng.integers(256))
    elif how == 1:
        changed[at : at + 4] = _EXTREME[rng.integers(5)].to_bytes(4, "little")
    elif how == 2:
        del changed[at : at + count]
    elif how == 3:
        changed[at:at] = rng.bytes(count)
    else:
        changed[at : at + count] = changed[other : other + count]
    return bytes(changed)


def cut(data: bytes, rng: np.random.Generator) -> bytes:
    """The beginning; the last bytes of a PNG and a TIFF hold nothing of the picture."""
    return data[: int(rng.integers(0, len(data) - 13))]


_TOKEN = re.compile(rb'"(?:[^"\\\n]|\\.)*"|-?\d[\w.+-]*|[A-Za-z_]\w*|[][{}(),:=]')
_STRANGE = (
    b"nan", b"inf", b"-1", b"0", b"1e400", b"-1e400", b"1e-400", b"9" * 5000,
    b"18446744073709551616", b"0.5", b"null", b"true", b"none", b"[]", b"{}", b"[" * 2000,
    b'""', b'"x"', b'"../../x"',
    b'"/dev/zero"', b'"' + b"x" * 70_000 + b'"', b'"\\u0000"', b'"\x1b[31m"', b"\r", b"\xff",
    "\u202e\u00e9".encode(),
)  # fmt: skip


def exchanged(data: bytes, rng: np.random.Generator) -> bytes:
    """One to three words or numbers of a text, anywhere, exchanged for strange or other ones.

    The form stays, so that values reach what checks them.
    """
    for _ in range(int(rng.integers(1, 4))):
        tokens = list(_TOKEN.finditer(data))
        if not tokens:
            return data
        token, other = (tokens[rng.integers(len(tokens))] for _ in range(2))
        new = other[0] if rng.random() < 0.4 else _STRANGE[rng.integers(len(_STRANGE))]
        quoted = token[0][:1] == b'"' != new[:1] and rng.random() < 0.5
        new = b'"' + new.replace(b'"', b"") + b'"' if quoted else new
        data = data[: token.start()] + new + data[token.end() :]
    return data


SPOIL = {"mutated": mutated, "cut": cut, "exchanged": exchanged}


def spoiled(how: str, kind: str, data: bytes, seed: int, number: int) -> bytes:
    """Case `number` of a kind."""
    rng = np.random.default_rng([seed, zlib.crc32(f"{how} {kind}".encode()), number])
    return SPOIL[how](data, rng)


def judge(kind: str, path: Path, sound: str = "") -> dict[str, Any]:
    """Read a file: what came of it ("why" where that is wrong), seconds, MiB that it took."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started = time.process_time()  # a hang ends by the clock, see forked.py
    what, why = _outcome(kind, path, sound)
    seconds = time.process_time() - started
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    if not why and seconds > SLOW:
        what, why = "slow", f"{seconds:.1f} s"
    if not why and grown > LARGE:
        what, why = "large", f"{grown:.0f} MiB"
    return {"what": what, "why": why, "seconds": seconds, "grown": grown}


def _outcome(kind: str, path: Path, sound: str) -> tuple[str, str]:
    try:
        holds = kinds.read(kind, path)
    except InputError as error:
        text = str(error)
        if path.name not in text:
            return "unnamed", f"does not name the file: {text}"
        return ("lines", f"more than a line: {text}") if "\n" in text else (_REFUSED, "")
    except Exception as error:
        return type(error).__name__, f"{type(error).__name__}: {error}"
    return (_SAME if holds == sound else _OTHER), ""


def batch(
    how: str, wanted: list[str], count: int, seed: int, folder: str, kept: str
) -> dict[str, Any]:
    """In a process of its own: `count` cases of every kind; what came of them, by kind."""
    place = Path(folder)
    (wrote,) = forked([place], lambda at: kinds.write_all(at), seconds=120)
    if wrote is not None:
        raise RuntimeError(f"no sound files: {wrote}")
    found = {}
    for kind in wanted:
        suffix = kinds.KINDS[kind].suffix
        data = (place / f"{kind}{suffix}").read_bytes()
        path = place / f"{how}{suffix}"
        path.write_bytes(data)
        (sound,) = forked([path], partial(kinds.read, kind))
        if not isinstance(sound, str):
            raise RuntimeError(f"the sound {path.name} cannot be read")

        def one(
            number: int, kind: str = kind, data: bytes = data, path: Path = path, sound: str = sound
        ) -> dict[str, Any]:
            bad = spoiled(how, kind, data, seed, number)
            path.write_bytes(bad)
            return judge(kind, path, sound) | {"behind": bad[:_HEADER] == data[:_HEADER]}

        outcomes = forked(range(count), one)
        found[kind] = outcomes
        for number, outcome in enumerate(outcomes):
            if outcome["why"]:
                _keep(Path(kept), kind, outcome, spoiled(how, kind, data, seed, number))
    return found


def _keep(crashers: Path, kind: str, outcome: dict[str, Any], data: bytes) -> None:
    """Put an input beside those that once did what they must not, if it is the first such."""
    what = outcome["why"] if outcome["what"] == "died" else outcome["what"]
    path = crashers / f"{kind}.{what.replace(' ', '-')}{kinds.KINDS[kind].suffix}"
    if len(data) <= _KEPT and not path.exists():
        crashers.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def _apart(work: Callable[..., Any], *given: Any, seconds: float):
    ended = apart(work, *given, seconds=seconds, prepare=limits(memory=_ALLOWED))
    if ended.value is None:
        raise RuntimeError(f"exit {ended.code}: {ended.err[-400:]}")
    return ended.value


def _tried(how: str, trial: Trial, every: list[str]) -> dict[str, list[dict[str, Any]]]:
    places = str(trial.folder), str(trial.crashers)
    seconds = 60 + trial.count * len(every) / 5
    return _apart(batch, how, every, trial.count, trial.seed, *places, seconds=seconds)


def _worst(found: dict[str, list[dict[str, Any]]]) -> str:
    timed = [(o, kind) for kind, outcomes in found.items() for o in outcomes if "seconds" in o]
    slow, kind = max(timed, key=lambda pair: pair[0]["seconds"])
    large, other = max(timed, key=lambda pair: pair[0]["grown"])
    return (
        f"slowest {slow['seconds']:.1f} s ({kind}), most memory +{large['grown']:.0f} MiB ({other})"
    )


@row(quick=40, full=2000)
def mutations(trial: Trial) -> Iterator[Line]:
    """Byte mutations of every kind of file."""
    found = _tried("mutated", trial, list(kinds.KINDS))
    tally = Tally(f"byte mutations, {len(found)} kinds of file", f"(seed {trial.seed})")
    other = Tally("pixels damaged, kinds with checksums", f"(seed {trial.seed})")
    for kind, outcomes in found.items():
        for number, outcome in enumerate(outcomes):
            tally.note(f"{kind} {number}", outcome["why"])
            if kinds.KINDS[kind].sealed and outcome.get("behind"):
                passed = outcome["what"] == _OTHER
                other.note(f"{kind} {number}", "passed on unnoticed" if passed else "")
    yield tally.line(_worst(found))
    unsealed = {
        kind: sum(o["what"] == _OTHER for o in outcomes)
        for kind, outcomes in found.items()
        if not kinds.KINDS[kind].sealed
        and kinds.KINDS[kind].suffix not in (".csv", ".edl", ".toml")
    }
    counts = ", ".join(f"{kind} {n}" for kind, n in sorted(unsealed.items(), key=lambda p: p[1]))
    yield other.line(f"without checksums, of {trial.count} each: {counts}")


@row(quick=15, full=300)
def truncations(trial: Trial) -> Iterator[Line]:
    """The same kinds of file, cut off anywhere."""
    found = _tried("cut", trial, list(kinds.KINDS))
    tally = Tally("truncations, the same kinds", f"(seed {trial.seed})")
    shorter = 0
    for kind, outcomes in found.items():
        for number, outcome in enumerate(outcomes):
            passed = outcome["what"] == _OTHER
            early = kinds.KINDS[kind].may_end_early
            shorter += passed and early
            wrong = "read as another picture" if passed and not early else ""
            tally.note(f"{kind} {number}", outcome["why"] or wrong)
    yield tally.line(f"TOML and CSV read as other, shorter files: {shorter}; {_worst(found)}")


@row(quick=40, full=2000)
def exchanges(trial: Trial) -> Iterator[Line]:
    """Words and numbers of every kind of text, exchanged for strange ones at any depth."""
    found = _tried("exchanged", trial, [n for n, kind in kinds.KINDS.items() if kind.is_text])
    tally, deep = Tally(f"words exchanged, {len(found)} kinds of text", f"(seed {trial.seed})"), []
    for kind, outcomes in found.items():
        for number, outcome in enumerate(outcomes):
            tally.note(f"{kind} {number}", outcome["why"])
        deep.append(f"{kind} {sum(o['what'] in (_SAME, _OTHER) for o in outcomes)}")
    yield tally.line(
        f"read all the same, of {trial.count} each: {', '.join(deep)}; {_worst(found)}"
    )


def replay(paths: list[str]) -> list[dict[str, Any]]:
    """In a process of its own: what comes of each of these files, in one that may crash."""
    return [forked([p], partial(judge, kinds.kind_of(p)))[0] for p in map(Path, paths)]


def replayed(crashers: Path) -> dict[str, dict[str, Any]]:
    """Results of all files of that folder, by name."""
    paths = sorted(crashers.iterdir())
    found = _apart(replay, [str(path) for path in paths], seconds=600)
    return {path.name: outcome for path, outcome in zip(paths, found, strict=True)}


@row(quick=1, full=1)
def crashers(trial: Trial) -> Iterator[Line]:
    """The inputs in tests/crashers, read once more."""
    tally = Tally("inputs that once did what none may", "files")
    for name, outcome in replayed(trial.crashers).items():
        tally.note(name, outcome["why"])
    yield tally.line()
