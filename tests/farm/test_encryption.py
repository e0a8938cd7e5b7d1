"""Encrypted connections of workers: what ends one of them leaves the others alone."""

import socket
import ssl

import pytest

from wgmb.farm.encryption import Encryption


def connected(security):
    """Two ends of one connection, after their handshake; neither waits."""
    ends = socket.socketpair()
    for end in ends:
        end.setblocking(False)
    client = security.get_connection_args("client")["ssl_context"]
    server = security.get_listen_args("scheduler")["ssl_context"]
    ends = (
        client.wrap_socket(ends[0], do_handshake_on_connect=False),
        server.wrap_socket(ends[1], do_handshake_on_connect=False, server_side=True),
    )
    waiting = set(ends)
    while waiting:
        for end in tuple(waiting):
            try:
                end.do_handshake()
                waiting.remove(end)
            except ssl.SSLWantReadError:
                pass
    with pytest.raises(ssl.SSLWantReadError):  # what follows the handshake is taken
        ends[0].recv_into(bytearray(1))
    return ends


def test_an_error_of_one_connection_is_not_reported_by_another():
    security = Encryption.temporary()
    first, other = connected(security)
    second, partner = connected(security)
    with first, other, second, partner:
        other.close()
        with pytest.raises(OSError, match=r"Broken pipe|EOF occurred"):
            first.send(b"to nobody")
        with pytest.raises(ssl.SSLWantReadError):
            second.recv_into(bytearray(1))
        partner.send(b"sound")
        got = bytearray(5)
        assert second.recv_into(got) == 5
        assert got == b"sound"
