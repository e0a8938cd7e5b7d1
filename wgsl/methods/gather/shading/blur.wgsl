// A Gaussian, along one axis a pass.
//#include common/frame.wgsl
//#include methods/gather/shading/active.wgsl
//#include methods/gather/shading/light.wgsl

@group(1) @binding(0) var source: texture_2d<f32>;
@group(1) @binding(1) var output: Blurred;

@group(1) @binding(2) var<storage, read> found: array<u32>;     // one word, then those of tiles: see active.wgsl

alias Blurred = texture_storage_2d<rgba32float, write>;

override SIGMA: f32 = 5.0;      // [px]

@compute @workgroup_size(WG_X, WG_Y)
fn across(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    if (found[1u + light_tile(id.xy)] & NEAR) == 0u {
        textureStore(output, id.xy, vec4f(0.0));
        return;
    }
    textureStore(output, id.xy, mean(vec2i(id.xy), vec2i(1, 0)));
}

@compute @workgroup_size(WG_X, WG_Y)
fn down(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    if (found[1u + light_tile(id.xy)] & NEAR) == 0u {
        textureStore(output, id.xy, vec4f(0.0));
        return;
    }
    textureStore(output, id.xy, mean(vec2i(id.xy), vec2i(0, 1)));
}

fn mean(px: vec2i, axis: vec2i) -> vec4f {
    let radius = i32(ceil(3.0 * SIGMA));
    var sum = vec4f(0.0);
    var total = 0.0;
    for (var k = -radius; k <= radius; k++) {
        let weight = exp(-0.5 * f32(k * k) / (SIGMA * SIGMA));
        sum += weight * textureLoad(source, inside(px + k * axis), 0);
        total += weight;
    }
    return sum / total;
}
