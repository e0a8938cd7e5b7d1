"""Videos of earlier runs: which is done, and which a run may replace."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..io import record

_NOT_OURS = " and holds no record of a run: it is cut off, or of another program"


def is_finished(path: Path, made_of: dict[str, Any], *, resume: bool, overwrite: bool) -> bool:
    """Return True, with `resume`, if there is a whole video that was made of the same.

    False where a video is to be made. InputError for one that must not be replaced:
    without `overwrite`, `resume` replaces only results of the same inputs that were damaged since.
    """
    if not os.path.exists(os.path.realpath(path)):
        return False
    more, is_ours = "", False
    if resume:
        stated, is_whole = _record_of(path)
        is_ours = stated == json.loads(json.dumps(made_of))
        if is_ours and is_whole:
            return True
        more = " and was made otherwise" if stated else _NOT_OURS
    if not (overwrite or is_ours):
        raise InputError(f"{path} exists{more}; `overwrite=True` replaces it")
    return False


def _record_of(path: Path) -> tuple[dict[str, Any] | None, bool]:
    """The content of a video's record, and True if the video is whole."""
    try:
        return record.read_file(path)
    except OSError as error:
        raise InputError(f"{path}: {(error.strerror or str(error)).lower()}") from None
