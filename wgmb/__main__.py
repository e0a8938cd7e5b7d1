"""The `wgmb` command, also `python -m wgmb`; handles Ctrl-C while modules are being loaded."""

import os
import sys

from . import interpreter


def _leave(*_) -> None:
    """Nothing has begun yet, so nothing is to be tidied up."""
    try:
        os.write(2, b"wgmb: interrupted\n")
    finally:
        os._exit(130)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    interpreter.leave_current_folder()
    interpreter.name_runtime_folder()
    interpreter.handle_signals(_leave)
    try:
        from .cli.app import run
    except ImportError as error:
        from .extras import reason

        if not (why := reason(error)):
            raise
        sys.stderr.write(f"wgmb: the command line: {why}\n")
        sys.exit(2)
    run(arguments)


if __name__ == "__main__":
    main()
