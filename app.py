"""The interactive viewer: `python app.py [SCENE | FILE | PATTERN]`, the same as `wgmb view`."""

import sys

from wgmb.__main__ import main

main(["view", *sys.argv[1:]])
