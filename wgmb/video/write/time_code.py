"""Time codes (SMPTE ST 12-1): the one of the first output frame of a part, at the output's rate."""

from __future__ import annotations

import re
from fractions import Fraction

_FORM = re.compile(r"(\d{2}):(\d{2}):(\d{2})([:;.])(\d{2,3})")
_DROPPED = Fraction(1000, 1001)  # of the nominal rate: rates with numbers that are left out
_DAY = 24 * 60 * 60


def moved(text: str, rate: Fraction, by: Fraction, to: Fraction) -> str:
    """The time code `by` seconds later, at the rate `to`; '' if it is no time code.

    `text`: such as 01:02:03:04, or with a semicolon before the frames if numbers are left out
    (drop frame). `rate`: frames a second that it counts.
    """
    match = _FORM.fullmatch(text.strip())
    base, target = round(rate), round(to)
    if match is None or base < 1 or target < 1:
        return ""
    hours, minutes, seconds, frames = (int(match[n]) for n in (1, 2, 3, 5))
    number = ((hours * 60 + minutes) * 60 + seconds) * base + frames
    if match[4] != ":":
        number -= _left_out(number // base // 60, base)
    number += round(by * rate)
    drops = match[4] != ":" and to == target * _DROPPED and target % 30 == 0
    if drops:
        return _with_drops(number * target // base, target)
    if match[4] != ":":  # the clock on the wall, as numbers that are left out make it
        return _plain(round(number * target / rate), target)
    return _plain(number * target // base, target)


def _left_out(minutes: int, base: int) -> int:
    """Numbers that are left out in so many minutes: two in each of 30, but not in each tenth."""
    return base // 15 * (minutes - minutes // 10)


def _with_drops(number: int, base: int) -> str:
    ten, minute = 600 * base - 9 * (base // 15), 60 * base - base // 15
    tens, rest = divmod(number, ten)
    minutes = 10 * tens + (1 + (rest - 60 * base) // minute if rest >= 60 * base else 0)
    return _plain(number + _left_out(minutes, base), base, ";")


def _plain(number: int, base: int, mark: str = ":") -> str:
    seconds, frames = divmod(number, base)
    minutes, seconds = divmod(seconds % _DAY, 60)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{seconds:02d}{mark}{frames:02d}"
