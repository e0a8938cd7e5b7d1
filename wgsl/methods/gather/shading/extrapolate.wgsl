// What the flow to a neighbour explains, and flow where none can be found, as a body hides what moves: the flow to the other
// neighbour, turned round, and the motion of a body near it, which its shadow shares. They count where they explain clearly
// more.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/moving.wgsl
//#include methods/gather/shading/one_surface.wgsl
//#include methods/gather/shading/changes/side.wgsl

@group(1) @binding(0) var flow_other: texture_2d<f32>;      // stored as rgba16float: to the other neighbour; trust
@group(1) @binding(1) var change: texture_2d<f32>;          // stored as rgba16float, by gain.wgsl; a: 1 where the neighbour shows the surface
@group(1) @binding(2) var bodies: texture_2d<f32>;          // stored as rgba16float, by `find_bodies` or `choose_body`
@group(1) @binding(3) var around: texture_2d<f32>;          // stored as rgba32float: `weighted`, blurred, at half the size; of `choose_body`, by `compare_bodies`
@group(1) @binding(4) var around_other: texture_2d<f32>;    // stored as rgba32float: the same from the other neighbour; 1 x 1: there is none
@group(1) @binding(5) var flow_out: Flow;                   // flow [px], trust, how much it explains, both 0..1; of `choose` trust, of `settle` the last less than 0 where it is not searched
@group(1) @binding(11) var weighted: Weighted;              // of `explain`: differences with flow, without, with the other's, with the body's; of `compare_bodies`: with each of the motions; of `weigh`: flow times weight, weight
@group(1) @binding(12) var depth: texture_2d<f32>;          // stored as given
@group(1) @binding(13) var motion: texture_2d<f32>;         // stored as given: to_prev, to_next [px]
@group(1) @binding(14) var bodies_out: Flow;                // of cells of CELL x CELL pixels, relative to the surface: to_prev, to_next [px]; 0 where there is none
@group(1) @binding(15) var others: texture_2d<f32>;         // stored as rgba16float, by `find_bodies`
@group(1) @binding(16) var others_out: Flow;                // as `bodies_out`: of bodies that move otherwise
@group(1) @binding(17) var values_other: texture_2d<f32>;    // stored as rgba16float: of the other neighbour; 1 x 1: there is none
@group(1) @binding(18) var<uniform> side: Side;

alias Flow = texture_storage_2d<rgba16float, write>;
alias Weighted = texture_storage_2d<rgba32float, write>;

override COLORS: bool = false;  // the light is the picture itself: its differences may be texture, so that a guess has to explain more
override SURE: f32 = select(0.5, 0.75, COLORS);             // how much the motion of a body has to explain
override BODY_CLEARLY: f32 = select(0.83, 0.75, COLORS);    // as CLEARLY, of a body
override HIDDEN: f32 = select(0.3, 1.0, COLORS);    // share of the difference without motion that counts where a body hides the other place

// On static surfaces, unless requested, flow has to explain nearly all.
override MISSED: f32 = select(0.85, 0.45, RESTING); // share of the differences without flow from which on it explains nothing,
override EXPLAINED: f32 = select(0.6, 0.2, RESTING);    // and up to which it explains them

const CLEARLY: f32 = 0.75;      // share of other differences from which on less is clearly less
const SOME: f32 = 0.01;         // weight around from which on flow is known there,
const ENOUGH: f32 = 0.05;       // and from which on it explains colours that rest as far as it fits
const UNLIKE: f32 = 0.3;        // difference of values from which on flow around does not fit
const ALONE_COUNTS: f32 = 4.0;  // how much of a difference it is that this frame alone is bright
const CELL: u32 = 4u;           // side [px]
const RINGS: u32 = 8u;          // around a cell, in which bodies are looked for,
const FIRST_RING: f32 = 3.0;    // [px]
const RING_GROWTH: f32 = 1.6;   // the last one is 80 px away
const DIRECTIONS: u32 = 12u;
const TURN: vec2f = vec2f(0.8660254, 0.5);  // cosine and sine of the angle between them
const MOVES: f32 = 1.0;         // least motion of a body relative to the surface [px]
const NEARER: f32 = 1.02;       // ratio of the depths of a surface and of a body before it
const BEYOND: f32 = 2.0;        // from a pixel of a body outwards to one that moves alike [px]:
const ALIKE: f32 = 0.5;         // motions that differ by less [px]
const ALIKE_SHARE: f32 = 0.05;  // and this share: edges do not tell a motion, nor do bodies that spin
const OTHERWISE: f32 = 0.5;     // share of a motion by which another one differs
const MOTIONS: u32 = 4u;        // that a shadow may have: see `motion_of`
const LESS: f32 = 0.88;         // share of a body's motion that its shadow may have
const LESS_DIFFERS: f32 = 0.95; // share of the difference with a motion before it from which on a motion is better
const PLACES: i32 = 5;          // along a side, at which a cell's motions are compared,
const APART: i32 = 5;           // from one to the next [px]

