"""The scheduler and the workers of a run on this machine, whose ports answer no HTTP."""

from __future__ import annotations

from typing import Any

from distributed import Nanny, Scheduler, SpecCluster, Worker
from distributed.security import Security

_HOST: dict[str, Any] = {"host": "tls://127.0.0.1", "protocol": "tls://"}
_SILENT: dict[str, Any] = {"silence_logs": 50}


class LocalScheduler(Scheduler):
    """A scheduler without pages for browsers."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port for them."""


class LocalWorker(Worker):
    """A worker without pages for browsers."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port for them."""


class LocalNanny(Nanny):
    """The keeper of such a worker."""

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, worker_class=LocalWorker, **named)


def cluster_of(security: Security, env: dict[str, str]) -> SpecCluster:
    """A scheduler in this process, which can be scaled: workers of one thread in own processes.

    `env`: their environment.
    """
    common = {**_HOST, "security": security}
    options = {**common, "nthreads": 1, "memory_limit": 0, **_SILENT, "env": env}
    spec = {"cls": LocalNanny, "options": options}
    return SpecCluster(
        scheduler={"cls": LocalScheduler, "options": {**common, "port": 0, "dashboard": False}},
        worker=spec,
        security=security,
        **_SILENT,
    )
