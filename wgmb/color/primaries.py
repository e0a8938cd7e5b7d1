"""RGB primaries: matrices between linear RGB spaces that are known by their chromaticities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError

REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""CIE 1931 x, y of red, green, blue and white, as in the attribute `chromaticities` of EXR."""
AP0 = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767)  # SMPTE ST 2065-1
AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)  # Academy S-2014-004
REC2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
P3_D65 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290)
XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
H273 = {  # of videos, by their numbers in ITU-T H.273, table 2
    1: REC709,
    5: (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, 0.3127, 0.3290),  # BT.601, 625 lines
    6: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, 0.3127, 0.3290),  # BT.601, 525 lines
    7: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, 0.3127, 0.3290),
    9: REC2020,
    11: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351),  # DCI-P3
    12: P3_D65,
}
_KNOWN = (REC709, AP0, AP1, REC2020, P3_D65)

_BRADFORD = np.array([
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
])  # fmt: skip


def conversion(source: Sequence[float], target: Sequence[float]) -> np.ndarray:
    """(3, 3) float64: linear RGB of the primaries `source` -> linear RGB of `target`.

    White becomes white: Bradford's chromatic adaptation (Lam 1985). `XYZ` has colours as they are
    measured: their white is taken for that of Rec. 709, D65. InputError where the eight numbers
    cannot be primaries.
    """
    measured = np.allclose(source, XYZ, rtol=0, atol=1e-5)
    adapted = _adaptation(_white(REC709 if measured else source), _white(target))
    return np.linalg.solve(_to_xyz(target), adapted @ _to_xyz(source))


def luminance(primaries: Sequence[float]) -> np.ndarray:
    """(3,) the shares of linear red, green and blue in the luminance."""
    return _to_xyz(primaries)[1]


def of_matrix(to_aces: np.ndarray) -> tuple[float, ...]:
    """The chromaticities of the linear RGB space from which `to_aces` leads to ACES2065-1.

    Those of a standard where one fits; else those that are left after the adaptation, with the
    white of ACES. `conversion(of_matrix(m), AP0)` is `m`.
    """
    for known in _KNOWN:
        if np.allclose(conversion(known, AP0), to_aces, rtol=0, atol=3e-4):
            return known
    xyz = _to_xyz(AP0) @ to_aces
    places = (xyz / xyz.sum(axis=0))[:2].T.ravel()
    return (*(float(v) for v in places), *AP0[6:])


def _to_xyz(primaries: Sequence[float]) -> np.ndarray:
    """RGB -> CIE XYZ, the Y of white being 1 (SMPTE RP 177)."""
    x, y = np.reshape(primaries, (4, 2)).astype(np.float64).T
    columns, white = np.stack([x, y, 1 - x - y])[:, :3], _white(primaries)
    if abs(np.linalg.det(columns)) < 1e-6:
        raise _no_primaries(primaries)
    return columns * np.linalg.solve(columns, white)


def _white(primaries: Sequence[float]) -> np.ndarray:
    """XYZ of white, its Y being 1."""
    x, y = primaries[6:]
    if not np.isfinite(primaries).all() or y < 1e-6:
        raise _no_primaries(primaries)
    return np.array([x / y, 1, (1 - x - y) / y])


def _adaptation(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """XYZ seen under the white `source` -> XYZ under the white `target`."""
    gains = (_BRADFORD @ target) / (_BRADFORD @ source)
    return np.linalg.solve(_BRADFORD, gains[:, None] * _BRADFORD)


def _no_primaries(numbers: Sequence[float]) -> InputError:
    shown = ", ".join(f"{v:g}" for v in numbers)
    return InputError(
        f"chromaticities must be x, y of red, green, blue and white, and span colours; got {shown}"
    )