/// The motion of the nearest body before a cell's surface, of several as near the one with the least depth; and that of the nearest
/// one that moves otherwise.
@compute @workgroup_size(WG_X, WG_Y)
fn find_bodies(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_part(group, local, CELL);
    if any(id >= (frame.size + CELL - 1u) / CELL) { return; }
    let px = middle_of(id);
    let own = textureLoad(motion, px, 0);
    let z = valid_depth(textureLoad(depth, px, 0).x) / NEARER;
    var nearest = vec4f(0.0);
    var other = vec4f(0.0);
    var reach = FIRST_RING;
    for (var ring = 0u; ring < RINGS; ring++) {
        let is_known = any(nearest != vec4f(0.0));
        var found = nearest;
        var least = z;
        var along = vec2f(1.0, 0.0);
        let turns = select(0u, DIRECTIONS, all(other == vec4f(0.0)));
        for (var k = 0u; k < turns; k++) {
            let near = inside(px + vec2i(round(reach * along)));
            let beyond = inside(px + vec2i(round((reach + BEYOND) * along)));
            let apart = textureLoad(motion, near, 0) - own;
            let bends = textureLoad(motion, beyond, 0) - own - apart;
            let z_near = valid_depth(textureLoad(depth, near, 0).x);
            let is_body = longest(apart) > MOVES && longest(bends) <= ALIKE + ALIKE_SHARE * length(apart) && z_near < least;
            let is_other = is_body && is_known && longest(apart - nearest) > OTHERWISE * length(nearest);
            let is_nearest = is_body && !is_known;
            least = select(least, z_near, is_nearest || is_other);
            found = select(found, apart, is_nearest);
            other = select(other, apart, is_other);
            along = vec2f(along.x * TURN.x - along.y * TURN.y, along.x * TURN.y + along.y * TURN.x);
        }
        nearest = found;
        reach *= RING_GROWTH;
    }
    textureStore(bodies_out, id, nearest);
    textureStore(others_out, id, other);
}

/// The pixel that stands for a cell.
fn middle_of(cell: vec2u) -> vec2i {
    return inside(vec2i(CELL * cell + CELL / 2u));
}

/// The length of the longer of two motions.
fn longest(both: vec4f) -> f32 {
    return max(length(both.xy), length(both.zw));
}

/// The `k`th motion that the shadow in a cell may have: that of either body, and less of it. 0: there is none.
fn motion_of(cell: vec2u, k: u32) -> vec4f {
    let nearest = textureLoad(bodies, cell, 0);
    let other = textureLoad(others, cell, 0);
    return select(1.0, LESS, k % 2u == 1u) * select(nearest, other, k > 1u);
}

/// The differences around a cell with each of its motions; none where there is no shadow in either frame.
@compute @workgroup_size(WG_X, WG_Y)
fn compare_bodies(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_part(group, local, CELL);
    if any(id >= (frame.size + CELL - 1u) / CELL) { return; }
    let middle = middle_of(id);
    var darkest = 0.0;
    for (var k = 0; k < PLACES * PLACES; k++) {
        let place = place_around(middle, k);
        darkest = max(darkest, max(textureLoad(values, place, 0).a, textureLoad(values_there, place, 0).a));
    }
    let is_one = all(textureLoad(others, id, 0) == vec4f(0.0));
    let is_none = all(textureLoad(bodies, id, 0) == vec4f(0.0));
    let motions = select(MOTIONS, MOTIONS / 2u, is_one);
    let count = select(0, PLACES * PLACES, darkest > PRESENT && !is_none);
    var sums = vec4f(0.0);
    for (var k = 0; k < count; k++) {
        let place = place_around(middle, k);
        let x = vec2f(place) + 0.5;
        let turns = select(0u, motions, is_one_surface(middle, place));
        for (var n = 0u; n < turns; n++) {
            let both = motion_of(id, n);
            let way = select(both.xy, both.zw, side.next == 1u);
            sums[n] += differs_by(vec2u(place), x + way, x - way, HIDDEN);
        }
    }
    textureStore(weighted, id, sums);
}

