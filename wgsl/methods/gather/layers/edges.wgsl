// Edges: the pixels that may show two surfaces, which layers.wgsl separates, and the tiles where it does not.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/motion.wgsl
//#include methods/gather/surface.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/layers/edge_flags.wgsl
//#include methods/gather/layers/crowd.wgsl

@group(1) @binding(5) var edge_flags_out: Flags;        // see flag_depth()
@group(1) @binding(9) var<storage, read> worklist: WorkList;

alias Flags = texture_storage_2d<r32uint, write>;

// From this difference on [px], motions tell surfaces apart as well: the depth ratio that is asked for shrinks with it,
// down to LEAST_SHARE of its difference from 1, which is above the rounding of half floats.
const APART_MOTION: f32 = 4.0;
const LEAST_SHARE: f32 = 0.1;
const FAST: f32 = 2.0;          // difference of the motions at an edge that tells whether vectors are filtered [px],
const MIXED: f32 = 0.2;         // where they differ by more than this share of it on the same side of the edge
const SLOW_MOTION: f32 = 0.5;   // how far surfaces move apart, at most, that hardly do while the shutter is open, by both vectors [px];
const WIDE_MOTION: f32 = 8.0;   // the same of a wide front's own pixels, as a rule: beside it, the 5 x 5 show less of it;
const RAMP_MOTION: f32 = 0.85;   // the same where it is no edge if motions change as much around it:
const RAMP_SHARE: f32 = 0.6;    // by more than this share
const WHOLE_SQUARES: u32 = 0x1ce7u; // of the 5 x 5 bits, the first three of the first three rows: 3 x 3 that begin there end within

/// First pass: a pixel is at an edge if depths differ in its 3 x 3, and motions from its own too. The more motions differ,
/// the less depths have to: motions that differ so much are no smooth surface.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn detect_edges(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let px = vec2i(pixel_in_strip(worklist.cells[k], group, local));
    if k >= worklist.count || any(px >= vec2i(frame.size)) { return; }
    let above = three_depths(px - vec2i(0, 1));
    let here = three_depths(px);
    let below = three_depths(px + vec2i(0, 1));
    let least = min(min(above, here), below);
    let most = max(max(above, here), below);
    let nearest = min(min(least.x, least.y), least.z);
    let farthest = max(max(most.x, most.y), most.z);
    let own = textureLoad(motion, px, 0);
    let between = select(sqrt(nearest * farthest), 1.5 * nearest, farthest >= NO_DEPTH);
    let is_front = here.y < between;
    var same2 = 0.0;            // squared difference from motions on its own side of the edge, and on the other
    var other2 = 0.0;
    let beyond = farthest - nearest;
    let apart = nearest * (SURFACE_DEPTH_RATIO * SURFACE_DEPTH_RATIO - 1.0);   // the 3 x 3 is two pixels from side to side
    let count = select(0, 9, beyond > LEAST_SHARE * apart);
    for (var i = 0; i < count; i++) {
        let near = inside(px + vec2i(i % 3, i / 3) - 1);
        let difference = textureLoad(motion, near, 0) - own;
        let row = select(select(below, here, i < 6), above, i < 3);
        let is_same = (row[i % 3] < between) == is_front;
        same2 = max(same2, select(0.0, dot(difference, difference), is_same));
        other2 = max(other2, select(dot(difference, difference), 0.0, is_same));
    }
    let difference2 = max(same2, other2);
    let share = clamp(APART_MOTION * inverseSqrt(max(difference2, 1e-12)), LEAST_SHARE, 1.0);
    let longest = max_abs_time(0.0);
    let apart2 = difference2 * longest * longest;
    let may_be = difference2 > EDGE_MOTION * EDGE_MOTION && beyond > share * apart;
    let is_there = may_be && !is_ramp(px, may_be && apart2 < RAMP_MOTION * RAMP_MOTION);
    if is_there {
        let low = nearest + apart;
        let high = farthest / (SURFACE_DEPTH_RATIO * SURFACE_DEPTH_RATIO);
        let has_third = any(are_between(above, low, high) | are_between(here, low, high) | are_between(below, low, high));
        if has_third { count_edge(px, THIRD_SURFACE); }
        if difference2 > FAST * FAST {
            count_edge(px, FAST_EDGE);
            if same2 > MIXED * MIXED * other2 { count_edge(px, MIXED_EDGE); }
        }
    }
    let wide = is_wide(px, between, is_there && apart2 < WIDE_MOTION * WIDE_MOTION);
    let is_slow = wide || apart2 < SLOW_MOTION * SLOW_MOTION;
    textureStore(edge_flags_out, px, vec4u(flag_depth(here.y, is_there, is_slow)));
}

/// True if motions change before and after a pixel, across or down, as they do beside it: in the rim of a body out of focus, over
/// which renderers average them. Not looked for unless `wanted`.
fn is_ramp(px: vec2i, wanted: bool) -> bool {
    var result = false;
    for (var i = 0; i < select(0, 2, wanted); i++) {
        let along = vec2i(1 - i, i);
        let just_before = inside(px - along);
        let just_after = inside(px + along);
        let far_before = inside(px - 3 * along);
        let far_after = inside(px + 3 * along);
        let low = textureLoad(motion, just_before, 0);
        let high = textureLoad(motion, just_after, 0);
        let change = high - low;
        let change2 = dot(change, change);
        let before = dot(low - textureLoad(motion, far_before, 0), change);
        let after = dot(textureLoad(motion, far_after, 0) - high, change);
        result = result || (change2 > EDGE_MOTION * EDGE_MOTION && min(before, after) > RAMP_SHARE * change2);
    }
    return result;
}

/// True if, in the 5 x 5 around an edge, some 3 x 3 pixels are all in front; not looked for unless `wanted`.
fn is_wide(px: vec2i, between: f32, wanted: bool) -> bool {
    var front = 0u;             // a bit per pixel, row by row
    for (var i = 0; i < select(0, 25, wanted); i++) {
        front |= u32(depth_at(px + vec2i(i % 5, i / 5) - 2) < between) << u32(i);
    }
    let threes = front & (front >> 1u) & (front >> 2u);     // of a row
    let squares = threes & (threes >> 5u) & (threes >> 10u);
    return (squares & WHOLE_SQUARES) != 0u;
}

/// Of a pixel and the ones to its left and right. Written out, like all code on 3 x 3 pixels: lavapipe unrolls no loop.
fn three_depths(px: vec2i) -> vec3f {
    return vec3f(depth_at(px - vec2i(1, 0)), depth_at(px), depth_at(px + vec2i(1, 0)));
}

fn are_between(z: vec3f, low: f32, high: f32) -> vec3<bool> {
    return (z > vec3f(low)) & (z < vec3f(high));
}

/// Second pass: the surroundings of a tile. An invocation is a tile; beyond the last, that one.
@compute @workgroup_size(WG_X, WG_Y)
fn look_around_tiles(@builtin(global_invocation_id) id: vec3u) {
    look_around(min(id.xy, tiles_of(frame.size) - 1u));
}
