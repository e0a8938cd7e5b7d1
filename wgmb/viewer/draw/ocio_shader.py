"""A Display's own shader: OpenColorIO's transform of pictures, on the GPU.

OpenColorIO writes GLSL with the bindings in it, so this is the one shader that is not WGSL.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import wgpu

from ... import gpu
from ...color.ocio import Shader
from ...color.spaces import ColorSpace, Display
from ...errors import DeviceError

OUTPUT = "rgba16float"
_EDGE = 8  # of a workgroup
_MAIN = """#version 450
layout(local_size_x = %(edge)d, local_size_y = %(edge)d) in;
layout(set = 0, binding = 0) uniform texture2D light;
layout(set = 0, binding = 1, rgba16f) uniform writeonly image2D display;
layout(set = 0, binding = 2) uniform Light { vec4 exposure; };
layout(set = 0, binding = 3) uniform sampler nearest;
layout(set = 0, binding = 4) uniform sampler linear;
#define texture(of, at) textureLod(of, at, 0.0)
%(ocio)s
float finite(float x) {
    uint bits = floatBitsToUint(x) & 0x7fffffffu;
    return bits > 0x7f800000u ? 0.0 : clamp(x, -65504.0, 65504.0);
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(display);
    if (at.x >= size.x || at.y >= size.y) { return; }
    vec4 here = textureLod(sampler2D(light, nearest), (vec2(at) + 0.5) / vec2(size), 0.0);
    float alpha = here.a > 0.0 ? here.a : 1.0;
    vec3 straight = here.rgb * exposure.x / alpha;
    vec3 color = vec3(finite(straight.r), finite(straight.g), finite(straight.b));
    color = clamp(shown(vec4(color, 1.0)).rgb, 0.0, 1.0) * clamp(alpha, 0.0, 1.0);
    if (here.a <= 0.0 && here.r == 0.0 && here.g == 0.0 && here.b == 0.0) { color = vec3(0.0); }
    imageStore(display, at, vec4(color, 1.0));
}
"""
_FIRST_TABLE = 5
_MOST_LISTS = 8  # storage buffers that WebGPU guarantees


class OcioShader:
    """The compiled shader of a display for pictures in one colour space.

    DeviceError where the device or its compiler cannot have it.
    """

    def __init__(self, device: wgpu.GPUDevice, display: Display, space: ColorSpace):
        self._device = device
        made = display.shader(space, _FIRST_TABLE)
        self._tables = [self._uploaded(table) for table in made.tables.values()]
        self._lists = []
        stage = wgpu.ShaderStage.COMPUTE
        dimensions = {2: "1d", 3: "2d", 4: "3d"}
        unfiltered = {"sample_type": "unfilterable-float"}
        entries: list[dict[str, Any]] = [
            {"texture": unfiltered},
            {"storage_texture": {"format": OUTPUT}},
            {"buffer": {"type": "uniform"}},
            {"sampler": {"type": "non-filtering"}},
            {"sampler": {"type": "filtering"}},
        ]
        for name, table in made.tables.items():
            kind = {"sample_type": "float"} if name in made.interpolated else unfiltered
            entries.append({"texture": kind | {"view_dimension": dimensions[table.ndim]}})
        text, lists = _with_buffers(_with_textures(made), len(entries))
        for values in lists:
            buffer = device.create_buffer_with_data(data=values, usage=wgpu.BufferUsage.STORAGE)
            self._lists.append({"buffer": buffer, "offset": 0, "size": values.nbytes})
            entries.append({"buffer": {"type": "read-only-storage"}})
        for i, entry in enumerate(entries):
            entry |= {"binding": i, "visibility": stage}
        source = _MAIN % {"edge": _EDGE, "ocio": text}
        try:
            self._layout = device.create_bind_group_layout(label="ocio", entries=entries)
            self._pipeline = device.create_compute_pipeline(
                label="ocio",
                layout=device.create_pipeline_layout(bind_group_layouts=[self._layout]),
                compute={
                    "module": device.create_shader_module(code=source, label="ocio comp"),
                    "entry_point": "main",
                },
            )
        except wgpu.GPUError as error:
            raise DeviceError(f"OpenColorIO's shader: {error}") from None
        self._samplers = [
            device.create_sampler(),
            device.create_sampler(min_filter="linear", mag_filter="linear"),
        ]

    def _uploaded(self, table: np.ndarray) -> wgpu.GPUTexture:
        """A table (..., 4) of float32 as a texture."""
        width, height, depth = (*table.shape[-2::-1], 1, 1)[:3]
        texture = self._device.create_texture(
            label="ocio table",
            size=(width, height, depth),
            dimension=f"{table.ndim - 1}d",
            format="rgba32float",
            usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST,
        )
        layout = {"bytes_per_row": 16 * width, "rows_per_image": height}
        self._device.queue.write_texture(
            {"texture": texture}, table, layout, (width, height, depth)
        )
        return texture

    def show(self, light: wgpu.GPUTexture, exposure: float, display: wgpu.GPUTexture) -> None:
        """Transform `light`, times `exposure`, into `display`, of the same size."""
        data = np.full(4, exposure, np.float32)
        factor = self._device.create_buffer_with_data(data=data, usage=wgpu.BufferUsage.UNIFORM)
        resources: list[Any] = [
            light.create_view(),
            display.create_view(),
            {"buffer": factor, "offset": 0, "size": data.nbytes},
            *self._samplers,
            *(table.create_view() for table in self._tables),
            *self._lists,
        ]
        entries = [{"binding": i, "resource": r} for i, r in enumerate(resources)]
        encoder = self._device.create_command_encoder(label="ocio")
        compute = encoder.begin_compute_pass(label="ocio")
        compute.set_pipeline(self._pipeline)
        bound = self._device.create_bind_group(layout=self._layout, entries=entries)
        compute.set_bind_group(0, bound)
        compute.dispatch_workgroups(*(-(-n // _EDGE) for n in display.size[:2]))
        compute.end()
        gpu.submit(self._device, encoder)


def _with_textures(shader: Shader) -> str:
    """OpenColorIO's GLSL with textures and samplers apart, as WebGPU has them."""

    def apart(match: re.Match[str]) -> str:
        start, kind, name = match.groups()
        sampler = "linear" if name in shader.interpolated else "nearest"
        return (
            f"{start} uniform texture{kind} {name}_table;\n"
            f"#define {name} sampler{kind}({name}_table, {sampler})"
        )

    text = re.sub(r"(layout\([^)]*\)) uniform sampler(\dD) (\w+);", apart, shader.text)
    return re.sub(r"\.rgb\.([rgb])\b", r".\1", text)  # which naga cannot assign to


def _with_buffers(text: str, binding: int) -> tuple[str, list[np.ndarray]]:
    """The same with lists of numbers in buffers, as the compiler copies constants at each use."""
    found: list[np.ndarray] = []

    def buffered(list_: re.Match[str]) -> str:
        if len(found) == _MOST_LISTS:
            return list_[0]
        kind, name, count, values = list_.groups()
        found.append(np.array(values.split(","), {"float": "f4", "int": "i4"}[kind]))
        place = f"layout(std430, set = 0, binding = {binding + len(found) - 1})"
        return f"{place} readonly buffer {name}_list {{ {kind} {name}[{count}]; }};"

    pattern = r"const (float|int) (\w+)\[(\d+)\] = \w+\[\d+\]\(([^()]*)\);"
    return re.sub(pattern, buffered, text), found
