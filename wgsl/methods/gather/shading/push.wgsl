// Darkness pushed along its flow to where it is at a time between two frames: a bilinear splat, in whole numbers, so
// that the order does not count.
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/resting.wgsl
//#include methods/gather/shading/pushed.wgsl
//#include methods/gather/shading/moving.wgsl

struct Push {
    time: f32,          // share of the way to the neighbour
}

@group(1) @binding(0) var<uniform> push: Push;
@group(1) @binding(1) var<storage, read_write> from_here: array<atomic<u32>>;   // two words a pixel: see unpack_pushed()
@group(1) @binding(2) var<storage, read_write> from_there: array<atomic<u32>>;

struct Moved {          // darkness on its way
    parts: vec4f,       // see unpack_pushed()
    corner: vec2i,      // the first of the four pixels that it comes to
    share: vec2f,       // of the last ones
}

/// The tiles near changes, from both frames.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let here = moved(id, textureLoad(values, id, 0), textureLoad(flow, id, 0), push.time);
    let there = moved(id, textureLoad(values_there, id, 0), textureLoad(flow_back, id, 0), 1.0 - push.time);
    if here.parts.w > 0.0 {
        for (var k = 0u; k < 4u; k++) {
            let one = splat(here, k);
            if any(one.yz != vec2u(0u)) {
                atomicAdd(&from_here[one.x], one.y);
                atomicAdd(&from_here[one.x + 1u], one.z);
            }
        }
    }
    if there.parts.w > 0.0 {
        for (var k = 0u; k < 4u; k++) {
            let one = splat(there, k);
            if any(one.yz != vec2u(0u)) {
                atomicAdd(&from_there[one.x], one.y);
                atomicAdd(&from_there[one.x + 1u], one.z);
            }
        }
    }
}

/// The value of a pixel, `along` this share of its flow.
fn moved(id: vec2u, value: vec4f, known: vec4f, along: f32) -> Moved {
    let weight = known.z * min(value.a / PRESENT, 1.0);
    let at = vec2f(id) + along * known.xy;
    let parts = ONE * weight * clamp(vec4f(value.rgb, 1.0), vec4f(0.0), vec4f(1.0));
    return Moved(parts, vec2i(floor(at)), at - floor(at));
}

/// Its part for the pixel `k` of four: where its first word is, and both words; 0 where light rests.
fn splat(what: Moved, k: u32) -> vec3u {
    let step = vec2u(k & 1u, k >> 1u);
    let shares = select(1.0 - what.share, what.share, step == vec2u(1u));
    let px = what.corner + vec2i(step);
    let is_there = all(px >= vec2i(0)) && all(px < vec2i(frame.size));
    let to = select(vec2u(0u), vec2u(px), is_there);
    let changes = (found[1u + light_tile(to)] & CHANGES) != 0u;
    let parts = vec4u(round(shares.x * shares.y * what.parts));
    let words = vec2u(parts.x | (parts.y << 16u), parts.z | (parts.w << 16u));
    return vec3u(2u * (to.y * frame.size.x + to.x), select(vec2u(0u), words, is_there && changes));
}
