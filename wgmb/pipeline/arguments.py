"""The arguments of a Blur: defaults, limits and checks, without a device."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import wgpu

from .. import gpu
from ..errors import InputError, check_choice, did_you_mean_setting
from ..methods import METHODS, check_method
from ..methods.contract import Method
from ..methods.contract_check import check_contract
from ..methods.options import options_of
from ..shutter import Shutter, Weight

MOST_SAMPLES = 4096  # lavapipe ends every loop after 65,535 turns an invocation, silently
SAMPLES = 16
AUTO_SAMPLES = 64  # the most that "auto" takes a pixel
OUTPUTS = ("rgba32float", "rgba16float")


def method_of(method: str | type[Method]) -> type[Method]:
    """The class of a method that is named, or is the class itself; InputError if it is neither."""
    if isinstance(method, type):
        check_contract(method)
        return method
    check_method(method)
    return METHODS[method]


def checked(
    method: type[Method],
    samples: int | str | None = None,
    jitter: float = 0.0,
    max_blur: float | None = None,
    output: str = OUTPUTS[0],
    options: Mapping[str, Any] | None = None,
) -> tuple[int, bool]:
    """The samples that a Blur of these arguments takes, and whether they are "auto".

    InputError where one of them makes no sense; no device is opened.
    """
    auto = samples == "auto" and getattr(method, "adaptive", False)
    if samples is None:
        samples = getattr(method, "samples", SAMPLES)
    samples = AUTO_SAMPLES if samples == "auto" else samples
    if not isinstance(samples, (int, np.integer)) or not 1 <= samples <= MOST_SAMPLES:
        raise InputError(f"`samples` must be 1 to {MOST_SAMPLES} or auto, got {samples!r}")
    if not 0 <= jitter <= 1:
        raise InputError(f"`jitter` must be 0 to 1, got {jitter}")
    if max_blur is not None and not max_blur >= 0:
        raise InputError(f"`max_blur` must be 0 or more pixels, got {max_blur}")
    check_choice("output", output, OUTPUTS)
    known = options_of(method.Options)
    if unknown := (options or {}).keys() - known.keys():
        raise InputError(_no_option(method.name, sorted(unknown), list(known)))
    return int(samples), auto


def _no_option(method: str, unknown: list[str], own: list[str]) -> str:
    """The message about options that a method does not have."""
    others = [n for n, m in METHODS.items() if not set(unknown) - options_of(m.Options).keys()]
    text = f"method {method!r} has no option {', '.join(unknown)}"
    if others:
        return f"{text}, but {' and '.join(others)}; it has {', '.join(own) or 'none'}"
    hint = did_you_mean_setting(unknown[0], [*own, *_OF_ALL])
    return f"{text}; it has {', '.join(own + _OF_ALL)}{hint}"


_OF_ALL = ["shutter", "curve", "samples", "jitter", "max_blur", "device", "output"]
"""Arguments of every Blur."""


def most_samples(method: type[Method], device: wgpu.GPUDevice) -> int:
    """The most samples that a pixel may take on the device."""
    if device.adapter_info["adapter_type"] != gpu.SOFTWARE:
        return MOST_SAMPLES
    return getattr(method, "most_in_software", MOST_SAMPLES)


def shutter_of(shutter: Shutter | float, curve: str | Weight | None = None) -> Shutter:
    """The Shutter of these degrees; one that is a Shutter already stays as it is."""
    if isinstance(shutter, Shutter):
        if curve is not None:
            raise InputError(
                "`curve` is for degrees; a Shutter has its own: Shutter(90, curve=...)"
            )
        return shutter
    try:
        degrees = shutter if isinstance(shutter, str) else float(shutter)  # Shutter refuses text
    except (TypeError, ValueError):
        raise InputError(f"`shutter` must be degrees or a Shutter, got {shutter!r}") from None
    return Shutter(degrees) if curve is None else Shutter(degrees, curve=curve)