/// Of the places around a cell's middle.
fn place_around(middle: vec2i, k: i32) -> vec2i {
    return inside(middle + APART * (vec2i(k % PLACES, k / PLACES) - PLACES / 2));
}

/// The motion with which the least differs, from both neighbours together.
@compute @workgroup_size(WG_X, WG_Y)
fn choose_body(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_part(group, local, CELL);
    if any(id >= (frame.size + CELL - 1u) / CELL) { return; }
    let id_other = min(id, textureDimensions(around_other) - 1u);
    let differs = textureLoad(around, id, 0) + textureLoad(around_other, id_other, 0);
    var best = motion_of(id, 0u);
    var least = differs.x;
    for (var k = 1u; k < MOTIONS; k++) {
        let one = motion_of(id, k);
        let is_better = any(one != vec4f(0.0)) && differs[k] < LESS_DIFFERS * least;
        best = select(best, one, is_better);
        least = select(least, differs[k], is_better);
    }
    textureStore(bodies_out, id, best);
}

/// The motion of a pixel's body to the neighbour, relative to the surface [px].
fn body_at(id: vec2u) -> vec2f {
    let cell = id / CELL;
    let both = textureLoad(bodies, cell, 0);
    return select(both.xy, both.zw, side.next == 1u);
}

/// Differences of moving light from frame to frame.
@compute @workgroup_size(WG_X, WG_Y)
fn explain(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let x = vec2f(id) + 0.5;
    let is_seen = textureLoad(change, id, 0).a > 0.0;
    let still = select(HIDDEN, 1.0, is_seen) * stays_by(id);
    let searched = differs_by(id, x + textureLoad(flow, id, 0).xy, x + textureLoad(flow_back, id, 0).xy, select(HIDDEN, 1.0, is_seen));
    let turned = textureLoad(flow_other, id, 0);
    let extrapolated = differs_by(id, x - turned.xy, came_from(x, turned.xy), 0.0);
    let body = body_at(id);
    let as_body = differs_by(id, x + body, x - body, HIDDEN);
    let found = vec4f(searched, 2.0 * still, mix(searched, extrapolated, turned.z),
                      select(as_body, searched, all(body == vec2f(0.0))));
    textureStore(weighted, id, found + alone_bright(id) * vec4f(1.0, 0.0, 1.0, 1.0));
}

/// How much brighter this frame is than both neighbours: where a reflection is that moves, and hardly where a shadow does.
fn alone_bright(id: vec2u) -> f32 {
    if !RESTING || textureDimensions(values_other).x == 1u { return 0.0; }
    let around = min(textureLoad(values_there, id, 0).a, textureLoad(values_other, id, 0).a);
    return ALONE_COUNTS * max(around - textureLoad(values, id, 0).a, 0.0);
}

/// The difference of a pixel without motion. Where the neighbour does not show it, all that is there; of colours nothing.
fn stays_by(id: vec2u) -> f32 {
    let own = textureLoad(values, id, 0).a;
    let differs = abs(textureLoad(values_there, id, 0).a - own);    // 0 where it is not shown
    return select(own, differs, COLORS || textureLoad(change, id, 0).a > 0.0);
}

/// The difference of a pixel from the neighbour at `to`, and of the neighbour's from the frame at `was` [px]. Where one of them is not
/// seen on the pixel's surface, that without motion; where a body hides it, the share `hidden` of that.
fn differs_by(id: vec2u, to: vec2f, was: vec2f, hidden: f32) -> f32 {
    let px = vec2i(id);
    let landing = inside(vec2i(floor(to)));
    let origin = inside(vec2i(floor(was)));
    let goes_on = is_one_surface(px, vec2i(floor(to)));
    let came = is_one_surface(px, vec2i(floor(was)));
    let is_there = goes_on && textureLoad(change, landing, 0).a > 0.0;
    let is_here = came && textureLoad(change, id, 0).a > 0.0;
    let own = textureLoad(values, id, 0).a;
    let other = textureLoad(values_there, id, 0).a;
    let still = stays_by(id);
    let unseen = still * select(1.0, hidden, goes_on || is_before(landing, px));
    let unseen_here = still * select(1.0, hidden, came || is_before(origin, px));
    return select(unseen, abs(values_there_at(to).a - own), is_there)
        + select(unseen_here, abs(values_at(was).a - other), is_here);
}

