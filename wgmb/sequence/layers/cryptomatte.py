"""Cryptomattes: the coverage of objects by name or id.

Friedman and Jones 2015; Cryptomatte specification 1.2.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError, did_you_mean
from ...files import bounded
from .names import layers, stem

Attributes = Mapping[str, str]
"""Of one Cryptomatte: name, manifest, manif_file and so on."""

_ID = re.compile(r"0[xX][0-9a-fA-F]{1,8}")
_MOST_BYTES = 16 << 20  # of a manifest beside the file: 400,000 names
_SHOWN = 8  # names in a message


class NoSuchNameError(InputError):
    """No object in the manifest has the name."""


def find(attributes: Mapping[str, Any], layer: str) -> Attributes | None:
    """Metadata of the Cryptomatte called `layer` in a file's `attributes`; None without one."""
    found: dict[str, dict[str, str]] = {}
    for name, value in attributes.items():
        m = re.fullmatch(r"cryptomatte/([^/]+)/(\w+)", name)
        if m and isinstance(value, str):  # of another type it may not even be readable
            found.setdefault(m[1], {})[m[2]] = value
    for crypto in found.values():
        name = crypto.get("name")
        if name and (layer in (name, stem(name)) or stem(name) == layer.lower()):
            return crypto
    return None


def is_id(value: str) -> bool:
    """Return True for an id: 0x and up to eight digits."""
    return _ID.fullmatch(value) is not None


def ids(crypto: Attributes, value: str, folders: Iterable[Path] = ()) -> list[int]:
    """The ids that `value` stands for: an id, a name in the manifest, or a pattern for several.

    A name with *, ? or [ that is in the manifest as it stands is no pattern. `folders`: where the
    file of the manifest may lie. NoSuchNameError if there is no such name.
    """
    if not value:
        raise InputError(f"Cryptomatte {crypto['name']!r}: choose an object with LAYER=NAME")
    if is_id(value):
        return [int(value, 16)]
    manifest, path = _manifest(crypto, folders)
    its = f"its manifest {path}" if path else "its manifest"
    names = [value]
    if value not in manifest:
        pattern = any(c in value for c in "*?[")
        names = [n for n in manifest if fnmatchcase(n, value)] if pattern else []
    if not names:
        raise NoSuchNameError(
            f"Cryptomatte {crypto['name']!r} has no {value!r}; {its} has "
            f"{_some(manifest) or 'nothing; give the id as 0x and eight digits'}"
            f"{did_you_mean(value, manifest)}"
        )
    by_name = {name: manifest[name] for name in names}
    for name, id_ in by_name.items():
        if not isinstance(id_, str) or not re.fullmatch(r"[0-9a-fA-F]{1,8}", id_):
            raise InputError(f"Cryptomatte {crypto['name']!r}: bad id for {name!r} in {its}")
    return [int(str(id_), 16) for id_ in by_name.values()]


def coverage(
    channels: Mapping[str, np.ndarray], crypto: Attributes, wanted: Iterable[int]
) -> np.ndarray:
    """(height, width) float32 0..1: how much of each pixel the objects of these ids cover."""
    name, known = crypto["name"], np.unique(np.fromiter(wanted, np.uint32))
    ranks = {
        k: v for k, v in layers(channels).items() if re.fullmatch(re.escape(name) + r"\d\d", k)
    }
    if not ranks:
        raise InputError(f"Cryptomatte {name!r} has no layers {name}00, {name}01, ...")
    total = np.zeros(next(iter(channels.values())).shape, np.float32)
    if not len(known):
        return total
    for members in ranks.values():
        for id_, share in zip(members[0::2], members[1::2], strict=False):
            own = np.ascontiguousarray(channels[id_], np.float32).view(np.uint32)
            place = np.searchsorted(known, own) if len(known) > 1 else np.zeros((1, 1), int)
            is_wanted = known[np.minimum(place, len(known) - 1)] == own
            total += np.where(is_wanted, np.asarray(channels[share], np.float32), 0)
    return np.clip(total, 0, 1)


def sidecar(crypto: Attributes, folders: Iterable[Path]) -> Path | None:
    """The file of the manifest, beside the EXR; None if the manifest is in the EXR, or nowhere."""
    name = crypto.get("manif_file")
    if crypto.get("manifest") or not name:
        return None
    if name != Path(name).name or "\\" in name or not name.endswith(".json"):
        raise InputError(
            f"Cryptomatte {crypto['name']!r}: its manifest {name!r} must be a .json file beside "
            "the EXR, without a folder"
        )
    places = [folder / name for folder in folders] or [Path(name)]
    return next((path for path in places if path.is_file()), places[0])


def _manifest(crypto: Attributes, folders: Iterable[Path]) -> tuple[dict[str, object], Path | None]:
    """Ids as text by name, and the file that they are from, None for the EXR.

    Empty where the EXR holds none, or a damaged one.
    """
    path = sidecar(crypto, folders)
    if path is None:
        return _parsed(crypto.get("manifest") or "{}") or {}, None
    try:
        if not path.is_file():
            raise InputError(f"{path}: no such file; it is the manifest of {crypto['name']!r}")
        manifest = _parsed(bounded.read(path, _MOST_BYTES, "a manifest").decode())
    except UnicodeDecodeError:
        raise InputError(f"{path}: not UTF-8") from None
    except OSError as error:
        raise InputError(f"{path}: {(error.strerror or str(error)).lower()}") from None
    if manifest is None:
        raise InputError(f"{path}: is no JSON of names; it is the manifest of {crypto['name']!r}")
    return manifest, path


@lru_cache(maxsize=4)  # frame after frame has the same, of up to a hundred thousand names
def _parsed(text: str) -> dict[str, object] | None:
    """None if it is no table."""
    try:
        manifest = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return manifest if isinstance(manifest, dict) else None


def _some(names: Mapping[str, object]) -> str:
    """The first names, and how many there are if these are not all."""
    text = ", ".join(list(names)[:_SHOWN])
    return f"{text}, ... ({len(names)} names)" if len(names) > _SHOWN else text
