"""`python -m wgmb` is the command line."""

from .cli import run

run()
