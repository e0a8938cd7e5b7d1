"""A disk that is full after so many bytes."""

import contextlib
import resource
import signal


@contextlib.contextmanager
def small_disk(limit: int):
    """Files may not grow beyond `limit` bytes; writing more is an error, not a signal."""
    most = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, most)
        signal.signal(signal.SIGXFSZ, before)
