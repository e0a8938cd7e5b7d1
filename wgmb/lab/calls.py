"""Count calls of wgpu: passes, submits, waits, and objects that are made."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, ParamSpec, TypeVar

import wgpu
from wgpu.backends.wgpu_native import _api

from ..gpu import FrameBindings, Tape

_P = ParamSpec("_P")
_R = TypeVar("_R")

KINDS: dict[str, list[tuple[type, str]]] = {
    "dispatches": [
        (_api.GPUComputePassEncoder, "dispatch_workgroups"),
        (_api.GPUComputePassEncoder, "dispatch_workgroups_indirect"),
    ],
    "passes": [(_api.GPUCommandEncoder, "begin_compute_pass")],
    "encoders": [(_api.GPUDevice, "create_command_encoder")],
    "submits": [(_api.GPUQueue, "submit")],
    "waits": [(_api.GPUPromise, "sync_wait")],
    "groups": [(_api.GPUDevice, "create_bind_group")],
    "buffers": [(_api.GPUDevice, "create_buffer")],
    "textures": [(_api.GPUDevice, "create_texture")],
    "views": [(_api.GPUTexture, "create_view")],
}


@contextmanager
def counted() -> Iterator[Counter[str]]:
    """A Counter of the calls within, of all threads, by the names of KINDS.

    The passes and dispatches of a Tape are counted each time it is played.
    """
    counts: Counter[str] = Counter()

    def count(kind: str, method: Callable[_P, _R]) -> Callable[_P, _R]:
        def called(*args: _P.args, **options: _P.kwargs) -> _R:
            counts[kind] += 1
            return method(*args, **options)

        return called

    def played(
        self: Tape, encoder: wgpu.GPUCommandEncoder, bindings: FrameBindings | None = None
    ) -> None:
        counts["dispatches"] += self.dispatches
        counts["passes"] += self.passes
        play(self, encoder, bindings)

    play = Tape.play
    with ExitStack() as restored:
        for kind, methods in KINDS.items():
            for owner, name in methods:
                method = inspect.getattr_static(owner, name)
                _replace(restored, owner, name, count(kind, method))
        _replace(restored, Tape, "play", played)
        yield counts


def _replace(restored: ExitStack, owner: type, name: str, method: Callable[..., Any]) -> None:
    """Set a method of a class until `restored` ends."""
    home = next(kind for kind in owner.__mro__ if name in vars(kind))
    restored.callback(setattr, home, name, vars(home)[name])
    setattr(home, name, method)
