"""The precision of a device's sampler: many GPUs mix texels by weights of eight bits."""

import numpy as np
import wgpu

COUNT = 4096
_SHADER = f"""
@group(0) @binding(0) var texels: texture_2d<f32>;
@group(0) @binding(1) var linear: sampler;
@group(0) @binding(2) var<storage, read_write> mixed: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let x = (f32(id.x) + 0.37) / {COUNT}.0;  // of the way from the middle of a texel to the next
    mixed[id.x] = textureSampleLevel(texels, linear, vec2f(0.25 + 0.5 * x, 0.5), 0.0).r;
}}
"""


def greatest_error(device) -> float:
    """Of a mixture of two texels of 0 and 1: about 1/512 with weights of eight bits."""
    texels = device.create_texture(
        size=(2, 1),
        format="rgba16float",
        usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST,
    )
    colors = np.array([[0] * 4, [1] * 4], np.float16)
    device.queue.write_texture({"texture": texels}, colors, {"bytes_per_row": 16}, (2, 1, 1))
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    mixed = device.create_buffer(size=4 * COUNT, usage=usage)
    module = device.create_shader_module(code=_SHADER)
    pipeline = device.create_compute_pipeline(
        layout="auto", compute={"module": module, "entry_point": "main"}
    )
    sampler = device.create_sampler(mag_filter="linear", min_filter="linear")
    bound = [texels.create_view(), sampler, {"buffer": mixed}]
    group = device.create_bind_group(
        layout=pipeline.get_bind_group_layout(0),
        entries=[{"binding": n, "resource": one} for n, one in enumerate(bound)],
    )
    encoder = device.create_command_encoder()
    work = encoder.begin_compute_pass()
    work.set_pipeline(pipeline)
    work.set_bind_group(0, group)
    work.dispatch_workgroups(COUNT // 64)
    work.end()
    device.queue.submit([encoder.finish()])
    got = np.frombuffer(device.queue.read_buffer(mixed), np.float32)
    return float(np.abs(got - (np.arange(COUNT) + 0.37) / COUNT).max())
