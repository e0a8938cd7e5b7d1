"""The process that blurs: a request a line on its input, an answer a line on its output.

A request is an object whose `do` names a method of `Desk`, with its words; the answer has
`result`, or `error` and the sentence for the user, or `fault` and a traceback.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import traceback
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from .problem import NoAdapterError, ProblemError, plain
from .recipe import Recipe, Setup, picture_told, recipe_of, setup_of

if TYPE_CHECKING:
    from wgmb import Blur

    from .blurring import Blurring


class Desk:
    """The requests that the process answers, and all that stays open between two of them."""

    def __init__(self) -> None:
        self._setup: Setup | None = None
        self._blur: Blur | None = None
        self._blurring: Blurring | None = None

    def adapters(self) -> list[str]:
        """The GPUs, by name."""
        from wgmb import gpu

        return [one.summary for one in gpu.adapters()]

    def frames(self, text: str) -> list[int]:
        """The numbers that 1-100 or 3,7 stands for."""
        from wgmb.io.frame_numbers import frame_numbers

        return list(frame_numbers(text))

    def open(self, setup: dict[str, Any]) -> dict[str, bool]:
        """Open the GPU, and tell whether it is the CPU."""
        device: Any = self._opened(setup_of(setup)).device
        return {"is_cpu": device.adapter_info["adapter_type"] == "CPU"}

    def blur(self, number: int, setup: dict[str, Any], recipe: dict[str, Any]) -> dict[str, Any]:
        """Blur a frame of a recipe."""
        from wgmb import DeviceError

        try:
            return self._of(recipe_of(recipe), setup_of(setup)).one(number)
        except DeviceError:  # a lost one: the next frame opens it anew
            self.rest()
            raise

    def preview(
        self, number: int, setup: dict[str, Any], recipe: dict[str, Any], path: str
    ) -> None:
        """Blur the picture of a frame into a numpy file."""
        from pathlib import Path

        self._of(recipe_of(recipe), setup_of(setup)).preview(number, Path(path))

    def layers(self, **words: Any) -> None:
        """Write a multilayer file."""
        from .layers import write_layers

        left_out = {(layer, name) for layer, name in words.pop("left_out")}
        write_layers(left_out=left_out, **words)

    def both(self, picture: dict[str, Any], **words: Any) -> None:
        """Write a sharp frame beside its blurred one."""
        from .layers import both_halves

        both_halves(picture=picture_told(picture), **words)

    def rest(self) -> None:
        """Give back the GPU and the memory; files may change before the next request."""
        self._setup = self._blur = self._blurring = None

    def _opened(self, setup: Setup) -> Blur:
        from .blurring import open_blur, shutter_of

        if self._blur is None or self._setup is None:
            self._blur, self._setup = open_blur(setup), setup
        elif replace(self._setup, exposure=setup.exposure) == setup:  # all is compiled
            if self._setup != setup:
                self._blur.shutter, self._setup = shutter_of(setup.exposure), setup
        else:
            self.rest()
            self._blur, self._setup = open_blur(setup), setup
        return self._blur

    def _of(self, recipe: Recipe, setup: Setup) -> Blurring:
        from .blurring import Blurring

        blur = self._opened(setup)
        if self._blurring is None or self._blurring.recipe != recipe:
            self._blurring = Blurring(recipe, blur)
        return self._blurring


def answer(desk: Desk, request: dict[str, Any]) -> dict[str, Any]:
    """Do what is asked for."""
    try:
        return {"result": getattr(desk, request.pop("do"))(**request)}
    except NoAdapterError as error:
        return {"error": "adapter", "text": plain(error)}
    except ImportError as error:
        text = f"wgmb cannot be loaded ({plain(error)}): install the add-on's bundle again"
        return {"error": "problem", "text": text}
    except Exception as error:
        if _is_expected(error):
            return {"error": "problem", "text": plain(error)}
        return {"fault": traceback.format_exc()}


def _is_expected(error: Exception) -> bool:
    """Return True for what is told in a sentence; all else is a fault of ours."""
    wgmb = sys.modules.get("wgmb")
    own = () if wgmb is None else (wgmb.Error,)
    return isinstance(error, (*own, ProblemError, OSError, MemoryError))


def serve() -> None:
    """Answer until there is no more to be asked: Blender has closed its end, or is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Blender hears it, and ends this process
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # what a library prints is no answer
        desk = Desk()
        with contextlib.suppress(BrokenPipeError):
            for line in sys.stdin.buffer:
                out.write(json.dumps(answer(desk, json.loads(line))).encode() + b"\n")
                out.flush()
