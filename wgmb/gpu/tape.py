"""A frame's commands, recorded once and played again in a tenth of the time.

wgpu's Python checks and converts each call, 5 to 40 us of them. A tape keeps the handles that its C
functions take, and calls these. Wrong handles are reported as before, when the encoder is finished.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Collection, Mapping
from typing import Any

import wgpu
from wgpu.backends.wgpu_native import _api

from .kernels import FrameBindings, Pass, Recorder
from .textures import Word

lib: Any = _api.lib
ffi: Any = _api.ffi
_MOST = 32  # tapes that are kept: as many as a ring of pictures has turns
_LABEL = ffi.new("char[]", b"wgmb")
_PASS = ffi.new("WGPUComputePassDescriptor *", {"label": {"data": _LABEL, "length": 4}})
_Call = tuple[Any, tuple[Any, ...]]


class Tape(Recorder):
    """Takes the place of a command encoder while passes are recorded.

    Passes between two clears or copies become one compute pass of wgpu, in which the dispatches
    still wait for each other; clears and copies of what no pass before them uses come first.
    It holds all resources but the views, which the owner of the tape watches. Group 0 of `bindings`
    is bound anew in each `play`.
    """

    def __init__(self, bindings: FrameBindings):
        self._bindings = bindings
        self._first: list[_Call] = []
        self._steps: list[list[_Call] | _Call] = []
        self._frame_groups: list[
            tuple[wgpu.GPUDevice, wgpu.GPUBindGroupLayout, dict[str, int]]
        ] = []
        self._slots: dict[int, int] = {}  # of a layout's uid in the list above
        self._held: list[object] = []
        self._read: set[int] = set()  # uids of buffers and textures that passes use
        self._written: set[int] = set()
        self._open: list[_Call] | None = None
        self._bound: dict[int, object] = {}
        self._pipeline: object = None
        self.finds: tuple[Word, ...] = ()
        """Words of the method whose passes these are; see Method."""
        self.dispatches = 0

    @property
    def passes(self) -> int:
        """Compute passes that it records."""
        return sum(isinstance(step, list) for step in self._steps)

    def add(self, one: Pass) -> None:
        """Record a dispatch."""
        calls = self._calls()
        pipeline = one.kernel.pipeline(one.entry)
        if pipeline is not self._pipeline:
            calls.append((lib.wgpuComputePassEncoderSetPipeline, (pipeline._internal,)))
            self._pipeline = pipeline
        for index, group in enumerate(one.groups):
            self._bind(calls, one, index, group)
        where = one.workgroups
        if isinstance(where, tuple):
            calls.append((lib.wgpuComputePassEncoderDispatchWorkgroups, (*where, 1)))
        else:
            buffer = where["buffer"]
            calls.append(
                (
                    lib.wgpuComputePassEncoderDispatchWorkgroupsIndirect,
                    (buffer._internal, where["offset"]),
                )
            )
            self._read.add(buffer.uid)
            self._held.append(buffer)
        self._held.append((pipeline, one.groups))
        self._note(one)
        self.dispatches += 1

    def _calls(self) -> list[_Call]:
        """The calls of the compute pass that is recorded."""
        if self._open is None:
            self._open = []
            self._steps.append(self._open)
            self._bound, self._pipeline = {}, None
        return self._open

    def _bind(self, calls: list[_Call], one: Pass, index: int, group: wgpu.GPUBindGroup) -> None:
        """Bind a group, unless it is bound; of the frame's own, its place in the list."""
        own = self._bindings.resources
        names = one.kernel.places[index]
        if index == 0 and names and all(one.resources[n] is own.get(n) for n in names):
            layout = one.kernel.layouts[0]
            if layout.uid not in self._slots:
                self._slots[layout.uid] = len(self._frame_groups)
                self._frame_groups.append((one.kernel.device, layout, names))
            slot = self._slots[layout.uid]
            if self._bound.get(0) != slot:
                calls.append((None, (slot,)))
                self._bound[0] = slot
        elif self._bound.get(index) is not group:
            call = lib.wgpuComputePassEncoderSetBindGroup
            calls.append((call, (index, group._internal, 0, ffi.NULL)))
            self._bound[index] = group

    def _note(self, one: Pass) -> None:
        """Note what a pass reads and writes."""
        for name, resource in one.resources.items():
            thing = resource["buffer"] if isinstance(resource, Mapping) else resource
            if isinstance(thing, wgpu.GPUSampler):
                continue
            uid = thing.texture.uid if isinstance(thing, wgpu.GPUTextureView) else thing.uid
            self._read.add(uid)
            binding = one.kernel.bindings.get(name)
            if binding is not None and ("write" in binding.space or "write" in binding.type):
                self._written.add(uid)

    def clear_buffer(
        self, buffer: wgpu.GPUBuffer, offset: int = 0, size: int | None = None
    ) -> None:
        """As that of an encoder."""
        size = buffer.size - offset if size is None else size
        call = lib.wgpuCommandEncoderClearBuffer, (buffer._internal, offset, size)
        self._put(call, set(), buffer.uid)
        self._held.append(buffer)

    def copy_texture_to_texture(
        self, source: Mapping[str, Any], destination: Mapping[str, Any], size: tuple[int, ...]
    ) -> None:
        """As that of an encoder."""
        places = [ffi.new("WGPUTexelCopyTextureInfo *") for _ in range(2)]
        for place, end in zip(places, (source, destination), strict=True):
            place.texture = end["texture"]._internal
            origin = (*end.get("origin", ()), 0, 0, 0)[:3]
            place.origin.x, place.origin.y, place.origin.z = origin
            place.aspect = lib.WGPUTextureAspect_All
        extent = ffi.new("WGPUExtent3D *")
        extent.width, extent.height, extent.depthOrArrayLayers = (*size, 1)[:3]
        call = lib.wgpuCommandEncoderCopyTextureToTexture, (*places, extent)
        self._put(call, {source["texture"].uid}, destination["texture"].uid)
        self._held.append((source["texture"], destination["texture"]))

    def _put(self, call: _Call, read: set[int], written: int) -> None:
        """Put a clear or a copy first if nothing before it differs by that, else last."""
        if written in self._read | self._written or read & self._written:
            self._steps.append(call)
            self._open = None
        else:
            self._first.append(call)
        self._read |= read | {written}
        self._written.add(written)

    def play(self, encoder: wgpu.GPUCommandEncoder, bindings: FrameBindings | None = None) -> None:
        """Record all of it into an encoder, with the group 0 of `bindings`, by default its own."""
        bindings = bindings or self._bindings
        groups = [bindings.group(*of_layout) for of_layout in self._frame_groups]
        handles, into, null = [group._internal for group in groups], encoder._internal, ffi.NULL
        for call, arguments in self._first:
            call(into, *arguments)
        for step in self._steps:
            if isinstance(step, tuple):
                step[0](into, *step[1])
                continue
            compute = lib.wgpuCommandEncoderBeginComputePass(into, _PASS)
            for call, arguments in step:
                if call is None:
                    lib.wgpuComputePassEncoderSetBindGroup(
                        compute, 0, handles[arguments[0]], 0, null
                    )
                else:
                    call(compute, *arguments)
            lib.wgpuComputePassEncoderEnd(compute)
            lib.wgpuComputePassEncoderRelease(compute)


