"""Record the passes of a method as JSON, for docs/page/replay.js to run in a browser.

    python tools/page/page_recording.py > recordings.json

A built-in scene is rendered and blurred once with every choice of the page, on a device with
what WebGPU guarantees and no feature; every dispatch is written down with its kernel, its
resources and its size. The page repeats them, so it cannot drift from Python. What the shutter's
degrees change is the contents of the buffers of group 0 alone, which is checked here; the page
fills those itself.
"""

from __future__ import annotations

import base64
import json
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest import mock

import numpy as np
import wgpu

from wgmb import (
    Blur,
    Render,
    Shutter,
    gpu,
)
from wgmb.gpu import kernels, wgsl
from wgmb.gpu.bind_groups import forget_constants
from wgmb.scene import make

SCENE, TIME, SIZE, RAYS = "crossing", 0.25, (640, 360), 2
METHODS = ("tap", "tiles", "gather")
OPTIONS = {"gather": {"shading": "off"}}
"""Moving light has times of its own in many buffers, which the page does not write."""
SAMPLES = (4, 8, 16, 32)
CURVES = ("box", "cosine")
"""The box has kernels of its own; all other curves share those of the cosine."""
OUTPUT = "rgba16float"


def _untaped(_tapes, encoder, _bindings, _key, _views, record):
    """Record a frame's passes without a tape, whose commands call no method of wgpu."""
    record(encoder)
    return encoder


class Recorder:
    """Everything created and dispatched while it is `listening`; resources have numbers.

    `before`: an earlier recorder whose textures and buffers may be used; they are named there.
    """

    def __init__(self, before: Recorder | None = None):
        self.passes: list[dict[str, Any]] = []
        self.buffers: list[dict[str, Any]] = []
        self.textures: list[dict[str, Any]] = []
        self._before = before
        self._numbers: dict[int, int] = {}
        self._views: dict[int, dict[str, Any]] = {}
        self._contents: dict[int, bytes] = {}
        self._held: list[object] = []  # so that no id comes twice

    @contextmanager
    def listening(self, device: wgpu.GPUDevice) -> Iterator[None]:
        """Notice buffers, views, uploads, cleared buffers, copies and kernels of `device`."""
        forget_constants()  # so that those that are kept are made, and noticed, again
        usage = wgpu.TextureUsage.TEXTURE_BINDING
        probe = device.create_texture(size=(1, 1, 1), format=OUTPUT, usage=usage)
        encoder = type(device.create_command_encoder())
        with ExitStack() as stack:
            for owner, name, note in (
                (type(device), "create_buffer_with_data", self._noted_data),
                (type(probe), "create_view", self._noted_view),
                (type(device.queue), "write_texture", self._noted_upload),
                (encoder, "clear_buffer", self._noted_clear),
                (encoder, "copy_texture_to_texture", self._noted_copy),
                (kernels.Pass, "record", self._noted_pass),
            ):
                stack.enter_context(_watched(owner, name, note))
            stack.enter_context(mock.patch.object(gpu.Tapes, "play", _untaped))
            yield

    def _noted_data(self, made, device, **given) -> None:
        self._contents[id(made)] = np.asarray(given["data"]).tobytes()
        self._held.append(made)

    def _noted_view(self, made, texture, **given) -> None:
        self._views[id(made)] = {
            "dimension": given.get("dimension") or "2d",
            "first": given.get("base_array_layer") or 0,
            "count": given.get("array_layer_count"),
        }
        self._held.append(made)

    def _noted_upload(self, made, queue, destination, data, layout, size) -> None:
        texture = destination["texture"]
        assert tuple(size) == texture.size, "one upload fills the texture"
        self._contents[id(texture)] = np.asarray(data).tobytes()
        self._held.append(texture)

    def _noted_clear(self, made, encoder, buffer, offset=0, size=None) -> None:
        self.passes.append({"clear": self._buffer(buffer), "offset": offset, "size": size})

    def _noted_copy(self, made, encoder, source, destination, size) -> None:
        ends = [{"texture": self.texture(e["texture"]), "origin": list(e["origin"])}
                for e in (source, destination)]  # fmt: skip
        self.passes.append({"copy": ends, "size": list(size)})

    def _noted_pass(self, made, one: kernels.Pass, encoder) -> None:
        row: dict[str, Any] = {
            "kernel": _kernel(one.kernel),
            "entry": one.entry,
            "resources": {
                name: self._resource(one.resources[name]) for name in one.kernel.bindings
            },
        }
        if isinstance(one.workgroups, tuple):
            row["workgroups"] = list(one.workgroups)
        else:
            buffer, offset = (one.workgroups[name] for name in ("buffer", "offset"))
            row["indirect"] = {"buffer": self._buffer(buffer), "offset": offset}
        self.passes.append(row)

    def _resource(self, resource) -> dict[str, Any]:
        if isinstance(resource, wgpu.GPUBuffer):
            return {"buffer": self._buffer(resource), "offset": 0, "size": resource.size}
        if isinstance(resource, dict):
            return resource | {"buffer": self._buffer(resource["buffer"])}
        if isinstance(resource, wgpu.GPUSampler):
            return {"sampler": "linear"}
        view = self._views.get(id(resource))
        if view is None and self._before is not None:
            view = self._before._views[id(resource)]
        assert view is not None, "the view was made before anybody listened"
        return {"texture": self.texture(resource.texture), **view}

    def texture(self, texture: wgpu.GPUTexture) -> int | str:
        """The number of a texture; of one of the earlier recorder "once NUMBER"."""
        return self._numbered(texture, self.textures, lambda: {
            "size": list(texture.size), "format": texture.format,
        })  # fmt: skip

    def _buffer(self, buffer: wgpu.GPUBuffer) -> int | str:
        return self._numbered(buffer, self.buffers, lambda: {"size": buffer.size})

    def _numbered(self, resource, table: list[dict[str, Any]], described) -> int | str:
        if self._before is not None and id(resource) in self._before._numbers:
            return f"once {self._before._numbers[id(resource)]}"
        if id(resource) not in self._numbers:
            self._numbers[id(resource)] = len(table)
            self._held.append(resource)
            data = self._contents.get(id(resource))
            text = None if data is None else base64.b64encode(data).decode()
            table.append({"label": resource.label, **described(), "data": text})
        return self._numbers[id(resource)]

    def recording(self) -> dict[str, Any]:
        """The recording as replay.js takes it."""
        return {"passes": self.passes, "buffers": self.buffers, "textures": self.textures}


