"""The names of C types are parsed quickly, and mean what they meant."""

import re
from pathlib import Path

import cffi
import pycparser
import pytest
from wgpu.backends.wgpu_native import _api
from wgpu.backends.wgpu_native import ffi as ffi_of_wgpu
from wgpu.backends.wgpu_native._ffi import get_wgpu_header

from wgmb.gpu.device import claim, quicken

pytestmark = pytest.mark.fast

HEADER = """
typedef struct Pair { int x; double y; } Pair;
typedef struct Hidden *Handle;
typedef enum Colour { Red = 1, Blue = 7 } Colour;
typedef void (*Call)(Pair const *, Colour, void *);
typedef Call Calls[3];
"""
TEXTS = [
    "Pair", "Pair *", " Pair  * *", "Pair[]", "Pair[4]", "Handle", "Handle*", "struct Pair *",
    "Colour", "Call", "Calls *", "void(Pair const *, Handle, void *)", "void(*)(Call)",
    "int", "unsigned long", "uint32_t []", "char []", "intptr_t", "bool *",
]  # fmt: skip


def both() -> tuple[cffi.FFI, cffi.FFI]:
    plain, quick = cffi.FFI(), cffi.FFI()
    for made in (plain, quick):
        made.cdef(HEADER)
    quicken(quick)
    return plain, quick


def described(ffi: cffi.FFI, text: str) -> tuple[str, int]:
    try:
        found = ffi.typeof(text)
    except cffi.CDefError:  # a function; the pointer to it is what a callback has
        found = ffi._typeof(text, consider_function_as_funcptr=True)
    return repr(found), ffi.sizeof(found) if found.kind != "array" or found.length else 0


@pytest.mark.parametrize("text", TEXTS)
def test_a_type_is_the_same(text):
    plain, quick = both()
    assert described(quick, text) == described(plain, text)


def test_every_type_that_wgpu_names_is_the_same():
    claim()
    plain = cffi.FFI()
    plain.cdef(get_wgpu_header())
    texts = set(re.findall(r'"(\w+ ?(?:\*+|\[\]) ?)"', Path(_api.__file__).read_text()))
    assert len(texts) > 40
    for text in texts:
        assert described(ffi_of_wgpu, text) == described(plain, text)


def test_the_parser_reads_no_type_that_does_not_occur(monkeypatch):
    claim()
    read = []
    plain = pycparser.CParser.parse
    monkeypatch.setattr(
        pycparser.CParser, "parse", lambda self, text, *a: read.append(text) or plain(self, text)
    )
    ffi_of_wgpu.typeof("WGPUBindGroup * * *")
    assert len(read) == 1
    assert "typedef int WGPUBindGroup;" in read[0]
    assert read[0].count("WGPU") == 2


def test_what_is_no_type_is_still_refused_and_does_no_harm():
    _, quick = both()
    for text in ("Pear *", "Pair +", "{"):
        with pytest.raises((cffi.CDefError, cffi.FFIError)):
            quick.typeof(text)
    assert quick.new("Pair *", {"x": 3}).x == 3
    quick.cdef("typedef struct { Pair of[2]; } Two;")
    assert quick.sizeof("Two") == 2 * quick.sizeof("Pair")
    with pytest.raises(cffi.FFIError):
        quick.cdef("typedef int Pair;")


def test_another_ffi_is_left_alone():
    class Compiled:
        pass

    quicken(Compiled())
