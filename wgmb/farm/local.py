"""Worker processes on this machine, for a farm without a scheduler elsewhere.

A run whose frames lie in files needs neither the measurements that dask.distributed takes for its
dashboard nor its transfers between workers: both are switched off. Whoever reaches a scheduler or
a worker can run code in it, and every user of a machine reaches its ports: all connections are
encrypted, with keys that are made for the run and never written to disk. On Linux the modules are
loaded once, by a process that the workers are forked from before anything else happens in it.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.util import get_temp_dir
from shutil import rmtree
from tempfile import TemporaryDirectory
from typing import Any

from .. import interpreter
from ..errors import DeviceError
from ..io import leftovers

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
    # Pages for browsers.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
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
_LOADED_ONCE = ["wgpu.backends.wgpu_native", "wgmb.farm.preloaded"]
_CLOSING = 5.0  # seconds
_KILLING = 0.4  # seconds until a killed process is gone
_TRIES = 3  # of removing a folder
_STARTING = 20.0  # seconds, after all processes have begun
_LOOKING = 0.3  # seconds between two looks at whether one is lost
_MOST_LOST = 3  # for each worker, until the run is given up


@contextmanager
def local_client(count: int) -> Iterator[Any]:
    """A client of `count` new workers of one thread each; they end with it."""
    import dask.config
    from distributed import Client

    from .encryption import Encryption
    from .processes import cluster_of

    method = "forkserver" if sys.platform.startswith("linux") else "spawn"
    settings = {**_QUIET, "distributed.worker.multiprocessing-method": method}
    with (
        TemporaryDirectory(prefix="wgmb-", ignore_cleanup_errors=True) as folder,
        leftovers.removed_by(lambda: _remove(folder)),
        dask.config.set({**settings, "temporary-directory": folder}),
        _environment(),
    ):
        leftovers.forget(_end_processes)  # it is the newest one from now on
        leftovers.add(_end_processes, _end_processes)
        leftovers.add_last(get_temp_dir(), lambda: _remove(get_temp_dir()))
        if method == "forkserver":
            _start_helpers()
        cluster = cluster_of(
            Encryption.temporary(),
            dict(os.environ),  # that of the first process that loaded modules may be older
        )
        with (
            closing(cluster),
            leftovers.removed_by(lambda: kill(cluster)),
            closing(Client(cluster, set_as_default=False)) as client,
        ):
            cluster.scale(count)  # not before: an interruption ends the workers of the cluster
            _wait_for(cluster, client, count)
            yield client


def _wait_for(cluster: Any, client: Any, count: int) -> None:
    """Wait until all workers answer, and start another one for each that was lost."""
    from distributed.core import Status

    ended = Status.closing_gracefully, Status.closing, Status.closed, Status.failed
    replaced, until = 0, time.monotonic() + _STARTING
    while time.monotonic() < until:
        with suppress(TimeoutError):
            client.wait_for_workers(count, timeout=_LOOKING)
            return
        lost = sum(nanny.status in ended for nanny in cluster.workers.values())
        if replaced < lost <= _MOST_LOST * count:
            cluster.scale(len(cluster.worker_spec) + lost - replaced)
            replaced, until = lost, time.monotonic() + _STARTING
    raise DeviceError(f"{count} workers should answer on this machine; some did not")


def _start_helpers() -> None:
    """Start the process that workers are forked from, unless it runs, and multiprocessing's tracker
    of semaphores.

    A signal to all processes of a terminal is not for them: it is blocked in both from their first
    moment. The tracker would otherwise end by SIGHUP, and the one that is started in its place
    prints tracebacks.
    """
    from multiprocessing import forkserver, resource_tracker

    from distributed.utils import get_mp_context

    get_mp_context().set_forkserver_preload(_LOADED_ONCE)
    for start in (resource_tracker.ensure_running, forkserver.ensure_running):
        before = signal.pthread_sigmask(signal.SIG_BLOCK, interpreter.ending_signals())
        try:
            start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def kill(cluster: Any, address: str | None = None) -> None:
    """End the process of the worker at an address, or of all, whatever they are doing.

    The cluster starts another one in the place of one.
    """
    import psutil

    nannies = [n for n in cluster.workers.values() if address in (None, n.worker_address)]
    processes = []
    if address is None:
        for nanny in nannies:
            nanny.close_gracefully()
    for number in filter(None, (nanny.pid for nanny in nannies)):
        with suppress(psutil.Error):
            processes.append(psutil.Process(number))
            processes[-1].kill()
    psutil.wait_procs(processes, timeout=_KILLING)


def _end_processes() -> None:
    """Kill the workers and the process that they are forked from, at the end of the program.

    They would end by themselves, but only once they have loaded their modules. The tracker of
    multiprocessing's semaphores removes these when all others are gone.
    """
    import psutil

    processes = []
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            if not any("resource_tracker" in word for word in process.cmdline()):
                process.kill()
                processes.append(process)
    psutil.wait_procs(processes, timeout=_KILLING)


def _remove(folder: str) -> None:
    """Remove a folder, into which a process may write meanwhile."""
    for _ in range(_TRIES):
        rmtree(folder, ignore_errors=True)
        if not os.path.lexists(folder):
            break


@contextmanager
def _environment() -> Iterator[None]:
    """Meanwhile no Python that starts imports a module from the current folder."""
    names = "PYTHONSAFEPATH", "PYTHONPATH"
    before, wanted = dict(os.environ), interpreter.environment()
    _set(names, wanted)
    try:
        yield
    finally:
        _set(names, before)


def _set(names: Sequence[str], values: Mapping[str, str]) -> None:
    for name in names:
        os.environ.pop(name, None)
        if name in values:
            os.environ[name] = values[name]


@contextmanager
def closing(resource: Any) -> Iterator[Any]:
    """Close a client or a cluster, whose connection may be gone."""
    try:
        yield resource
    finally:
        with suppress(Exception):
            resource.close(timeout=_CLOSING)
