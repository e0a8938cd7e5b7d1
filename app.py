"""The interactive viewer: `python app.py [SCENE | FILE | PATTERN]`, the same as `wgmb view`."""

import sys

from wgmb.cli import main

sys.exit(main(["view", *sys.argv[1:]]))
