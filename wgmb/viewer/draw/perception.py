"""Perceived image of the last frames: each drawn once, held for its duration, weighted.

Nothing depends on earlier pictures: the frames are those that a display would have
shown up to the moment, all as they are set now. Frames and windows are centred alike: frame N
is there from half an interval before its instant to half an interval after it.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...cone import MOST_HELD, Cone
from ...gpu.timing import Clock
from ...gpu_frame.weighted_sum import WeightedSum
from ...pipeline.blur import Blur
from ..state.state import State
from ..state.video_time import held_for
from ..subjects.subject import Subject


@dataclass
class _Held:
    """One frame, and how many of its samples are in it."""

    texture: wgpu.GPUTexture
    known: tuple[Any, ...] = ()
    """The finding about a video's motion at that time."""
    done: int = 0


def seen_frames(state: State) -> list[State]:
    """The state at each frame that counts in the perceived picture, the newest first."""
    newest = math.floor(state.moment + 0.5)
    if not state.is_video:
        count = state.eye.frames_needed(state.fps) if state.eye else 1
        return [replace(state, frame=float(n)) for n in range(newest, newest - count, -1)]
    found, passed, memory = [], 0.0, state.eye.memory if state.eye else 0.0
    newest = min(newest, state.span[1])
    while newest >= len(found) and passed <= memory + 2 * held_for(state, newest - len(found)):
        found.append(replace(state, frame=float(newest - len(found))))
        passed += held_for(state, int(found[-1].frame))
        if len(found) == MOST_HELD:
            break
    return found


class Perceived:
    """The last frames on the GPU, by number; those that are still good are not drawn again."""

    def __init__(self, device: wgpu.GPUDevice):
        self._device, self._sum = device, WeightedSum(device)
        self._frames: dict[int, _Held] = {}
        self._alike: tuple[Any, ...] = ()
        self._token = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC)

    def draw(
        self,
        output: wgpu.GPUTexture,
        state: State,
        eye: Cone,
        subject: Subject,
        view: str | None,
        blur: Blur,
        antialias: int,
        seconds: float,
        timing: Clock | None,
        known: list[tuple[Any, ...]],
    ) -> int:
        """Draw frames that are missing, the newest first, for about `seconds`; how many are done.

        `output`, rgba32float, is the perceived picture; the oldest frame stands for those before
        it. `known`: of a video, the known motion of each of `seen_frames`.
        """
        width, height, _ = output.size
        alike = (replace(state.picture, frame=0.0), view, (width, height), antialias, blur)
        if alike != self._alike:
            self._frames, self._alike = {}, alike
        seen = seen_frames(state)
        numbers = [int(one.frame) for one in seen]
        newest = numbers[0]
        stamps = dict(zip(numbers, known or [()] * len(seen), strict=True))
        spare = [self._frames.pop(n).texture for n in [*self._frames] if n not in numbers]
        end = time.perf_counter() + seconds
        for number in numbers:
            held = self._frames.get(number)
            if held is None:
                held = _Held(spare.pop() if spare else self._texture(blur, width, height))
                self._frames[number] = held
            if held.known != stamps[number]:
                held.known, held.done = stamps[number], 0
            if held.done == blur.samples:
                continue
            self._forget_unfinished(held, blur)
            left = end - time.perf_counter()
            if left <= 0 and number != newest:
                break
            subject.look_at(replace(state, frame=float(number)), (width, height), antialias, view)
            held.done = subject.draw(blur, held.texture, (held.done, max(left, 0)), timing)
            self._device.queue.read_buffer(self._token)  # waits
            if held.done < blur.samples:
                break
        subject.look_at(state, (width, height), antialias, view)
        drawn = {n: held.texture for n in numbers if (held := self._frames.get(n)) and held.done}
        weights = dict.fromkeys(drawn, 0.0)
        for number, weight in zip(numbers, _shares(state, eye, numbers), strict=True):
            # A frame that is missing: the one before it is held for longer.
            weights[next((n for n in drawn if n <= number), min(drawn))] += weight
        encoder = self._device.create_command_encoder(label="perceive")
        self._sum.encode(encoder, [*drawn.values()], np.array([*weights.values()]), output)
        gpu.submit(self._device, encoder)
        return sum(self._frames[n].done == blur.samples for n in drawn)

    def forget(self) -> None:
        """Let go of all frames."""
        self._frames = {}

    def _texture(self, blur: Blur, width: int, height: int) -> wgpu.GPUTexture:
        usage = (
            wgpu.TextureUsage.STORAGE_BINDING
            | wgpu.TextureUsage.TEXTURE_BINDING
            | wgpu.TextureUsage.COPY_DST
        )
        return self._device.create_texture(
            label="held", size=(width, height, 1), format=blur.output, usage=usage
        )

    def _forget_unfinished(self, but: _Held, blur: Blur) -> None:
        """The method keeps the sums of one frame only."""
        for held in self._frames.values():
            if held is not but and held.done != blur.samples:
                held.done = 0


def _shares(state: State, eye: Cone, numbers: list[int]) -> np.ndarray:
    """The weights of frames, the newest first."""
    after = state.moment - numbers[0]
    if not (state.is_video and state.own_times):
        return eye.shares(len(numbers), state.fps, after / state.fps)
    held = np.array([held_for(state, number) for number in numbers])
    return eye.shares_held(held, after * held[0])
