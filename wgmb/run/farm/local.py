"""Worker processes on this machine, for a farm without a scheduler elsewhere.

What dask.distributed measures all the time for its dashboard, and what moves data between workers,
is of no use to a run whose frames lie in files: it is switched off. Whoever reaches a scheduler or
a worker can run code in it, and every user of a machine reaches its ports: all connections are
encrypted, with keys that are made for the run and never written to disk. On Linux the modules are
loaded once, by a process that the workers are forked from before anything else happens in it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from tempfile import TemporaryDirectory
from typing import Any

from ...errors import DeviceError

_NEVER = "1 hour"
_QUIET: dict[str, Any] = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": _NEVER,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.tick.cycle": _NEVER,
    "distributed.admin.system-monitor.interval": _NEVER,
    "distributed.scheduler.work-stealing": False,
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.diagnostics.nvml": False,
    # Logs of messages, for each worker.
    "distributed.admin.low-level-log-length": 20,
    "distributed.diagnostics.computations.max-history": 1,
    # Its way with memory, which returns every page to the system and fetches it again, is slower.
    "distributed.nanny.pre-spawn-environ": {},
    # Workers wait for each other's locks of the folder for data, which is this run's own.
    "distributed.worker.use-file-locking": False,
    # A machine that is busy with starting many workers answers late.
    "distributed.comm.timeouts.connect": "1 minute",
}
_LOADED_ONCE = ["distributed", "wgpu.backends.wgpu_native", "wgmb.run.farm.plugin"]
_CLOSING = 5.0  # seconds
_STARTING = 20.0  # seconds, after all processes have begun
_STARTS = 3


@contextmanager
def local_client(count: int) -> Iterator[Any]:
    """A client of `count` new workers of one thread each; they end with it."""
    import dask.config
    from distributed import Client, LocalCluster
    from distributed.security import Security

    method = "forkserver" if sys.platform.startswith("linux") else "spawn"
    settings = {**_QUIET, "distributed.worker.multiprocessing-method": method}
    with (
        TemporaryDirectory(prefix="wgmb-", ignore_cleanup_errors=True) as folder,
        dask.config.set(settings),
    ):
        if method == "forkserver":
            _load_once()
        for _ in range(_STARTS):
            cluster = LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",
                silence_logs=50,
                memory_limit=0,
                host="tls://127.0.0.1",
                security=Security.temporary(),
                local_directory=folder,
                env=dict(os.environ),  # that of the first process that loaded modules may be older
            )
            with closing(cluster), closing(Client(cluster, set_as_default=False)) as client:
                if _are_there(client, count):
                    yield client
                    return
        raise DeviceError(f"{count} workers should answer on this machine; {_STARTS} times, some "
                          "did not")  # fmt: skip


def _are_there(client: Any, count: int) -> bool:
    """True if all workers answer: one may lose its first connection where keys are new."""
    try:
        client.wait_for_workers(count, timeout=_STARTING)
    except TimeoutError:
        return False
    return True


def _load_once() -> None:
    """Say what the process loads that workers are forked from; too late if there is one."""
    from distributed.utils import get_mp_context

    get_mp_context().set_forkserver_preload(_LOADED_ONCE)


@contextmanager
def closing(resource: Any) -> Iterator[Any]:
    """Close a client or a cluster, whose connection may be gone."""
    try:
        yield resource
    finally:
        with suppress(Exception):
            resource.close(timeout=_CLOSING)
