"""Encrypted connections of a run's own workers, with keys that are never written to disk.

In Python 3.12 and 3.13 with OpenSSL 3.4 or newer, the error of a write to an ended connection stays
in OpenSSL's queue of the thread, and the next read of a sound connection reports it (CPython's
issue 148594): workers, or the run itself, lost connections at random. Here each error is forgotten
once it is raised.
"""

from __future__ import annotations

import ssl
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from distributed.security import Security

if TYPE_CHECKING:
    from typing_extensions import Buffer


class _Socket(ssl.SSLSocket):
    def do_handshake(self, block: bool = False) -> None:
        return _alone(super().do_handshake, block)

    def send(self, data: Buffer, flags: int = 0) -> int:
        return _alone(super().send, data, flags)

    def recv_into(self, buffer: Buffer, nbytes: int | None = None, flags: int = 0) -> int:
        return _alone(super().recv_into, buffer, nbytes, flags)


class Encryption(Security):
    """Security whose sockets keep their errors to themselves."""

    __slots__ = Security.__slots__  # the names of the settings that it takes

    def get_connection_args(self, role: str) -> dict[str, Any]:
        """Return the arguments that open a connection."""
        return _with_sockets(super().get_connection_args(role))

    def get_listen_args(self, role: str) -> dict[str, Any]:
        """Return the arguments that accept connections."""
        return _with_sockets(super().get_listen_args(role))


def _with_sockets(arguments: dict[str, Any]) -> dict[str, Any]:
    if context := arguments["ssl_context"]:
        context.sslsocket_class = _Socket
    return arguments


def _alone(call: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of a socket; an error that it raises is no longer in OpenSSL's queue."""
    try:
        return call(*arguments)
    except (ssl.SSLWantReadError, ssl.SSLWantWriteError):
        raise
    except OSError:
        with suppress(ssl.SSLError):  # the only call without effects that empties the queue
            ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).set_ciphers("none")
        raise
