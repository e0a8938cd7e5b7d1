"""Exit codes of the program; docs/reference/files.md explains them."""

DONE, SOME_FAILED, USAGE, NO_DEVICE, INTERRUPTED = 0, 1, 2, 3, 130
