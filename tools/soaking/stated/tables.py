"""Tables of a colour config that state more values than they have, for `stated`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import make_frames as make
from make_config import film_config
from wgmb.io import stills

from . import StatedKind, copies

_LARGE = 10, 1000, 100_000, 2**31 - 1, 2**32, 2**64
_HEAD = 400  # bytes in which the sizes are
_NUMBER = re.compile(rb"(?<![\d.])\d+(?![\d.])")

_SPI1D = "Version 1\nFrom 0.0 1.0\nLength 3\nComponents 1\n{\n0.0\n0.5\n1.0\n}\n"
_CLF = """<?xml version="1.0" encoding="UTF-8"?>
<ProcessList id="a" compCLFversion="3"><LUT1D inBitDepth="32f" outBitDepth="32f">
<Array dim="3 1">0.0 0.5 1.0</Array></LUT1D></ProcessList>
"""
_CSP = """CSPLUTV100
1D

2
0.0 1.0
0.0 1.0
2
0.0 1.0
0.0 1.0
2
0.0 1.0
0.0 1.0

2
0.0 0.0 0.0
1.0 1.0 1.0
"""


def sizes(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Each whole number near the beginning."""
    for found in _NUMBER.finditer(data[:_HEAD]):
        for value in _LARGE:
            changed = data[: found.start()] + b"%d" % value + data[found.end() :]
            yield f"{found[0].decode()} at {found.start()} {value}", changed


def _commands(path: Path, output: Path) -> list[list[Any]]:
    """Show a frame with a config that names the table."""
    frame, config = path.with_name("frame.exr"), path.with_name("config.ocio")
    make.write_exr(frame, make.frame(2))
    folder = path.with_name("film")
    folder.mkdir(exist_ok=True)
    config.write_text(film_config(folder).read_text().replace("film.cube", path.name))
    plain = "--method", "tap", "--overwrite", "-q"
    return [["blur", frame, "-o", output, "--ocio", config, *plain]]


def _cube(path: Path) -> None:
    folder = path.with_name("cube")
    folder.mkdir(exist_ok=True)
    film_config(folder)
    path.write_bytes((folder / "film.cube").read_bytes())


def _text(text: str) -> Callable[[Path], object]:
    return lambda path: path.write_text(text)


def _kind(suffix: str, write: Callable[[Path], object]) -> StatedKind:
    return StatedKind(suffix, write, sizes, _commands, _shown, copies.table, ".clf", ".png")


def _shown(path: Path) -> str:
    return str(stills.read(path).sum())


KINDS = {
    "table-cube": _kind(".cube", _cube),
    "table-spi1d": _kind(".spi1d", _text(_SPI1D)),
    "table-clf": _kind(".clf", _text(_CLF)),
    "table-csp": _kind(".csp", _text(_CSP)),
}
