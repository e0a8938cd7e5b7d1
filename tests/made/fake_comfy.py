"""A stand-in for ComfyUI without torch: as much as the pack in comfyui/ uses of it."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from fractions import Fraction
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np


class Tensor(np.ndarray):
    """An array with the names that torch has for these things."""

    def cpu(self) -> Tensor:
        return self

    def numpy(self) -> np.ndarray:
        return self.view(np.ndarray)

    def new_empty(self, shape: tuple[int, ...], device: str = "cpu") -> Tensor:
        return np.empty(shape, self.dtype).view(Tensor)


def tensor(array: Any) -> Tensor:
    """As torch.from_numpy."""
    return np.asarray(array).view(Tensor)


class Port:
    """An input or output, with all that was said of it."""

    def __init__(self, io_type: str, id: str = "", display_name: str = "", **said: Any):
        self.io_type, self.id, self.display_name, self.said = io_type, id, display_name, said


def kind(io_type: str) -> Any:
    """As io.Image and others: makers of inputs and outputs."""
    return SimpleNamespace(
        Input=lambda id, **said: Port(io_type, id, **said),
        Output=lambda id="", **said: Port(io_type, id, **said),
    )


@dataclass
class Schema:
    """As io.Schema."""

    node_id: str
    display_name: str
    category: str
    description: str
    inputs: list[Port]
    outputs: list[Port]


class NodeOutput(tuple):
    """As io.NodeOutput."""

    def __new__(cls, *values: Any):
        return super().__new__(cls, values)


@dataclass
class VideoComponents:
    """As Types.VideoComponents."""

    images: Any
    frame_rate: Fraction
    audio: Any = None
    metadata: dict[str, str] | None = None


@dataclass
class VideoFromComponents:
    """As InputImpl.VideoFromComponents."""

    components: VideoComponents

    def get_components(self) -> VideoComponents:
        return self.components


@dataclass
class VideoFromFile:
    """As InputImpl.VideoFromFile. `trim`: begin and duration, 0 for all."""

    source: Any
    trim: tuple[float, float] = (0.0, 0.0)

    def get_stream_source(self) -> Any:
        return self.source

    def get_active_trim_window(self) -> tuple[float, float]:
        return self.trim

    def get_duration(self) -> float:
        return 0.5


@dataclass
class Server:
    """The state of the stand-in: a stop, and the bars that were drawn."""

    stops_after: float = float("inf")
    """Looks at the stop until there is one."""
    looks: int = 0
    bars: list[Any] = field(default_factory=list)


class InterruptError(Exception):
    """As comfy's own, which is no error of a node."""


def install(monkeypatch: Any, temporary: str) -> Server:
    """Put the modules where they are imported from; returns their state."""
    server = Server()

    def check() -> None:
        server.looks += 1
        if server.looks > server.stops_after:
            raise InterruptError

    class ProgressBar:
        def __init__(self, total: int):
            self.total, self.done = total, 0
            server.bars.append(self)

        def update(self, count: int) -> None:
            self.done += count

    io = SimpleNamespace(
        ComfyNode=object, Schema=Schema, NodeOutput=NodeOutput,
        **{name: kind(name.upper()) for name in ("Image", "Float", "Combo", "Mask", "Video")},
    )  # fmt: skip
    modules = {
        "comfy": {},
        "comfy.model_management": {"throw_exception_if_processing_interrupted": check},
        "comfy.utils": {"ProgressBar": ProgressBar},
        "comfy_api": {},
        "comfy_api.latest": {
            "io": io,
            "ComfyExtension": object,
            "InputImpl": SimpleNamespace(
                VideoFromFile=VideoFromFile, VideoFromComponents=VideoFromComponents
            ),
        },
        "folder_paths": {"get_temp_directory": lambda: temporary},
    }
    for name, contents in modules.items():
        module = ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
    return server