/// True if the surface at `a` is nearer than that at `b`. False where light rests: hidden surfaces are no evidence there.
fn is_before(a: vec2i, b: vec2i) -> bool {
    return textureLoad(planes, a, 0).x > NEARER * textureLoad(planes, b, 0).x;
}

/// The place of this frame [px] from which extrapolated flow leads to `x`, by a first guess of the way back to it.
fn came_from(x: vec2f, way: vec2f) -> vec2f {
    var at = x + way;
    for (var k = 0; k < 2; k++) {
        let near = inside(vec2i(floor(at)));
        at = x + textureLoad(flow_other, near, 0).xy;
    }
    return at;
}

/// The flow that explains most.
@compute @workgroup_size(WG_X, WG_Y)
fn choose(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let searched = textureLoad(flow, id, 0);
    let turned = textureLoad(flow_other, id, 0);
    let s = square_within(half_size(), 0.5 * (vec2f(id) + 0.5));
    let differs = mixed(s, textureLoad(around, s.pair.xy, 0), textureLoad(around, s.pair.zy, 0),
                        textureLoad(around, s.pair.xw, 0), textureLoad(around, s.pair.zw, 0));
    let differs_other = mixed(s, textureLoad(around_other, s.pair.xy, 0), textureLoad(around_other, s.pair.zy, 0),
                              textureLoad(around_other, s.pair.xw, 0), textureLoad(around_other, s.pair.zw, 0));
    var best = vec4f(searched.xyz, explained(differs.x, differs.y));
    var least = differs.x;
    let other_explains = explained(differs.z, differs.y) * explained(differs_other.x, differs_other.y);
    if turned.z * other_explains > best.z * best.w && differs.z < CLEARLY * differs.x {
        best = vec4f(-turned.xyz, other_explains);
    }
    let body = body_at(id);
    let both = differs + differs_other;     // a body moves from neighbour to neighbour
    let body_explains = explained(both.w, both.y);
    let has_to = max(SURE, searched.z * explained(both.x, both.y));
    if any(body != vec2f(0.0)) && body_explains > has_to && both.w < BODY_CLEARLY * both.x {
        best = vec4f(body, -1.0, body_explains);
    }
    textureStore(flow_out, id, best);
}

/// The share of the difference that flow explains, 0 to 1.
fn explained(found: f32, still: f32) -> f32 {
    return clamp((MISSED - found / max(still, 1e-4)) / (MISSED - EXPLAINED), 0.0, 1.0);
}

/// Flow that is not searched, by how much it explains.
@compute @workgroup_size(WG_X, WG_Y)
fn weigh(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let own = textureLoad(flow, id, 0);
    let weight = max(-own.z, 0.0) * own.w * min(textureLoad(values, id, 0).a / PRESENT, 1.0);
    textureStore(weighted, id, vec4f(weight * own.xy, weight, 0.0));
}

/// It takes the place of flow around it that explains nothing, within a shadow where nothing differs, if the light there fits.
@compute @workgroup_size(WG_X, WG_Y)
fn settle(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let chosen = textureLoad(flow, id, 0);
    let own = vec4f(chosen.xy, abs(chosen.z), chosen.w);
    let s = square_within(half_size(), 0.5 * (vec2f(id) + 0.5));
    let near = mixed(s, textureLoad(around, s.pair.xy, 0), textureLoad(around, s.pair.zy, 0),
                     textureLoad(around, s.pair.xw, 0), textureLoad(around, s.pair.zw, 0));
    let way = near.xy / max(near.z, 1e-4);
    let to = vec2f(id) + 0.5 + way;
    let landing = inside(vec2i(floor(to)));
    let is_there = is_one_surface(vec2i(id), landing) && textureLoad(change, landing, 0).a > 0.0;
    let differs = abs(values_there_at(to).a - textureLoad(values, id, 0).a);
    let fits = select(1.0, 1.0 - min(differs / UNLIKE, 1.0), is_there);
    let keep = select(max(own.z * own.w, 1.0 - fits), 0.0, chosen.z < 0.0);     // a body's is smooth
    let explains = select(own.w, max(own.w, fits * min(near.z / ENOUGH, 1.0)), RESTING);
    let filled = vec4f(mix(way, own.xy, keep), mix(1.0, own.z, keep), explains);
    let is_known = near.z > SOME;
    let result = select(own, filled, is_known);
    let is_searched = chosen.z >= 0.0 && !is_known;
    textureStore(flow_out, id, vec4f(result.xyz, select(-result.w, result.w, is_searched)));
}
