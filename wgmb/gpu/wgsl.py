"""Read shaders: includes, struct layouts, constants and bindings.

WGSL is the one place where a struct, a constant or a binding is written down.
This module reads those declarations so that Python never repeats them.

Supported on purpose: structs of f32/i32/u32, vec2..4, mat4x4f and fixed arrays
of those. Anything else (@size, @align, f16, mat3x3) raises, it is not guessed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ShaderError

_HERE = Path(__file__).parents[1]
ROOT = next(p for p in (_HERE / "wgsl", _HERE.parent / "wgsl") if p.is_dir())  # wheel, checkout
_SCALAR = {"f32": "<f4", "i32": "<i4", "u32": "<u4"}
_SUFFIX = {"f": "f32", "i": "i32", "u": "u32"}


@dataclass(frozen=True)
class Binding:
    """One `@group(..) @binding(..) var` declaration."""

    group: int
    index: int
    name: str
    space: str  # "uniform", "storage, read_write", "" for textures and samplers
    type: str


@dataclass(frozen=True)
class WgslSource:
    """One shader file followed by everything it includes, each file once."""

    text: str
    files: tuple[tuple[str, int], ...]  # (file, its first line in text)
    standard: WgslSource | None = None  # of one that reads storage textures: the shader without

    @property
    def name(self) -> str:
        """The file that was asked for."""
        return self.files[0][0]

    def where(self, line: int) -> str:
        """Name the file and line that line number `line` of `text` came from."""
        name, first = max((f for f in self.files if f[1] <= line), key=lambda f: f[1])
        return f"{name}:{line - first + 1}"

    def constant(self, name: str) -> float | int:
        """Value of `const name: type = value;`."""
        value = _constant(self.text, name)
        if value is None:
            raise ShaderError(f"no constant {name} in {self.name}")
        return value

    def integer(self, name: str) -> int:
        """The same of a constant that counts."""
        return int(self.constant(name))

    def dtype(self, name: str) -> np.dtype:
        """The numpy dtype with exactly the layout the GPU gives struct `name`."""
        return layout(name, self.text)[0]

    def bindings(self) -> list[Binding]:
        """Every binding of the file and its includes, type aliases resolved."""
        pattern = r"^@group\((\d+)\) @binding\((\d+)\)\s+var(?:<([^>]*)>)?\s+(\w+)\s*:\s*(.+?);"
        alias = dict(re.findall(r"^alias (\w+)\s*=\s*(.+?);", self.text, re.M))
        return [
            Binding(int(g), int(b), name, space, alias.get(kind, kind))
            for g, b, space, name, kind in re.findall(pattern, self.text, re.M)
        ]

    def names(self) -> frozenset[str]:
        """Names of the bindings."""
        return _names(self.text)[0]

    def overrides(self) -> frozenset[str]:
        """Names of the constants that are set when a pass is compiled."""
        return _names(self.text)[1]

    def flexible(self) -> frozenset[str]:
        """Bindings that are "stored as given": their format is that of the resource."""
        return _names(self.text)[2]

    def entry_points(self) -> list[str]:
        """Names of the compute entry points."""
        return re.findall(r"@compute\s+@workgroup_size\([^)]*\)\s+fn (\w+)", self.text)

    def with_texels(self, **formats: str) -> WgslSource:
        """The same shader with other texel formats in its aliases, as `Output="rgba16float"`.

        Or in its marks "stored as FORMAT", by the name of the binding.
        """
        text = self.text
        for alias, texel in formats.items():
            declared = rf"alias {alias} = texture_storage_2d(?:_array)?<"
            marked = rf".* var {alias}: .*// stored as "
            text = re.sub(rf"^({declared}|{marked})\w+", rf"\g<1>{texel}", text, flags=re.M)
        return WgslSource(text, self.files)

    def reading_storage(self, most: int) -> WgslSource:
        """The same shader, with textures marked "stored as FORMAT" bound as storage textures.

        Not those "stored as given", which are a caller's: `with_texels` gives their format.
        `most`: storage textures that it may have, with those that it writes; the first ones are
        taken. Their textureLoad() names the level 0, which storage textures do not have.
        """
        pattern = r"(var (\w+): )texture_(2d|2d_array)<[uf]32>(; *// stored as )(?!given\b)(\w+)"
        written = sum("texture_storage" in binding.type for binding in self.bindings())
        marks = list(re.finditer(pattern, self.text))[: max(most - written, 0)]
        read = {mark[2] for mark in marks}

        def declared(mark: re.Match[str]) -> str:
            if mark[2] not in read:
                return mark[0]
            return f"{mark[1]}texture_storage_{mark[3]}<{mark[5]}, read>{mark[4]}{mark[5]}"

        text = re.sub(pattern, declared, self.text)
        for name in read:
            text = re.sub(rf"(textureLoad\({name}(?:, [\w.]+)+), 0\)", r"\1)", text)
        return WgslSource(text, self.files, self)


def filled(dtype: np.dtype, values: Mapping[str, Any]) -> np.ndarray:
    """A struct with these values, all else 0; of vectors and arrays, the first elements may do."""
    data = np.zeros((), dtype)
    for name, value in values.items():
        field = data[name]
        if field.ndim and np.ndim(value) and len(value) < len(field):
            field[: len(value)] = value
        else:
            data[name] = value
    return data


@cache
def _names(text: str) -> tuple[frozenset[str], frozenset[str], frozenset[str]]:
    """Names of bindings, of overrides, and of bindings that are stored as given."""
    return (
        frozenset(re.findall(r"^@group\(\d+\).* var(?:<[^>]*>)? (\w+)\s*:", text, re.M)),
        frozenset(re.findall(r"^override (\w+)", text, re.M)),
        frozenset(re.findall(r"var (\w+): .*// stored as given", text)),
    )


@cache
def _constant(text: str, name: str) -> float | int | None:
    m = re.search(rf"^const {name}\s*:\s*\w+\s*=\s*([-\d.eExXa-fA-F]+?)u?;", text, re.M)
    if not m:
        return None
    return int(m[1], 0) if re.fullmatch(r"-?(\d+|0[xX].+)", m[1]) else float(m[1])


def texel_aliases(text: str) -> dict[str, str]:
    """The texel format of every alias of a storage texture, by the alias."""
    return dict(re.findall(r"^alias (\w+) = texture_storage_2d(?:_array)?<(\w+)", text, re.M))


@cache
def load(name: str) -> WgslSource:
    """Read `wgsl/<name>`, or a file with an absolute path, and append its includes.

    WGSL does not care about the order of declarations, so includes go to the end
    and the file keeps its own line numbers in error messages. A file outside of wgsl/ may include
    those that lie beside it, too.
    """
    todo, text, files = [(name, name)], "", []
    while todo:
        current, asker = todo.pop(0)
        if any(current == f for f, _ in files):
            continue
        path = ROOT / current
        if not path.is_file():
            raise ShaderError(f"{asker}: no such file {_file_name(current)}")
        files.append((current, text.count("\n") + 1))
        body = path.read_text(encoding="utf-8")
        asked = re.findall(r"^//#include (\S+)$", body, re.M)
        todo += [(_included(name, current), current) for name in asked]
        text += body.rstrip("\n") + "\n"
    return WgslSource(text, tuple(files))


def _included(name: str, asker: str) -> str:
    """The file that an include of a file names."""
    beside = Path(asker).parent / name
    return str(beside) if Path(asker).is_absolute() and beside.is_file() else name


def _file_name(name: str) -> str:
    return name if Path(name).is_absolute() else f"wgsl/{name}"


@cache
def layout(kind: str, text: str) -> tuple[np.dtype, int]:
    """Numpy dtype and alignment of a WGSL type (WGSL specification, "Alignment and Size")."""
    kind = kind.replace(" ", "")
    if kind in _SCALAR:
        return np.dtype(_SCALAR[kind]), 4
    if m := re.fullmatch(r"atomic<(\w+)>", kind):
        return layout(m[1], text)
    if m := re.fullmatch(r"vec([234])(?:([fiu])|<([fiu]32)>)", kind):
        n = int(m[1])
        return np.dtype((_SCALAR[m[3] or _SUFFIX[m[2]]], (n,))), 4 * (2 if n == 2 else 4)
    if kind in ("mat4x4f", "mat4x4<f32>"):
        return np.dtype(("<f4", (4, 4))), 16  # row i here is column i in WGSL
    if m := re.fullmatch(r"array<(.+),(\w+)>", kind):
        return _array(m[1], m[2], kind, text)
    return _struct(kind, text)


def _array(item_kind: str, count: str, kind: str, text: str) -> tuple[np.dtype, int]:
    item, align = layout(item_kind, text)
    if item.itemsize % align:
        raise ShaderError(f"{kind}: elements would need padding, use vec4")
    n = (
        count.rstrip("u")
        if count.rstrip("u").isdigit()
        else WgslSource(text, (("shader", 1),)).constant(count)
    )
    return np.dtype((item, (int(n),))), align


def _struct(kind: str, text: str) -> tuple[np.dtype, int]:
    m = re.search(rf"^struct {kind} \{{(.*?)^\}}", text, re.M | re.S)
    if not m:
        raise ShaderError(f"unsupported type {kind}")
    body = re.sub(r"//[^\n]*", "", m[1])
    if "@" in body:
        raise ShaderError(f"struct {kind}: attributes are not supported")
    names, formats, offsets, end, widest = [], [], [], 0, 4
    for field in re.split(r",(?![^<]*>)", body):
        if not field.strip():
            continue
        name, _, field_kind = field.partition(":")
        item, align = layout(field_kind.strip(), text)
        end = -(-end // align) * align
        names.append(name.strip())
        formats.append(item)
        offsets.append(end)
        end, widest = end + item.itemsize, max(widest, align)
    size = -(-end // widest) * widest
    dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})
    return dtype, widest
