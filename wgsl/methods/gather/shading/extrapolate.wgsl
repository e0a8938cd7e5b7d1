// What the flow to a neighbour explains, and flow where none can be found, as a body hides what moves: the flow to the other
// neighbour, turned round, and the motion of the nearest body, which a shadow that touches it shares. They count where
// they explain clearly more.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/moving.wgsl
//#include methods/gather/shading/one_surface.wgsl

@group(1) @binding(0) var flow_other: texture_2d<f32>;      // stored as rgba16float: to the other neighbour; trust
@group(1) @binding(1) var change: texture_2d<f32>;          // stored as rgba16float, by gain.wgsl; a: 1 where the neighbour shows the surface
@group(1) @binding(2) var bodies: texture_2d<f32>;          // stored as rgba16float, by `find_bodies`
@group(1) @binding(3) var around: texture_2d<f32>;          // stored as rgba32float: `differences` or `weighted`, blurred, at half the size
@group(1) @binding(4) var around_other: texture_2d<f32>;    // stored as rgba32float: differences from the other neighbour
@group(1) @binding(5) var flow_out: Flow;                   // flow [px], trust, how much it explains, both 0..1; of `choose` trust, of `settle` the last less than 0 where it is not searched
@group(1) @binding(11) var weighted: Weighted;              // of `explain`: differences with flow, without, with the other's, with the body's; of `weigh`: flow times weight, weight
@group(1) @binding(12) var depth: texture_2d<f32>;          // stored as given
@group(1) @binding(13) var motion: texture_2d<f32>;         // stored as given: to_prev, to_next [px]
@group(1) @binding(14) var bodies_out: Flow;                // of cells of CELL x CELL pixels, relative to the surface: to_prev, to_next [px]; 0 where there is none

alias Flow = texture_storage_2d<rgba16float, write>;
alias Weighted = texture_storage_2d<rgba32float, write>;

override NEXT: bool = false;    // the neighbour is the next frame

const CLEARLY: f32 = 0.75;      // share of other differences from which on less is clearly less
const MISSED: f32 = 0.85;       // share of the differences without flow from which on it explains nothing,
const EXPLAINED: f32 = 0.6;     // and up to which it explains them
const ENOUGH: f32 = 0.05;       // weight around from which on flow is known there
const SOME: f32 = 0.01;         // the same from which on it is told at all
const SURE: f32 = 0.75;         // how much the motion of a body has to explain
const UNLIKE: f32 = 0.3;        // difference of values from which on flow around does not fit
const CELL: u32 = 4u;           // side [px]
const RINGS: u32 = 6u;          // around a cell, in which bodies are looked for,
const FIRST_RING: f32 = 3.0;    // [px]
const RING_GROWTH: f32 = 1.6;   // the last one is 31 px away
const DIRECTIONS: u32 = 12u;
const TURN: vec2f = vec2f(0.8660254, 0.5);  // cosine and sine of the angle between them
const MOVES: f32 = 1.0;         // least motion of a body relative to the surface [px]
const NEARER: f32 = 1.02;       // ratio of the depths of a surface and of a body before it

/// The motion of the nearest body before a cell's surface; of several as near, of the one with the least depth.
@compute @workgroup_size(WG_X, WG_Y)
fn find_bodies(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_part(group, local, CELL);
    if any(id >= (frame.size + CELL - 1u) / CELL) { return; }
    let px = inside(vec2i(CELL * id + CELL / 2u));
    let own = textureLoad(motion, px, 0);
    let z = valid_depth(textureLoad(depth, px, 0).x);
    var found = vec4f(0.0);
    var reach = FIRST_RING;
    for (var ring = 0u; ring < RINGS; ring++) {
        var least = z / NEARER;
        var along = vec2f(1.0, 0.0);
        let turns = select(0u, DIRECTIONS, all(found == vec4f(0.0)));
        for (var k = 0u; k < turns; k++) {
            let near = inside(px + vec2i(round(reach * along)));
            let apart = textureLoad(motion, near, 0) - own;
            let z_near = valid_depth(textureLoad(depth, near, 0).x);
            let is_body = max(dot(apart.xy, apart.xy), dot(apart.zw, apart.zw)) > MOVES * MOVES && z_near < least;
            least = select(least, z_near, is_body);
            found = select(found, apart, is_body);
            along = vec2f(along.x * TURN.x - along.y * TURN.y, along.x * TURN.y + along.y * TURN.x);
        }
        reach *= RING_GROWTH;
    }
    textureStore(bodies_out, id, found);
}

/// The motion of the nearest body to the neighbour, relative to the surface [px].
fn body_at(id: vec2u) -> vec2f {
    let cell = id / CELL;
    let both = textureLoad(bodies, cell, 0);
    return select(both.xy, both.zw, NEXT);
}

/// Differences of what moves from frame to frame.
@compute @workgroup_size(WG_X, WG_Y)
fn explain(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let x = vec2f(id) + 0.5;
    let own = textureLoad(values, id, 0).a;
    let other = textureLoad(values_there, id, 0).a;
    let still = abs(other - own);
    let ahead = values_there_at(x + textureLoad(flow, id, 0).xy).a;
    let back = values_at(x + textureLoad(flow_back, id, 0).xy).a;
    let searched = abs(ahead - own) + abs(back - other);
    let turned = textureLoad(flow_other, id, 0);
    let extrapolated = differs_by(id, x - turned.xy, came_from(x, turned.xy), 0.0);
    let body = body_at(id);
    let as_body = differs_by(id, x + body, x - body, still);
    textureStore(weighted, id, vec4f(searched, 2.0 * still, mix(searched, extrapolated, turned.z),
                                     select(as_body, searched, all(body == vec2f(0.0)))));
}

/// The difference of a pixel from the neighbour at `to`, and of the neighbour's from the frame at `was` [px]; `hidden` for each of
/// them that a body hides.
fn differs_by(id: vec2u, to: vec2f, was: vec2f, hidden: f32) -> f32 {
    let landing = inside(vec2i(floor(to)));
    let is_there = is_one_surface(vec2i(id), landing) && textureLoad(change, landing, 0).a > 0.0;
    let is_here = is_one_surface(vec2i(id), vec2i(floor(was))) && textureLoad(change, id, 0).a > 0.0;
    let own = textureLoad(values, id, 0).a;
    let other = textureLoad(values_there, id, 0).a;
    return select(hidden, abs(values_there_at(to).a - own), is_there)
        + select(hidden, abs(values_at(was).a - other), is_here);
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
    if turned.z * other_explains > best.z * best.w && differs.z < CLEARLY * least {
        best = vec4f(-turned.xyz, other_explains);
        least = differs.z;
    }
    let body = body_at(id);
    let body_explains = explained(differs.w, differs.y);
    if any(body != vec2f(0.0)) && body_explains > max(abs(best.z) * best.w, SURE) && differs.w < CLEARLY * least {
        best = vec4f(body, -1.0, body_explains);
    }
    textureStore(flow_out, id, best);
}

/// How much is explained, 0 to 1, by what differs with flow and without.
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

/// It takes the place of flow around it that explains nothing, within a shadow where nothing differs, if what is there fits.
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
    let keep = max(own.z * own.w, 1.0 - fits);
    let explains = max(own.w, fits * min(near.z / ENOUGH, 1.0));
    let filled = vec4f(mix(way, own.xy, keep), mix(1.0, own.z, keep), explains);
    let result = select(own, filled, near.z > SOME);
    let is_searched = chosen.z >= 0.0 && near.z <= ENOUGH;
    textureStore(flow_out, id, vec4f(result.xyz, select(-result.w, result.w, is_searched)));
}
