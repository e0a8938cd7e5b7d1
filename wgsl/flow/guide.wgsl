// From coarse to fine: the smooth motion that a picture seems to have from afar, where repeating texture is too small
// to be seen. A displacement to the near frame and one to the far frame for each pixel.
//#include common/loops.wgsl
//#include flow/band.wgsl
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

var<private> starts: array<vec2i, GIVEN>;   // displacements to one frame around which is searched

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

/// True if displacement `k` is not beside one of the starts before its own.
fn is_new(k: u32, area: u32) -> bool {
    let by = displacement(k, area);
    var is_first = true;
    for (var j = 0u; j < k / area; j++) {
        let away = abs(by - starts[j]);
        is_first = is_first && max(away.x, away.y) > guide.reach;
    }
    return is_first;
}

/// Displacement `k` of those around the starts.
fn displacement(k: u32, area: u32) -> vec2i {
    let side = 2 * guide.reach + 1;
    let place = i32(k % area);
    return starts[k / area] + vec2i(place % side, place / side) - guide.reach;
}

/// The best displacement to another frame of those around the starts: each is tried once.
fn descended(px: vec2i, other: texture_2d_array<f32>, count: u32) -> vec2f {
    let side = u32(2 * guide.reach + 1);
    let turns = turns_of(count * side * side, u32(px.x));
    var found = vec3f(0.0, 0.0, 2.0 * OUTSIDE);
    var k = 0u;
    loop {
        let by = displacement(k, side * side);
        var away = 1 << 20;
        for (var j = 0u; j < count; j++) {
            let d = abs(by - starts[j]);
            away = min(away, d.x + d.y);
        }
        let price = AWAY_PRICE * f32(away);
        let cost = price + whole_cost(other, px + by, found.z - price);
        found = select(found, vec3f(vec2f(by), cost), cost < found.z);
        loop {
            k++;
            if k >= turns || is_new(k, side * side) { break; }
        }
        if k >= turns { break; }
    }
    return found.xy;
}

@compute @workgroup_size(WG_X, WG_Y)
fn descend(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let px = vec2i(min(id, frame.size - 1u));
    load_search_patch(px);
    let count = select(GIVEN, 1u, guide.begins == 1u);
    for (var k = 0u; k < count; k++) { starts[k] = given(px, k).xy; }
    var ways_here = vec4f(descended(px, near, count), 0.0, 0.0);
    if VIEWS == AROUND {
        for (var k = 0u; k < count; k++) { starts[k] = given(px, k).zw; }
        ways_here = vec4f(ways_here.xy, descended(px, far, count));
    }
    if all(id < frame.size) { textureStore(output, id, 0, ways_here); }
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
    return textureLoad(ways, inside(px + by), 0, 0);
}
