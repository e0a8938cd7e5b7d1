"""Files of an OpenColorIO config, before OpenColorIO opens them: regular, of a bounded size.

A config names files with tables of colours, and a table may name others (CLF and CTF): the latter
are refused, as nothing says how many there are.
"""

from __future__ import annotations

import contextlib
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import bounded

_MOST_CONFIG = 16 << 20  # bytes of a config's text
_MOST_TABLE = 64 << 20  # bytes of a table: one of 129 a side takes 60 MB as text
_MOST_ARCHIVE = 256 << 20  # bytes that all files in an archive unpack to
_REFERENCE = re.compile(b"<Reference" + b"|" + b"<\0R\0e\0f\0" + b"|" + b"\0<\0R\0e\0f")
"""The element of a table that names another file, in UTF-8 and UTF-16."""


def check(config: str, path: Path) -> None:
    """InputError for a config that is too large, no regular file, or no text in UTF-8.

    `config`: its name, for messages. Names of built-in configs, and of files that are not there,
    are for OpenColorIO.
    """
    try:
        if path.suffix.lower() == ".ocioz":
            bounded.check(path, _MOST_ARCHIVE, "an archive of a config")
            _check_archive(path)
        elif "://" not in config:
            bounded.read(path, _MOST_CONFIG, "a config").decode()
    except UnicodeDecodeError as error:
        raise InputError(f"{config}: must be text in UTF-8, byte {error.start} is not") from None
    except OSError:
        return  # OpenColorIO says why it cannot be read


def _check_archive(path: Path) -> None:
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError) as error:
        raise InputError(f"{path}: not an archive of a config: {error}") from None
    if sum(member.file_size for member in members) > _MOST_ARCHIVE:
        raise InputError(f"{path}: unpacks to over {_MOST_ARCHIVE >> 20} MiB")


def check_tables(ocio: Any, config: Any) -> None:
    """InputError for a table of the config that is no regular file, too large, or names others.

    `ocio`: the module. A table that is not there is for OpenColorIO, where it is needed.
    """
    if config.getConfigIOProxy() is not None:  # an archive, which holds its tables
        return
    context = config.getCurrentContext()
    for name in dict.fromkeys(_tables(ocio, config)):
        with contextlib.suppress(OSError, ocio.Exception, ocio.ExceptionMissingFile):
            path = Path(context.resolveFileLocation(name))
            if _REFERENCE.search(bounded.read(path, _MOST_TABLE, "a table of colours")):
                raise InputError(f"{path}: a table of colours must not name another file")


def _tables(ocio: Any, config: Any) -> Iterator[str]:
    """The files of all transforms of a config, as it writes them."""
    for transform in _transforms(ocio, config):
        if transform is not None:
            yield from _files(ocio, transform)


def _transforms(ocio: Any, config: Any) -> Iterator[Any]:
    every = ocio.SEARCH_REFERENCE_SPACE_ALL, ocio.COLORSPACE_ALL
    for space in config.getColorSpaces(*every):
        yield space.getTransform(ocio.COLORSPACE_DIR_TO_REFERENCE)
        yield space.getTransform(ocio.COLORSPACE_DIR_FROM_REFERENCE)
    for look in config.getLooks():
        yield look.getTransform()
        yield look.getInverseTransform()
    for view in config.getViewTransforms():
        yield view.getTransform(ocio.VIEWTRANSFORM_DIR_TO_REFERENCE)
        yield view.getTransform(ocio.VIEWTRANSFORM_DIR_FROM_REFERENCE)
    for named in config.getNamedTransforms(ocio.NAMEDTRANSFORM_ALL):
        yield named.getTransform(ocio.TRANSFORM_DIR_FORWARD)
        yield named.getTransform(ocio.TRANSFORM_DIR_INVERSE)


def _files(ocio: Any, transform: Any) -> Iterator[str]:
    if isinstance(transform, ocio.GroupTransform):
        for part in transform:
            yield from _files(ocio, part)
    elif isinstance(transform, ocio.FileTransform):
        yield transform.getSrc()
