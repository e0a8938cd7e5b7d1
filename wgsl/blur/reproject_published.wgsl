// Sample reprojection as published (Taylor): the samples of two frames, rounded to pixels and counted
// at every camera between the two, without a depth test.
//#include common/camera.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl

struct Step {
    clip_from_pixel: mat4x4f,   // of the interpolated camera
    view: View,
    time: f32,                  // share of the way to the other frame; negative: to the previous one
    first: u32,                 // 1: the first step of a picture
}

@group(1) @binding(0) var<uniform> step_: Step;
@group(1) @binding(1) var color: texture_2d<f32>;       // of the source frame
@group(1) @binding(2) var motion: texture_2d<f32>;      // of the source frame: to_prev, to_next [px]
@group(1) @binding(3) var depth: texture_2d<f32>;       // of the source frame
@group(1) @binding(4) var weight: texture_2d<f32>;      // of the source frame, 0: is not moved
@group(1) @binding(5) var own: texture_2d<f32>;         // the frame itself, for pixels that nothing reached
@group(1) @binding(6) var<storage, read_write> sums: array<atomic<u32>>;    // r, g, b, a per pixel, low words
@group(1) @binding(7) var<storage, read_write> carries: array<atomic<u32>>; // the high words
@group(1) @binding(8) var<storage, read_write> counts: array<atomic<u32>>;
@group(1) @binding(9) var output: Output;

override CAMERA: bool = false;      // move by the interpolated camera, not along the motion
override WEIGHTED: bool = false;
override COUNTS: bool = false;      // show the share of the steps that reached a pixel

// Fixed point, so that the order of additions does not matter: 64 bits cannot overflow.
const STEPS_PER_UNIT: f32 = 16384.0;
const LARGEST: f32 = 262143.0;      // colour beyond this, and below 0, is held to the range [linear]

@compute @workgroup_size(WG_X, WG_Y)
fn clear(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = id.y * frame.size.x + id.x;
    for (var c = 0u; c < 4u; c++) {
        atomicStore(&sums[4u * at + c], 0u);
        atomicStore(&carries[4u * at + c], 0u);
    }
    atomicStore(&counts[at], 0u);
}

@compute @workgroup_size(WG_X, WG_Y)
fn splat(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    if WEIGHTED { if textureLoad(weight, id.xy, 0).x <= 0.0 { return; } }
    let x = vec2f(id.xy) + 0.5 + way(id.xy);
    if any(abs(x) > vec2f(1e6)) { return; }
    let to = vec2i(floor(x));
    if any(to < vec2i(0)) || any(to >= vec2i(frame.size)) { return; }
    let at = u32(to.y) * frame.size.x + u32(to.x);
    let value = vec4u(clamp(textureLoad(color, id.xy, 0), vec4f(0.0), vec4f(LARGEST)) * STEPS_PER_UNIT + 0.5);
    for (var c = 0u; c < 4u; c++) {
        let before = atomicAdd(&sums[4u * at + c], value[c]);
        if before + value[c] < before { atomicAdd(&carries[4u * at + c], 1u); }
    }
    atomicAdd(&counts[at], 1u);
}

@compute @workgroup_size(WG_X, WG_Y)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = id.y * frame.size.x + id.x;
    let count = f32(atomicLoad(&counts[at]));
    var sum = vec4f(0.0);
    for (var c = 0u; c < 4u; c++) {
        sum[c] = f32(atomicLoad(&carries[4u * at + c])) * 4294967296.0 + f32(atomicLoad(&sums[4u * at + c]));
    }
    var result = textureLoad(own, id.xy, 0);
    if count > 0.0 { result = sum / (count * STEPS_PER_UNIT); }
    if COUNTS { result = vec4f(vec3f(count / (2.0 * f32(frame.samples))), 1.0); }
    textureStore(output, id.xy, result);
}

/// How far the sample at `px` has moved at this step [px].
fn way(px: vec2u) -> vec2f {
    if !CAMERA { return displacement(path_of(textureLoad(motion, px, 0)), step_.time); }
    let view = step_.view;
    let z = textureLoad(depth, px, 0).x;
    let nothing_there = is_nothing(view, z);
    let ndc = ndc_of(view, px);
    let clip = step_.clip_from_pixel * homogeneous(view, ndc, z, nothing_there);
    if clip.w <= NEAREST { return vec2f(1e9); }
    return to_pixels(view, clip, ndc);
}
