"""Sound made longer or shorter at its own pitch, in time to a few milliseconds.

WSOLA: pieces of the input overlap in the output at another distance, each moved a little so that it
goes on as the one before it would have (W. Verhelst, M. Roelands, "An overlap-add technique based
on waveform similarity (WSOLA) for high quality time-scale modification of speech", ICASSP 1993).
No piece is moved by more than `REACH`, and every one is placed by the clock, so nothing drifts. The
onset of a sound is copied to where it belongs, once, as it is: pieces near it do not move, others
end before it or begin after it. FFmpeg's atempo puts sounds up to 75 ms early at a speed of 0.4.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

PIECE = 0.032  # length of a piece [s]
REACH = 0.008  # that it may be moved [s]: half a wave of 60 Hz
_COARSE = 4  # samples: the step of the first search
_BLOCK = 0.002  # in which the loudness is taken [s]
_BEFORE = 10  # blocks: what an onset is louder than
_LOUDER = 4.0  # times as much power
_QUIET = 1e-7  # power that is no sound
_APART = 0.06  # between onsets [s]
_GUARD = 0.003  # round an onset, that no other piece enters [s]
_NEAR = 1.25  # half pieces from an onset, within which pieces are copied


class TimeStretch:
    """Streams sound through WSOLA: (channels, samples) float32 in and out.

    `speed` 0.5 makes it twice as long. All output together has samples / speed samples.
    """

    def __init__(self, rate: int, channels: int, speed: Fraction):
        self._hop = round(PIECE * rate / 2)
        self._reach, self._guard = round(REACH * rate), round(_GUARD * rate)
        self._speed = float(speed)
        whole = 2 * self._hop
        self._window = np.hanning(whole + 1)[:whole].astype(np.float32)  # two add up to 1
        lead = self._hop + self._reach  # silence before the first sample
        self._input = np.zeros((channels, lead), np.float32)
        self._start = -lead  # index of the first sample of _input
        self._tail = np.zeros((channels, self._hop), np.float32)
        self._pieces, self._received, self._taken = 0, 0, 0
        self._before: int | None = None  # where the piece before began
        self._ahead = round(max(2.0, 1 + _NEAR * self._speed) * self._hop) + self._reach
        self._onsets = Onsets(rate)

    def add(self, samples: np.ndarray) -> np.ndarray:
        """Take in samples; return those that are ready."""
        self._received += samples.shape[1]
        return self._go_on(samples, final=False)

    def rest(self) -> np.ndarray:
        """Return the remaining samples; nothing can be added then."""
        silence = self._ahead + 2 * self._hop + int(self._hop * self._speed)
        return self._go_on(np.zeros((len(self._input), silence), np.float32), final=True)

    def _go_on(self, samples: np.ndarray, final: bool) -> np.ndarray:
        self._input = np.concatenate([self._input, samples.astype(np.float32)], 1)
        self._onsets.add(samples.mean(0))
        end = self._start + self._input.shape[1]
        made = [self._input[:, :0]]
        while round(self._pieces * self._hop * self._speed) + self._ahead <= end:
            made.append(self._piece())
        self._forget()
        return self._cut(np.concatenate(made, 1), final)

    def _piece(self) -> np.ndarray:
        """Half a piece of output: the end of the piece before and the beginning of this one."""
        begin = self._place()
        at = begin - self._start
        piece = self._input[:, at : at + 2 * self._hop] * self._window
        ready = self._tail + piece[:, : self._hop]
        self._tail = piece[:, self._hop :]
        self._before = begin
        self._pieces += 1
        return ready

    def _place(self) -> int:
        """Position in the input at which the next piece begins."""
        out = self._pieces * self._hop
        centre = round(out * self._speed)
        least, most = centre - self._reach, centre + self._reach
        for onset in self._onsets.samples:
            away = out - onset / self._speed
            if abs(away) <= _NEAR * self._hop:
                return max(round(onset + away) - self._hop, self._start)
            if away < 0:
                most = min(most, onset - self._hop - self._guard)
            else:
                least = max(least, onset + self._hop + self._guard)
        most = max(most, centre - 2 * self._hop)  # not far, where onsets crowd
        least = min(least, centre + 2 * self._hop, most)
        if self._before is None:
            return min(max(centre, least), most) - self._hop
        return self._likest(least - self._hop, most - self._hop, self._before + self._hop)

    def _likest(self, least: int, most: int, natural: int) -> int:
        """The place from `least` to `most` that is most like the natural continuation."""
        least = max(least, self._start)
        want, area = (
            self._input[:, a - self._start : b - self._start].mean(0)
            for a, b in (
                (natural, natural + 2 * self._hop),
                (least, max(most, least) + 2 * self._hop),
            )
        )
        rough = _best(area[::_COARSE], want[::_COARSE]) * _COARSE
        low = max(rough - _COARSE, 0)
        high = min(rough + _COARSE, max(most - least, 0))
        return least + low + _best(area[low : high + len(want)], want)

    def _forget(self) -> None:
        """Drop the input that no further piece can reach."""
        centre = round(self._pieces * self._hop * self._speed)
        first = centre - 3 * self._hop - self._reach
        if self._before is not None:
            first = min(first, self._before + self._hop)
        drop = max(first - self._start, 0)
        self._input, self._start = self._input[:, drop:], self._start + drop
        self._onsets.forget(first - self._hop)

    def _cut(self, samples: np.ndarray, final: bool) -> np.ndarray:
        """Without the half piece before the beginning, and the samples after the end."""
        begin = min(max(self._hop - self._taken, 0), samples.shape[1])
        end = samples.shape[1]
        if final:
            end = min(end, self._hop + round(self._received / self._speed) - self._taken)
        self._taken += samples.shape[1]
        return samples[:, begin : max(end, begin)]


class Onsets:
    """Finds the onsets of sounds: a few milliseconds louder than those before."""

    def __init__(self, rate: int):
        self.samples: list[int] = []
        """Indices of the samples at which they begin."""
        self._block = round(_BLOCK * rate)
        self._apart = round(_APART * rate)
        self._left = np.zeros(0, np.float32)
        self._at = 0  # index of the first sample of _left
        self._power = np.zeros(_BEFORE)
        self._last = np.float32(0)
        self._loud = 0.0  # of the last onset

    def add(self, mono: np.ndarray) -> None:
        """Take in samples."""
        steep = np.diff(np.concatenate([[self._last], mono])).astype(np.float32)
        self._last = mono[-1] if len(mono) else self._last
        self._left = np.concatenate([self._left, steep])
        count = len(self._left) // self._block
        blocks = self._left[: count * self._block].reshape(count, self._block)
        power = np.concatenate([self._power, (blocks**2).mean(1)])
        before = np.convolve(power, np.full(_BEFORE, 1 / _BEFORE), "valid")[:-1]
        for n in np.flatnonzero(power[_BEFORE:] > _LOUDER * before + _QUIET):
            index = self._at + int(n) * self._block
            loud = float(power[_BEFORE + n])
            near = bool(self.samples) and index - self.samples[-1] < self._apart
            if near and loud <= _LOUDER * self._loud:
                continue
            if near:  # that was nothing beside this one
                self.samples.pop()
            self.samples.append(index)
            self._loud = loud
        self._power = power[-_BEFORE:]
        self._left = self._left[count * self._block :]
        self._at += count * self._block

    def forget(self, before: int) -> None:
        """Drop onsets before a sample, except the last."""
        while len(self.samples) > 1 and self.samples[0] < before:
            self.samples.pop(0)


def _best(area: np.ndarray, want: np.ndarray) -> int:
    """Position in `area` whose samples are most like `want`; the middle if all are alike."""
    likeness = np.correlate(area, want, "valid")
    sums = np.cumsum(np.concatenate([[0.0], area.astype(np.float64) ** 2]))
    power = sums[len(want) :] - sums[: -len(want)]
    score = likeness / np.sqrt(np.maximum(power, 1e-9))
    best, middle = int(score.argmax()), len(score) // 2
    return middle if score[best] <= score[middle] + 1e-6 else best
