"""The interactive viewer: `python app.py [SCENE | FILE | PATTERN]`, the same as `wgmb view`."""

import sys

try:
    from wgmb.__main__ import main
except ImportError as error:  # of a Python that is too old
    sys.exit(f"app.py: {error}")

main(["view", *sys.argv[1:]])
