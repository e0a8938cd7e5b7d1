"""Count what is asked of wgpu: passes, submits, waits, and what is made."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import wgpu
from wgpu.backends.wgpu_native import _api

from wgmb.gpu import Tape

KINDS = {
    "dispatches": [
        (_api.GPUComputePassEncoder, "dispatch_workgroups"),
        (_api.GPUComputePassEncoder, "dispatch_workgroups_indirect"),
    ],
    "passes": [(_api.GPUCommandEncoder, "begin_compute_pass")],
    "submits": [(_api.GPUQueue, "submit")],
    "waits": [(_api.GPUBuffer, "map_sync"), (_api.GPUQueue, "on_submitted_work_done_sync")],
    "groups": [(wgpu.GPUDevice, "create_bind_group")],
    "buffers": [(wgpu.GPUDevice, "create_buffer"), (wgpu.GPUDevice, "create_buffer_with_data")],
    "textures": [(wgpu.GPUDevice, "create_texture")],
    "views": [(_api.GPUTexture, "create_view")],
}


@contextmanager
def counted() -> Iterator[Counter[str]]:
    """A Counter of the calls within, by the names of KINDS."""
    counts: Counter[str] = Counter()

    def count(kind: str, method: Callable[..., Any]) -> Callable[..., Any]:
        def called(self: Any, *args: Any, **options: Any) -> Any:
            counts[kind] += 1
            return method(self, *args, **options)

        return called

    with ExitStack() as patches:
        for kind, methods in KINDS.items():
            for owner, name in methods:
                owner = next(
                    c for c in (*owner.__subclasses__(), *owner.__mro__) if name in vars(c)
                )
                patches.enter_context(patch.object(owner, name, count(kind, getattr(owner, name))))

        def played(self: Tape, *args: Any) -> None:
            counts["dispatches"] += self.dispatches
            counts["passes"] += self.passes
            return play(self, *args)

        play = Tape.play
        patches.enter_context(patch.object(Tape, "play", played))
        yield counts
