// Distributed ray tracing in time (Cook, Porter, Carpenter 1984): every ray has its own instant.
//#include common/frame.wgsl
//#include common/hash.wgsl
//#include common/loops.wgsl
//#include common/shutter.wgsl
//#include scene/trace.wgsl

@group(1) @binding(3) var<uniform> progress: Progress;
@group(1) @binding(4) var<storage, read_write> sums: array<vec4f>;  // sum of the radiance of all rays so far; w: their number
@group(1) @binding(5) var output: Output;

struct Progress {
    first: u32,         // rays per pixel that are in `sums`; 0 starts anew
    count: u32,         // rays to add now
    seed: u32,
}

// Step of Roberts's sequence R3 (2018), the powers of 1 / x where x^4 = x + 1. Any first n points have low
// discrepancy in three dimensions, so that more rays refine the same image.
const R3: vec3f = vec3f(0.81917251, 0.67104361, 0.54970048);

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = id.y * frame.size.x + id.x;
    let shift = random3(id.xy);
    var sum = vec4f(0.0);
    if progress.first > 0u { sum = sums[at]; }
    let count = turns_of(progress.count, id.x);
    var i = 0u;
    loop {
        let point = fract(shift + fract(f32(progress.first + i) * R3));
        let x = vec2f(id.xy) + point.xy;
        let now = instant(time_at_share(point.z) + dot(shutter.rolling, x / vec2f(frame.size) - 0.5));
        let ray = camera_ray(x, pose(0u, now));
        sum += vec4f(radiance(nearest(ray, now), ray, now), 1.0);
        i++;
        if i >= count { break; }
    }
    sums[at] = sum;
    textureStore(output, id.xy, vec4f(sum.rgb / sum.w, 1.0));
}

/// Three numbers in [0, 1) for a pixel, a frame and a seed.
fn random3(px: vec2u) -> vec3f {
    return unit_float3(pcg3d(vec3u(px, progress.seed + 0x9E3779B1u * frame.index)));
}