@contextmanager
def _watched(owner: type, name: str, note) -> Iterator[None]:
    """Call `note` with the result and the arguments of every call of a method."""
    call = getattr(owner, name)

    def watched(self, *given, **more):
        made = call(self, *given, **more)
        note(made, self, *given, **more)
        return made

    setattr(owner, name, watched)
    try:
        yield
    finally:
        setattr(owner, name, call)


def _kernel(kernel: kernels.Kernel) -> dict[str, Any]:
    """The shader's file, the texel formats that differ from the file's, and its constants."""
    plain = wgsl.load(kernel.source.name)
    aliases = wgsl.texel_aliases(plain.text)
    texels = wgsl.texel_aliases(kernel.source.text)
    return {
        "file": kernel.source.name,
        "texels": {name: texels[name] for name in aliases if texels[name] != aliases[name]},
        "constants": {name: float(value) for name, value in kernel.constants.items()},
    }


class Session:
    """The scene, rendered once, and the choices that are blurred from it."""

    def __init__(self, device: wgpu.GPUDevice):
        self.device, self.once = device, Recorder()
        with self.once.listening(device):
            blur = Blur("gather", device=device, output=OUTPUT, **OPTIONS["gather"])
            self.render = Render(make(SCENE), blur, size=SIZE, antialias=RAYS)
            for offset in (0, -1, 1):
                self.render._see(TIME, 0, offset, blur)
            self.input = self.once.texture(self.render._pictures[0]["color"])

    def record(
        self, method: str, curve: str, samples: int, degrees: float = 180.0
    ) -> tuple[dict[str, Any], np.ndarray]:
        """The recording of one choice, and the picture that it makes."""
        recorder, shutter = Recorder(self.once), Shutter(degrees, curve=curve)
        images = self.render._images
        with recorder.listening(self.device):
            given = {"samples": samples, "device": self.device, "output": OUTPUT}
            blur = Blur(method, shutter=shutter, **given, **OPTIONS.get(method, {}))
            output = images.texture("page", SIZE, OUTPUT)
            self.render.draw(output.create_view(), TIME, blur=blur)
        picture = images.download(self.device.create_command_encoder(), output)
        return recorder.recording() | {"output": recorder.texture(output)}, picture


def group_zero(recording: dict[str, Any]) -> dict[str, int]:
    """The buffers of group 0, which the page fills, by the names of their bindings."""
    found: dict[str, int] = {}
    for row in recording["passes"]:
        if "kernel" in row:
            for binding in wgsl.load(row["kernel"]["file"]).bindings():
                if binding.group == 0:
                    number = row["resources"][binding.name]["buffer"]
                    assert found.setdefault(binding.name, number) == number
    return found


def differences(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """Differences of two recordings, without the contents of the buffers of group 0."""
    filled = group_zero(one).values()
    found = [name for name in one if name != "buffers" and one[name] != other[name]]
    for i, (a, b) in enumerate(zip(one["buffers"], other["buffers"], strict=True)):
        if a != b and not (i in filled and a["size"] == b["size"]):
            found.append(f"buffer {a['label']}")
    return found


def plain_device() -> wgpu.GPUDevice:
    """A device with what WebGPU guarantees, and no feature."""
    return gpu.choose_adapter().request_device_sync(label="page")


def recordings() -> dict[str, Any]:
    """The scene under "once", and every choice of the page as "METHOD CURVE SAMPLES"."""
    session, choices = Session(plain_device()), {}
    for method in METHODS:
        for curve in CURVES:
            for samples in SAMPLES:
                one, _ = session.record(method, curve, samples)
                other, _ = session.record(method, curve, samples, degrees=77.0)
                if found := differences(one, other):
                    raise RuntimeError(f"{method}, {curve}: degrees change {', '.join(found)}")
                choices[f"{method} {curve} {samples}"] = one | {"groupZero": group_zero(one)}
    once = session.once.recording() | {"input": session.input}
    return {
        "size": list(SIZE),
        "scene": SCENE,
        "time": TIME,
        "antialias": RAYS,
        "once": once,
        "choices": choices,
    }


if __name__ == "__main__":
    json.dump(recordings(), sys.stdout, separators=(",", ":"), sort_keys=True)
