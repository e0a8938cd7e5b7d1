"""`wgmb devices`: list the available GPUs."""

from __future__ import annotations

from ... import gpu
from ...errors import DeviceError
from ..exit_codes import DONE
from ..terminal import out


def devices() -> int:
    """List the GPUs for --adapter (or WGMB_ADAPTER); * is the default.

    Example: WGMB_ADAPTER=llvmpipe wgmb devices
    """
    adapters = gpu.adapters()
    try:
        chosen = gpu.choose_adapter()
    except DeviceError:
        chosen = None
    for i, adapter in enumerate(adapters):
        same = chosen is not None and adapter.summary == chosen.summary
        out(f"{'*' if same else ' '} {i}: {adapter.summary}")
    if chosen is None:
        gpu.choose_adapter()  # says why
    return DONE
