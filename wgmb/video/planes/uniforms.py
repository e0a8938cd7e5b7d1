"""Uniforms of the passes over planes: sizes, and the meaning of samples."""

from __future__ import annotations

import numpy as np
import wgpu

from ... import gpu
from ...color.coding import FLOAT, Coding
from ...errors import InputError
from ...gpu import wgsl
from .matrices import from_samples, to_samples

_CURVES = {4: 4, 5: 5, 8: 8, 13: 13, 16: 16, 18: 18, 1: 13, 6: 13, 11: 13, 14: 13, 15: 13}
"""The transfers of H.273 that are known, and the curve of wgsl/common/transfer.wgsl for each."""


def curve_of(coding: Coding) -> int:
    """The curve of a picture's transfer; InputError where that is not known here."""
    if coding.transfer not in _CURVES:
        known = ", ".join(map(str, sorted(_CURVES)))
        raise InputError(f"transfer {coding.transfer} of H.273 is not known; these are: {known}")
    return _CURVES[coding.transfer]


def reading(device: wgpu.GPUDevice, coding: Coding) -> wgpu.GPUBuffer:
    """The struct Code by which samples become signals."""
    return _code(device, from_samples(coding), 1 / _most(coding), coding)


def writing(device: wgpu.GPUDevice, coding: Coding) -> wgpu.GPUBuffer:
    """The struct Code by which signals become samples."""
    return _code(device, to_samples(coding), _most(coding), coding)


def _most(coding: Coding) -> int:
    """The sample of full opacity."""
    return 1 if coding.bits == FLOAT else 2**coding.bits - 1


def _code(device: wgpu.GPUDevice, rows: np.ndarray, alpha: float, coding: Coding) -> wgpu.GPUBuffer:
    data = np.zeros((), wgsl.load("video/planes/code.wgsl").dtype("Code"))
    data["x"], data["y"], data["z"] = rows
    data["alpha"], data["step"] = alpha, coding.steps
    return gpu.constant(device, "code", data)
