"""Loaded once by the process that workers of this machine are forked from.

A signal to all processes of a terminal or of a job is for the run itself, which tells its workers
when to stop; this process ends with the run, by a pipe.
"""

import signal

from ..interpreter import handle_signals
from . import plugin as plugin

handle_signals(signal.SIG_IGN)
