"""Kernels in the words of the standard (WebGPU): what JavaScript takes, made from wgpu-py's."""

from __future__ import annotations

from typing import Any

from wgmb.gpu import kernels
from wgmb.gpu.wgsl import WgslSource


def groups_of(source: WgslSource) -> list[list[dict[str, Any]]]:
    """A shader's bind groups: their GPUBindGroupLayoutEntry, each with its `name` in the shader."""
    bindings = source.bindings()
    count = 1 + max((b.group for b in bindings), default=-1)
    return [
        [
            {"name": b.name} | _standard(kernels._layout_entry(b, source))
            for b in bindings
            if b.group == group
        ]
        for group in range(count)
    ]


def _standard(entry: dict) -> dict:
    def camel(name: str) -> str:
        first, *rest = name.split("_")
        return first + "".join(word.capitalize() for word in rest)

    return {
        camel(key): _standard(value) if isinstance(value, dict) else value
        for key, value in entry.items()
    }
