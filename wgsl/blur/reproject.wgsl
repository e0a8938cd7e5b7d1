// Sample reprojection in depth-tested time slices: every sample moves to its place at every time,
// the nearest one is seen (Taylor, extended by the depth test and object motion he left to others).
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl

struct Slice {
    time: f32,          // of this slice [frame intervals]
    offset: f32,        // of the source frame [frame intervals]
    source: u32,        // its number among the sources; 0 is the frame itself
    last: u32,          // 1: the last of the sources
}

@group(1) @binding(0) var<uniform> slice: Slice;
@group(1) @binding(1) var color: texture_2d<f32>;       // of the source, premultiplied by alpha and weight
@group(1) @binding(2) var motion: texture_2d<f32>;      // of the source: to_prev, to_next [px]
@group(1) @binding(3) var depth: texture_2d<f32>;       // of the source
@group(1) @binding(4) var weight: texture_2d<f32>;      // of the source, 0: counts for nothing
@group(1) @binding(5) var own: texture_2d<f32>;         // the frame itself, for pixels that nothing reached
@group(1) @binding(6) var linear: sampler;
@group(1) @binding(7) var<storage, read_write> nearest: array<atomic<u32>>;     // bits of the least depth
@group(1) @binding(8) var<storage, read_write> winner: array<atomic<u32>>;      // sample seen there
@group(1) @binding(9) var<storage, read_write> means: array<vec4f>;             // of what was seen, over the slices
@group(1) @binding(10) var<storage, read_write> counts: array<f32>;             // its weight
@group(1) @binding(11) var output: Output;

override WEIGHTED: bool = false;
override COUNTS: bool = false;      // show how many slices reached a pixel instead of its colour

const NOTHING: u32 = 0xffffffffu;
const FAR: f32 = 1e10;              // depth of what has none; also that of nothing
const OFF_CENTRE: f32 = 0.004;      // share of depth by which a sample stands back per pixel off its place
const NEIGHBOUR: u32 = 0x80000000u;
const ROW_BIT: u32 = 15u;           // in a sample's number its column comes first, then its row,
const SOURCE_BITS: u32 = 30u;       // then the source

/// Before the first slice.
@compute @workgroup_size(WG_X, WG_Y)
fn clear(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = index_of(id.xy);
    atomicStore(&nearest[at], NOTHING);
    atomicStore(&winner[at], NOTHING);
    means[at] = vec4f(0.0);
    counts[at] = 0.0;
}

/// The least depth at every pixel.
@compute @workgroup_size(WG_X, WG_Y)
fn depths(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    splat(id.xy, false);
}

/// Of the samples with that depth, the one with the least index: the same one every time.
@compute @workgroup_size(WG_X, WG_Y)
fn winners(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    splat(id.xy, true);
}

/// The colour that lands on the pixel's centre, from where the sample came.
@compute @workgroup_size(WG_X, WG_Y)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = index_of(id.xy);
    let seen = atomicLoad(&winner[at]);
    if slice.last == 1u {       // of the sources: ready for the next slice
        atomicStore(&nearest[at], NOTHING);
        atomicStore(&winner[at], NOTHING);
    }
    if seen == NOTHING || seen >> SOURCE_BITS != slice.source { return; }
    let px = vec2u(seen & ((1u << ROW_BIT) - 1u), (seen & ((1u << SOURCE_BITS) - 1u)) >> ROW_BIT);
    let moved = way(px);
    let uv = (vec2f(id.xy) + 0.5 - moved) / vec2f(frame.size);
    let still = all(moved == vec2f(0.0));       // to the bit
    let seen_color = select(textureSampleLevel(color, linear, uv, 0.0), textureLoad(color, id.xy, 0), still);
    var counted = 1.0;
    if WEIGHTED { counted = textureSampleLevel(weight, linear, uv, 0.0).x; }
    let count = counts[at] + counted;
    if count <= 0.0 { return; }
    // A running mean: equal colours stay equal to the bit, and no sum of finite ones overflows.
    means[at] += (seen_color - counted * means[at]) / count;
    counts[at] = count;
}

/// After the last slice.
@compute @workgroup_size(WG_X, WG_Y)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = index_of(id.xy);
    var result = textureLoad(own, id.xy, 0);
    if counts[at] > 0.0 { result = means[at]; }
    if COUNTS { result = vec4f(vec3f(counts[at] / f32(frame.samples)), 1.0); }
    textureStore(output, id.xy, result);
}

fn index_of(px: vec2u) -> u32 {
    return px.y * frame.size.x + px.x;
}

/// How far the source's sample at `px` has moved by the time of the slice [px].
fn way(px: vec2u) -> vec2f {
    let delay = shutter_times(vec2f(px) + 0.5, 0.0).delay;
    return displacement(path_of(textureLoad(motion, px, 0)), slice.time + delay - slice.offset);
}

/// Put the sample at `px` over the four pixels around its place.
fn splat(px: vec2u, decide: bool) {
    var z = textureLoad(depth, px, 0).x;
    if !is_finite(z) || z <= 0.0 { z = FAR; }
    if WEIGHTED { if textureLoad(weight, px, 0).x <= 0.0 { return; } }
    let x = vec2f(px) + way(px);        // in pixels whose centres are integers
    if any(abs(x) > vec2f(1e6)) { return; }
    let base = vec2i(floor(x));
    let size = vec2i(frame.size);
    let behind = select(0u, NEIGHBOUR, slice.source > 0u);
    let number = (slice.source << SOURCE_BITS) | (px.y << ROW_BIT) | px.x;
    for (var i = 0u; i < 4u; i++) {
        let to = base + vec2i(vec2u(i & 1u, i >> 1u));
        if any(to < vec2i(0)) || any(to >= size) { continue; }
        let off = abs(vec2f(to) - x);
        if off.x >= 1.0 || off.y >= 1.0 { continue; }
        let at = to.y * size.x + to.x;
        // Bits of positive floats are in their order; a neighbouring frame's come after all of the
        // frame's own: its samples fill what the frame itself does not show, and spoil nothing.
        let key = bitcast<u32>(z * (1.0 + OFF_CENTRE * (off.x + off.y))) | behind;
        if !decide {
            atomicMin(&nearest[at], key);
        } else {
            // Only loops that are not entered save time on every driver.
            let wins = select(0u, 1u, key == atomicLoad(&nearest[at]));
            for (var k = 0u; k < wins; k++) { atomicMin(&winner[at], number); }
        }
    }
}
