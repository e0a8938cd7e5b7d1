// Darkness pushed along its flow to where it is at a time between two frames: a bilinear splat, in whole numbers, so
// that the order does not count.
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/resting.wgsl
//#include methods/gather/shading/pushed.wgsl
//#include methods/gather/shading/light.wgsl

struct Push {
    along: f32,         // share of the flow
}

@group(1) @binding(0) var<uniform> push: Push;
@group(1) @binding(1) var values: texture_2d<f32>;
@group(1) @binding(2) var flow: texture_2d<f32>;        // and trust
@group(1) @binding(3) var<storage, read_write> pushed: array<atomic<u32>>;  // two words a pixel: see unpack_pushed()

const PRESENT: f32 = 0.1;       // value from which on there is something to move

/// The tiles near changes.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let value = textureLoad(values, id, 0);
    let known = textureLoad(flow, id, 0);
    let weight = known.z * min(value.a / PRESENT, 1.0);
    if weight <= 0.0 { return; }
    let at = vec2f(id) + push.along * known.xy;
    let corner = floor(at);
    let share = at - corner;
    for (var k = 0; k < 4; k++) {
        let step = vec2f(f32(k & 1), f32(k >> 1u));
        let px = vec2i(corner + step);
        let shares = mix(1.0 - share, share, step);
        if any(px < vec2i(0)) || any(px >= vec2i(frame.size)) { continue; }
        if (found[1u + light_tile(vec2u(px))] & CHANGES) == 0u { continue; }
        let amount = ONE * weight * shares.x * shares.y;
        let first = 2u * (u32(px.y) * frame.size.x + u32(px.x));
        let parts = vec4u(round(amount * clamp(vec4f(value.rgb, 1.0), vec4f(0.0), vec4f(1.0))));
        atomicAdd(&pushed[first], parts.x | (parts.y << 16u));
        atomicAdd(&pushed[first + 1u], parts.z | (parts.w << 16u));
    }
}
