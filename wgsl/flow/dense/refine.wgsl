// Steps of inverse search from the median of the motion around, each way by itself (Baker and Matthews, "Lucas-Kanade
// 20 Years On", 2004).
//#include common/frame.wgsl
//#include flow/dense/sampling.wgsl

@group(1) @binding(2) var state: texture_2d<f32>;       // to_prev, to_next [px]
@group(1) @binding(3) var areas: texture_2d<f32>;       // medians are taken where ways of blocks were tried
@group(1) @binding(4) var output: texture_storage_2d<rgba32float, write>;

override MEDIAN: i32 = 2;       // radius of the pixels whose median is taken [px], 1 or 2
override RADIUS: i32 = 2;       // of the squares that are compared [px]
const MOST: i32 = 25;           // pixels of a median
const STEPS: u32 = 2u;
const LONGEST_STEP: f32 = 1.0;  // [px]
const MOST_APART: f32 = 30.0;   // levels of difference that count in a step
const FLAT: f32 = 1.0;          // mean squared gradient [levels^2 / px^2] that tells little

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let small = px * vec2i(textureDimensions(areas)) / vec2i(frame.size);
    let area = textureLoad(areas, small, 0).x;
    let motion = select(textureLoad(state, px, 0), median(px), area >= TRIED);
    let square = gradients(px);
    textureStore(output, px, both_ways(vec4f(stepped(px, motion.xy, square, 0u), stepped(px, motion.zw, square, 1u))));
}

/// The value of each part that as many of those around are below as above.
fn median(px: vec2i) -> vec4f {
    let side = 2 * MEDIAN + 1;
    let last = vec2i(frame.size) - 1;
    var values: array<vec4f, MOST>;
    for (var k = 0; k < side * side; k++) {
        values[k] = textureLoad(state, clamp(px + vec2i(k % side, k / side) - MEDIAN, vec2i(0), last), 0);
    }
    // The greatest of those that no more than half are below.
    var found = values[0] - NOWHERE;
    for (var k = 0; k < side * side; k++) {
        var below = vec4i(0);
        for (var i = 0; i < side * side; i++) { below += vec4i(values[i] < values[k]); }
        found = max(found, select(vec4f(-NOWHERE), values[k], below <= vec4i(side * side / 2)));
    }
    return found;
}

const NOWHERE: f32 = 1000000.0; // [px]

/// Means of squared gradients: xx, xy, yy.
fn gradients(px: vec2i) -> vec3f {
    let side = 2 * RADIUS + 1;
    var sum = vec3f(0.0);
    for (var k = 0; k < side * side; k++) {
        let g = gradient(px + vec2i(k % side, k / side) - RADIUS);
        sum += vec3f(g.x * g.x, g.x * g.y, g.y * g.y);
    }
    return sum / f32(side * side) + vec3f(FLAT, 0.0, FLAT);
}

/// A way to a neighbour after steps that match better.
fn stepped(px: vec2i, begin: vec2f, square: vec3f, neighbour: u32) -> vec2f {
    let side = 2 * RADIUS + 1;
    let layer = layer_of(neighbour);
    var best = begin;
    var way = begin;
    var least = NOWHERE;
    for (var turn_number = 0u; turn_number <= STEPS; turn_number++) {
        var product = vec2f(0.0);
        var error = 0.0;
        for (var k = 0; k < side * side; k++) {
            let at = px + vec2i(k % side, k / side) - RADIUS;
            let apart = grey_between(vec2f(at) + way, layer) - grey(at, turn.here);
            product += clamp(apart, -MOST_APART, MOST_APART) * gradient(at);
            error += abs(apart);
        }
        let is_better = error < least;
        best = select(best, way, is_better);
        least = min(least, error);
        product /= f32(side * side);
        let step = vec2f(square.y * product.y - square.z * product.x, square.y * product.x - square.x * product.y)
            / (square.x * square.z - square.y * square.y);
        way = best + select(vec2f(0.0), clamp(step, vec2f(-LONGEST_STEP), vec2f(LONGEST_STEP)), is_better);
    }
    return best;
}
