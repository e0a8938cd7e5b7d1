"""Jobs as files: JSON that any machine with the same files and the same wgmb can take frames of.

Relative names become absolute ones. The record of the frames keeps the names as they were given,
so that the frames are those of a run without a job file.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from .._version import __version__
from ..errors import InputError
from ..files import bounded
from ..io import atomic
from ..io.frame_numbers import is_pattern, readable
from ..io.suffixes import VIDEOS
from ..sequence.findings import SequenceFindings, numbers, ranges
from ..sequence.flow_motion import FAR
from ..sequence.layers.masks import is_file, with_amount
from ..settings import METHOD_OPTIONS
from ..settings.typed import restored, typed
from ..shots.cut_list import CutList
from ..shutter import CURVES
from .job import Job
from .request import BlurRequest

FORMAT = 1
_KEY = "wgmb_job"
_MOST_BYTES = 512 << 20
_AGAIN = "write the job again"


@dataclass(frozen=True)
class Stored:
    """A job as a file has it: its inputs are identified by size and time of change."""

    job: Job
    chunk: int
    """Frames that a machine is best given at a time."""
    inputs: dict[int, list[int]]
    """Size [bytes] and time of change [ns] of all files of a frame, one after the other."""

    def check(self, chosen: Iterable[int], name: str = "the job") -> None:
        """InputError if files that these frames, or the findings, depend on have changed."""
        clip, there = self.job.clip, set(self.job.findings.on_disk)
        for number in sorted(_needed(self.job, chosen)):
            if number not in there:
                if is_pattern(clip.pattern) and (new := clip.dependencies.of(number)[0]).is_file():
                    raise InputError(f"{new} did not exist when {name} was written; {_AGAIN}")
                continue
            known = self.inputs.get(number, [])
            for i, path in enumerate(clip.dependencies.of(number)):
                if _size_and_time(path) != known[2 * i : 2 * i + 2]:
                    gone = "has changed" if path.exists() else "is gone"
                    raise InputError(f"{path} {gone} since {name} was written; {_AGAIN}")

    def text(self) -> str:
        """The file's text."""
        job = self.job
        content: dict[str, Any] = {
            "wgmb": __version__,
            "request": asdict(job.request, dict_factory=_plain),
            "settings": job.settings,
            "flow": job.flow,
            "since": job.since,
            "numbers": ranges(job.numbers),
            "settled": job.findings.plain(),
            "chunk": self.chunk,
            "inputs": {str(n): known for n, known in self.inputs.items()},
        }
        lines = [f"{json.dumps(k)}: {json.dumps(v)}" for k, v in content.items()]
        lines.insert(0, f'"{_KEY}": {FORMAT}')
        lines.insert(1, f'"seal": "{_seal(content)}"')
        return "{\n" + ",\n".join(lines) + "\n}\n"


def stored(job: Job, chunk: int, *, frames: Sequence[int] | None = None) -> Stored:
    """A settled job, ready to be written; InputError where it can only be done by one process.

    `frames`: those whose files are to be known; by default all.
    """
    if Path(job.request.output.output).suffix.lower() in VIDEOS:
        raise InputError(
            f"output {job.request.output.output}: a video is written by one process; "
            "write frames, such as out.####.exr"
        )
    request = anchored(_with_config(job), Path.cwd())
    clip, there = job.clip, set(job.findings.on_disk)
    inputs = {
        n: [value for path in clip.dependencies.of(n) for value in _size_and_time(path)]
        for n in sorted(_needed(job, job.numbers if frames is None else frames) & there)
    }
    part = replace(
        job,
        request=request,
        is_part_of_run=True,
        clip_opened=None,
        remarks=(),
    )
    return Stored(part, chunk, inputs)


def _with_config(job: Job) -> BlurRequest:
    """The request, with the config of OpenColorIO that $OCIO names here."""
    color = job.request.color
    if color.ocio is None:
        color = replace(color, ocio=os.environ["OCIO"] if job.is_shown else "off")
    return replace(job.request, color=color)


def read_job(path: Path) -> Stored:
    """The job in a file; InputError in one line if it is none, damaged, or of another wgmb."""
    if not readable(path):
        raise bounded.missing(path)
    try:
        text = bounded.read(path, _MOST_BYTES, "a job").decode()
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a job written by wgmb") from None
    return of_text(text, str(path))


