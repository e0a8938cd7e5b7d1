"""wgpu's C types, parsed in a fiftieth of the time.

cffi parses the name of a C type the first time it is used, together with one line for every type
of the whole header: 16 ms each time, nearly a second until a first frame is blurred. The parser
asks only whether a word is a type, so the types that occur in the text are enough.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cache
from typing import Any

_TYPE = "typedef "


@cache
def quicken_wgpu() -> None:
    """Do this for wgpu; where it cannot be loaded, it says so itself once it is used."""
    with suppress(ImportError, OSError, RuntimeError):
        from wgpu.backends.wgpu_native import ffi

        quicken(ffi)


def quicken(ffi: Any) -> None:
    """Let a `cffi.FFI` parse every text with the types that occur in it alone.

    A cffi that is built in another way is left as it is.
    """
    parser: Any = getattr(ffi, "_parser", None)
    if not isinstance(getattr(parser, "_declarations", None), dict):
        return
    parse = getattr(parser, "_parse", None)
    if parse is None:
        return

    def parse_with_few(text: str) -> Any:  # cffi holds the lock of `ffi`
        whole = parser._declarations
        names = {_TYPE + word for word in re.findall(r"\w+", text)}
        parser._declarations = {name: whole[name] for name in names & whole.keys()}
        try:
            return parse(text)
        finally:
            parser._declarations = whole

    parser._parse = parse_with_few
