"""The `wgmb` command, also `python -m wgmb`; handles Ctrl-C while modules are being loaded."""

import os
import signal


def _leave(*_) -> None:
    """Nothing has begun yet, so nothing is to be tidied up."""
    try:
        os.write(2, b"wgmb: interrupted\n")
    finally:
        os._exit(130)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    signal.signal(signal.SIGINT, _leave)
    signal.signal(signal.SIGTERM, _leave)
    from .cli.app import run

    run(arguments)


if __name__ == "__main__":
    main()