class Tapes:
    """Tapes by what their commands depend on.

    One ends when a view of its key goes, when frames have another size, or as the oldest of many.
    """

    def __init__(self) -> None:
        self._tapes: dict[object, Tape] = {}
        self._watched: dict[object, list[weakref.ref[wgpu.GPUTextureView]]] = {}
        self._size: object = None

    def __len__(self) -> int:
        return len(self._tapes)

    def play(
        self,
        encoder: wgpu.GPUCommandEncoder,
        bindings: FrameBindings,
        key: object,
        views: Collection[wgpu.GPUTextureView],
        record: Callable[[Tape], None],
    ) -> Tape:
        """Play the tape of a `key` and of `views`, which is made by `record` if there is none."""
        if bindings.size != self._size:
            self.clear()
            self._size = bindings.size
        key = key, *(view.uid for view in views)
        tape = self._tapes.pop(key, None)
        if tape is None:
            tape = Tape(bindings)
            record(tape)
            self._watch(key, views)
        self._tapes[key] = tape  # the last one
        if len(self._tapes) > _MOST:
            self._end(next(iter(self._tapes)))
        tape.play(encoder, bindings)
        return tape

    def clear(self) -> None:
        """End all tapes."""
        self._tapes.clear()
        self._watched.clear()

    def _watch(self, key: object, views: Collection[wgpu.GPUTextureView]) -> None:
        me = weakref.ref(self)

        def gone(_ref: weakref.ref[wgpu.GPUTextureView]) -> None:
            tapes = me()
            if tapes is not None:
                tapes._end(key)

        self._watched[key] = [weakref.ref(view, gone) for view in views]

    def _end(self, key: object) -> None:
        self._tapes.pop(key, None)
        self._watched.pop(key, None)
