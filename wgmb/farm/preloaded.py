"""Loaded once by the process that workers of this machine are forked from.

A signal to all processes of a terminal or of a job is for the run itself, which tells its workers
when to stop; this process ends with the run, by a pipe. It begins with such signals blocked.
"""

import signal

from ..interpreter import ending_signals, handle_signals
from . import plugin as plugin

handle_signals(signal.SIG_IGN)
signal.pthread_sigmask(signal.SIG_UNBLOCK, ending_signals())
