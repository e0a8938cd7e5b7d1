// The result: motion of every pixel to the previous and the next frame, and depth by the distance from the motion of
// most of the picture, which is taken for the background.
//#include flow/band.wgsl
//#include flow/state.wgsl

struct Result {
    to_prev: mat4x4f,   // homography of most of the picture: columns of 3, from pixels to pixels
    to_next: mat4x4f,
    spacing: u32,       // of the pixels that `thin` takes [px]
    near: f32,          // the near frame is the next one: 1; the previous one: -1; there is none: 0
    around: u32,        // 1 if the far frame is the other neighbour
    unused: u32,
}

@group(1) @binding(0) var<uniform> result: Result;
@group(1) @binding(1) var states: texture_2d_array<f32>;
@group(1) @binding(2) var motion: texture_2d<f32>;      // output of `write_motion`
@group(1) @binding(3) var apart: texture_2d<f32>;       // output of `find_apart`
@group(1) @binding(4) var motion_out: texture_storage_2d<rgba32float, write>;  // to_prev, to_next [px]
@group(1) @binding(5) var apart_out: texture_storage_2d<rgba32float, write>;   // distance of both [px]
@group(1) @binding(6) var depth_out: texture_storage_2d<r32float, write>;      // of no scale: smaller is nearer

const NEARNESS: f32 = 0.005;    // how fast depth falls with the distance [1/px]
const MEDIAN_RADIUS: i32 = 2;   // [px]
const MEDIAN_SIDE: i32 = 5;
const MEDIAN_COUNT: i32 = 25;
const RANK: i32 = 12;           // of the median

@compute @workgroup_size(WG_X, WG_Y)
fn write_motion(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let state = load_state(states, vec2i(id));
    let ahead = select(vec2f(0.0), state.flow, result.near != 0.0);
    let behind = select(vec2f(0.0), state.bend, result.around == 1u) - ahead;
    textureStore(motion_out, id, select(vec4f(ahead, behind), vec4f(behind, ahead), result.near >= 0.0));
}

/// The motion of a few pixels, evenly spaced: one for each pixel of a small picture.
@compute @workgroup_size(WG_X, WG_Y)
fn thin(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let px = result.spacing * id + result.spacing / 2u;
    textureStore(apart_out, id, textureLoad(motion, min(px, textureDimensions(motion) - 1u), 0));
}

/// Distance of each pixel's motion from that of most of the picture.
@compute @workgroup_size(WG_X, WG_Y)
fn find_apart(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let own = textureLoad(motion, id, 0);
    let x = vec2f(id) + 0.5;
    let back = length(own.xy - displaced(result.to_prev, x));
    let ahead = length(own.zw - displaced(result.to_next, x));
    textureStore(apart_out, id, vec4f(back, ahead, 0.0, 0.0));
}

fn displaced(homography: mat4x4f, x: vec2f) -> vec2f {
    let at = homography * vec4f(x, 1.0, 0.0);
    return at.xy / at.z - x;
}

/// Depth from the greater distance of both, each the median of the pixels around.
@compute @workgroup_size(WG_X, WG_Y)
fn write_depth(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let distances = medians(vec2i(min(id, frame.size - 1u)));
    if any(id >= frame.size) { return; }
    textureStore(depth_out, id, vec4f(1.0 / (1.0 + NEARNESS * max(distances.x, distances.y))));
}

/// The distances that as many of 5 x 5 pixels are below as above.
fn medians(px: vec2i) -> vec2f {
    let last = vec2i(frame.size) - 1;
    var values: array<vec2f, MEDIAN_COUNT>;
    for (var k = 0; k < MEDIAN_COUNT; k++) {
        let by = vec2i(k % MEDIAN_SIDE, k / MEDIAN_SIDE) - MEDIAN_RADIUS;
        values[k] = textureLoad(apart, clamp(px + by, vec2i(0), last), 0).xy;
    }
    // The greatest of those that no more than RANK values are below.
    var found = vec2f(0.0);
    for (var k = 0; k < MEDIAN_COUNT; k++) {
        var below = vec2i(0);
        for (var i = 0; i < MEDIAN_COUNT; i++) { below += vec2i(values[i] < values[k]); }
        found = max(found, select(vec2f(0.0), values[k], below <= vec2i(RANK)));
    }
    return found;
}
