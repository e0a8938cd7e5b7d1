"""Bind groups, constants and stand-ins, kept from frame to frame: making one costs 20 us."""

from __future__ import annotations

import re
import weakref
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import wgpu

Resource = wgpu.GPUTextureView | wgpu.GPUSampler | wgpu.GPUBuffer | Mapping[str, Any]
_Key = tuple[object, ...]
_LARGEST = 4096  # bytes of a constant that is kept
_NOTHING = 256  # bytes of a buffer that stands for none


class BindGroups:
    """Bind groups by their resources. They keep nothing alive in Python: once a view, a buffer or
    a sampler is let go of elsewhere, the groups that bind it are let go of too.
    """

    def __init__(self) -> None:
        self._groups: dict[_Key, tuple[wgpu.GPUBindGroup, set[int]]] = {}  # and uids of its things
        self._keys: dict[int, set[_Key]] = {}  # of the groups that bind a thing, by its uid
        self._watched: dict[int, weakref.ref[wgpu.GPUObjectBase]] = {}

    def __len__(self) -> int:
        return len(self._groups)

    def group(
        self,
        device: wgpu.GPUDevice,
        layout: wgpu.GPUBindGroupLayout,
        resources: Mapping[int, Resource],
    ) -> wgpu.GPUBindGroup:
        """The group of `layout` that binds these resources by their indices."""
        key = layout.uid, *map(_identity, resources.values())
        entry = self._groups.get(key)
        if entry is not None:
            return entry[0]
        made = made_group(device, layout, resources)
        things = {thing.uid: thing for thing in map(_thing, resources.values())}
        self._groups[key] = made, set(things)
        for thing in things.values():
            self._watch(thing, key)
        return made

    def _watch(self, thing: wgpu.GPUObjectBase, key: _Key) -> None:
        """Forget the group `key` when `thing` goes."""
        uid = thing.uid
        self._keys.setdefault(uid, set()).add(key)
        if uid not in self._watched:
            me = weakref.ref(self)

            def gone(_ref: weakref.ref[wgpu.GPUObjectBase]) -> None:
                groups = me()
                if groups is not None:
                    groups._forget(uid)

            self._watched[uid] = weakref.ref(thing, gone)

    def _forget(self, uid: int) -> None:
        self._watched.pop(uid, None)
        for key in self._keys.pop(uid, ()):
            _, others = self._groups.pop(key, (None, ()))
            for other in others:
                keys = self._keys.get(other)
                if keys is None:
                    continue
                keys.discard(key)
                if not keys:
                    del self._keys[other]
                    self._watched.pop(other, None)


def made_group(
    device: wgpu.GPUDevice, layout: wgpu.GPUBindGroupLayout, resources: Mapping[int, Resource]
) -> wgpu.GPUBindGroup:
    """A new group of `layout`."""
    entries = [{"binding": i, "resource": _bound(r)} for i, r in resources.items()]
    return device.create_bind_group(layout=layout, entries=entries)


def _bound(resource: Resource) -> Resource:
    if isinstance(resource, wgpu.GPUBuffer):
        return {"buffer": resource, "offset": 0, "size": resource.size}
    return resource


def _thing(resource: Resource) -> wgpu.GPUObjectBase:
    return resource["buffer"] if isinstance(resource, dict) else resource  # type: ignore


def _identity(resource: Resource) -> object:
    if isinstance(resource, dict):
        return resource["buffer"].uid, resource["offset"], resource["size"]
    return resource.uid  # type: ignore


def constant(
    device: wgpu.GPUDevice, label: str, data: np.ndarray, usage: int = wgpu.BufferUsage.UNIFORM
) -> wgpu.GPUBuffer:
    """A buffer that holds `data` and is never written again; small ones are shared and kept."""
    if data.nbytes > _LARGEST:
        return device.create_buffer_with_data(label=label, data=data, usage=usage)
    return _constant(device, label, data.tobytes(), int(usage))


@lru_cache(maxsize=256)
def _constant(device: wgpu.GPUDevice, label: str, data: bytes, usage: int) -> wgpu.GPUBuffer:
    return device.create_buffer_with_data(label=label, data=data, usage=usage)


def stand_in(device: wgpu.GPUDevice, name: str, space: str, kind: str) -> Resource:
    """Bound where a pass has nothing for the binding `name`, of this address space and type.

    A texture of one black pixel, or a buffer of zeros. Those that are written are the binding's
    own, as a pass may not write one resource by two names.
    """
    written = "write" in space or "write" in kind
    return _stand_in(device, name if written else "", space, kind)


@lru_cache(maxsize=256)
def _stand_in(device: wgpu.GPUDevice, name: str, space: str, kind: str) -> Resource:
    if space.startswith("storage"):
        usage = wgpu.BufferUsage.STORAGE
        return device.create_buffer(label=f"none {name}", size=_NOTHING, usage=usage)
    stored = re.search(r"texture_storage_2d(?:_array)?<(\w+)", kind)
    format = stored[1] if stored else "r32uint" if "<u32>" in kind else "rgba16float"
    usage = wgpu.TextureUsage.STORAGE_BINDING if stored else wgpu.TextureUsage.TEXTURE_BINDING
    texture = device.create_texture(
        label=f"none {name}", size=(1, 1, 1), format=format, usage=usage
    )
    return texture.create_view(dimension="2d-array" if "_2d_array" in kind else "2d")


def forget_constants() -> None:
    """Let go of all constants and stand-ins: their device is lost."""
    _constant.cache_clear()
    _stand_in.cache_clear()
