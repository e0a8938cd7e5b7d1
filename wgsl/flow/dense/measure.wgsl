// Motion of the whole picture on the small level, how well it fits there, and how often each value occurs.
//#include common/frame.wgsl
//#include flow/dense/differences.wgsl
//#include flow/dense/summary.wgsl

@group(1) @binding(2) var motion: texture_2d<f32>;      // of the whole picture [px]
@group(1) @binding(3) var begin: texture_storage_2d<rgba32float, write>;    // the same on this level [px of it]
@group(1) @binding(4) var fits: texture_storage_2d<rgba32float, write>;     // difference along it; change; difference to the mean
@group(1) @binding(5) var<storage, read_write> tables: array<atomic<u32>>;  // TABLES of BINS, all 0 at first

const MEANS: i32 = 4;       // pixels a side, evenly spaced, of which a small one is the mean
const RADIUS: i32 = 1;      // of the squares that are compared [px]

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let factor = vec2f(textureDimensions(motion)) / vec2f(frame.size);
    var sum = vec4f(0.0);
    for (var k = 0; k < MEANS * MEANS; k++) {
        let part = (vec2f(vec2i(k % MEANS, k / MEANS)) + 0.5) / f32(MEANS);
        sum += textureLoad(motion, vec2i(factor * (vec2f(px) + part)), 0);
    }
    let state = sum / f32(MEANS * MEANS) / factor.xyxy;
    textureStore(begin, px, state);
    let apart = differences(px, state, RADIUS);
    let change = changes(px);
    textureStore(fits, px, vec4f(apart.better, change, apart.mean, 0.0));
    atomicAdd(&tables[bin(CHANGES, change * BINS_PER_LEVEL)], 1u);
    let ways = state * BINS_PER_PIXEL + f32(BINS / 2u);
    atomicAdd(&tables[bin(PREV_X, ways.x)], 1u);
    atomicAdd(&tables[bin(PREV_X + 1u, ways.y)], 1u);
    atomicAdd(&tables[bin(PREV_X + 2u, ways.z)], 1u);
    atomicAdd(&tables[bin(PREV_X + 3u, ways.w)], 1u);
}

/// By how much the picture differs from both neighbours, in the mean of a square [levels of 255].
fn changes(px: vec2i) -> f32 {
    let side = 2 * RADIUS + 1;
    var sum = 0.0;
    for (var k = 0; k < side * side; k++) {
        let at = px + vec2i(k % side, k / side) - RADIUS;
        sum += of_both(abs(vec2f(grey(at, turn.prev), grey(at, turn.next)) - grey(at, turn.here))).better;
    }
    return sum / f32(side * side);
}
