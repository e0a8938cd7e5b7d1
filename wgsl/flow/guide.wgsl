// From coarse to fine: the smooth motion that a picture seems to have from afar, where what repeats on it is too small
// to be seen. A displacement to the near frame and one to the far frame for each pixel.
//#include common/loops.wgsl
//#include flow/search_patch.wgsl

struct Guide {
    to_near: mat4x4f,   // homography of most of the picture: columns of 3, from pixels to pixels
    to_far: mat4x4f,
    reach: i32,         // displacements that are tried around each that is given, along either axis [px]
    begins: u32,        // 1 on the coarsest level, where most of the picture gives the only one
    unused: vec2u,
}

@group(1) @binding(5) var<uniform> guide: Guide;
@group(1) @binding(6) var ways: texture_2d_array<f32>;      // displacements to the near frame and the far one; for
                                                            // `descend` the coarser level's
@group(1) @binding(7) var output: StatesOut;

const AWAY_PRICE: f32 = 0.02;       // per px from a given displacement
const GIVEN: u32 = 5u;              // the pixel's own on the coarser level, and those beside it
const COUNT: i32 = 9;               // pixels of a median

fn displaced(homography: mat4x4f, x: vec2f) -> vec2f {
    let at = homography * vec4f(x, 1.0, 0.0);
    return at.xy / at.z - x;
}

/// Displacements to both frames from which is searched.
fn given(px: vec2i, k: u32) -> vec4i {
    if guide.begins == 1u {
        let x = vec2f(px) + 0.5;
        return vec4i(round(vec4f(displaced(guide.to_near, x), displaced(guide.to_far, x))));
    }
    let along = vec2i(1 - 2 * i32(k % 2u), 0);
    let by = select(select(along, along.yx, k >= 3u), vec2i(0), k == 0u);
    let at = clamp(px / 2 + by, vec2i(0), vec2i(textureDimensions(ways)) - 1);
    return 2 * vec4i(round(textureLoad(ways, at, 0, 0)));
}

fn better(found: vec3f, by: vec2i, cost: f32) -> vec3f {
    return select(found, vec3f(vec2f(by), cost), cost < found.z);
}

@compute @workgroup_size(WG_X, WG_Y)
fn descend(@builtin(global_invocation_id) id: vec3u) {
    let px = vec2i(min(id.xy, frame.size - 1u));
    load_search_patch(px);
    var to_near = vec3f(0.0, 0.0, 2.0 * OUTSIDE);
    var to_far = to_near;
    let side = 2 * guide.reach + 1;
    let turns = turns_of(u32(side * side), id.x);
    let starts = select(GIVEN, 1u, guide.begins == 1u);
    for (var k = 0u; k < starts; k++) {
        let start = given(px, k);
        for (var turn = 0u; turn < turns; turn++) {
            let by = vec2i(i32(turn) % side, i32(turn) / side) - guide.reach;
            let away = AWAY_PRICE * f32(abs(by.x) + abs(by.y));
            let n = whole_cost(near, px + start.xy + by, to_near.z - away);
            to_near = better(to_near, start.xy + by, n + away);
            if VIEWS == AROUND {
                let f = whole_cost(far, px + start.zw + by, to_far.z - away);
                to_far = better(to_far, start.zw + by, f + away);
            }
        }
    }
    if all(id.xy < frame.size) { textureStore(output, id.xy, 0, vec4f(to_near.xy, to_far.xy)); }
}

/// The displacement, of those of 3 x 3 pixels, that is nearest to all of them.
@compute @workgroup_size(WG_X, WG_Y)
fn median(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var least = vec2f(1e9);
    var found = vec4f(0.0);
    for (var i = 0; i < COUNT; i++) {
        let own = neighbour(vec2i(id.xy), i);
        var sum = vec2f(0.0);
        for (var k = 0; k < COUNT; k++) {
            let d = abs(own - neighbour(vec2i(id.xy), k));
            sum += d.xz + d.yw;
        }
        found = select(found, own, (sum < least).xxyy);
        least = min(least, sum);
    }
    textureStore(output, id.xy, 0, found);
}

fn neighbour(px: vec2i, k: i32) -> vec4f {
    let by = vec2i(k % 3, k / 3) - 1;
    return textureLoad(ways, clamp(px + by, vec2i(0), vec2i(frame.size) - 1), 0, 0);
}

/// States that lead where the guide does.
@compute @workgroup_size(WG_X, WG_Y)
fn write_states(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let own = textureLoad(ways, id.xy, 0, 0);
    let bend = select(vec2f(0.0), own.zw - view.far_factor * own.xy, VIEWS == AROUND);
    textureStore(output, id.xy, 0, vec4f(own.xy, bend));
    textureStore(output, id.xy, 1, vec4f(0.0));
}
