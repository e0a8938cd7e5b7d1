"""Messages for the user instead of tracebacks."""


class ProblemError(Exception):
    """A sentence for the user: why nothing, or nothing more, is done."""


class NoAdapterError(ProblemError):
    """There is nothing that the blur could run on."""


class StoppedError(ProblemError):
    """The user stopped the rendering."""


def plain(error: BaseException) -> str:
    """A message in one line, without the names that Python has for things."""
    return " ".join(str(error).replace("`", "").split()) or type(error).__name__