def of_text(text: str, name: str) -> Stored:
    """The job that `Stored.text` wrote; `name` is for messages."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or _KEY not in content:
        raise InputError(f"{name}: not a job written by wgmb, or cut off; {_AGAIN}")
    kind, seal, version = (content.pop(key, None) for key in (_KEY, "seal", "wgmb"))
    if kind != FORMAT or version != __version__:
        raise InputError(
            f"{name}: written by wgmb {version}, this is {__version__}, whose results may differ; "
            f"{_AGAIN}, or use that version"
        )
    if seal != _seal({"wgmb": version} | content):
        raise InputError(f"{name}: was changed after it had been written; {_AGAIN}")
    try:
        return _stored_of(content)
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, InputError):
        raise InputError(f"{name}: not as wgmb writes a job; {_AGAIN}") from None


def _stored_of(content: dict[str, Any]) -> Stored:
    """The job from the tables of its file; the errors of Python where they are of other types."""
    request = content["request"]
    unset = {name: default for name, (_, default, _) in METHOD_OPTIONS.items()}
    request["blur"] = unset | request["blur"]  # another package's method may be installed here only
    job = Job(
        restored(BlurRequest, request),
        dict(content["settings"]),
        numbers(content["numbers"]),
        findings_of(content["settled"]),
        typed("flow", content["flow"], str),
        typed("since", content["since"], int | None),
        is_part_of_run=True,
    )
    inputs = {
        int(n): [typed("inputs", v, int) for v in known] for n, known in content["inputs"].items()
    }
    return Stored(job, typed("chunk", content["chunk"], int), inputs)


def findings_of(plain: dict[str, Any]) -> SequenceFindings:
    """The inverse of `SequenceFindings.plain`."""
    return restored(SequenceFindings, plain | {"on_disk": numbers(plain["on_disk"])})


def is_job(path: Path) -> bool:
    """Return True if a file begins as a job does, however it goes on."""
    with open(path, "rb") as file:
        return _KEY.encode() in file.read(64)


def time_there(folder: Path) -> int:
    """The time [ns since 1970] by the clock that gives files in the folder theirs."""
    probe = atomic.temporary_name(folder / "time")
    try:
        os.close(atomic.create(probe))
        return probe.stat().st_mtime_ns
    finally:
        atomic.remove(probe)


def anchored(request: BlurRequest, folder: Path) -> BlurRequest:
    """The same with names of files that do not depend on the folder one is in."""

    def of_path(path: str) -> str:
        return str(folder / path)

    def of_mask(mask: str) -> str:
        return of_path(mask) if is_file(mask) else mask

    def of_scale(scale: str) -> str:
        mask, amount = with_amount(scale)
        return of_mask(mask) + ("" if amount is None else scale[len(mask) :])

    blur, input, shutter, color = request.blur, request.input, request.shutter, request.color
    curve, camera = shutter.curve, input.camera
    if color.ocio is not None and Path(color.ocio).is_file():
        color = replace(color, ocio=of_path(color.ocio))
    return replace(
        request,
        pattern=of_path(request.pattern),
        output=replace(request.output, output=of_path(request.output.output)),
        blur=replace(
            blur,
            holdout=tuple(map(of_mask, blur.holdout)),
            scale=tuple(map(of_scale, blur.scale)),
        ),
        shutter=shutter
        if curve is None or curve in CURVES
        else replace(shutter, curve=of_path(curve)),
        input=replace(
            input,
            also=tuple(map(of_path, input.also)),
            camera=camera and folder / camera,
            cuts=input.cuts and CutList(input.cuts).anchored(folder).text,
        ),
        color=color,
    )


def _needed(job: Job, chosen: Iterable[int]) -> set[int]:
    """Frames on which these, and what was found out about all, depend."""
    near = FAR + 1 if job.flow else 1
    there = job.findings.on_disk
    looked_at = (there[0], there[len(there) // 2], there[-1])
    reach = {n + step for n in chosen for step in range(-near, near + 1)}
    return reach | {n + step for n in looked_at for step in (-1, 0, 1)}


def _size_and_time(path: Path) -> list[int]:
    try:
        found = path.stat()
    except OSError:
        return [-1, -1]
    return [found.st_size, found.st_mtime_ns]


def _plain(fields: list[tuple[str, Any]]) -> dict[str, Any]:
    """The fields of settings as JSON has them."""
    return {name: str(v) if isinstance(v, Path) else v for name, v in fields}


def _seal(content: dict[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
