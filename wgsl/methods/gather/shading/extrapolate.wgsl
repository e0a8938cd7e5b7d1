// What the flow to a neighbour explains, and flow to one that does not show it: what a body hides there. Flow to the other
// neighbour, turned round, takes its place where it explains clearly more.
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/moving.wgsl
//#include methods/gather/shading/one_surface.wgsl

@group(1) @binding(0) var flow_other: texture_2d<f32>;      // stored as rgba16float: to the other neighbour; trust
@group(1) @binding(1) var change: texture_2d<f32>;          // stored as rgba16float, by gain.wgsl; a: 1 where the neighbour shows the surface
@group(1) @binding(2) var differences: Differences;         // from frame to frame: with the flow, without, with what is turned round
@group(1) @binding(3) var around: texture_2d<f32>;          // stored as rgba32float: these, blurred, at half the size
@group(1) @binding(4) var around_other: texture_2d<f32>;    // stored as rgba32float: those to the other neighbour
@group(1) @binding(5) var flow_out: Flow;                   // flow [px], trust, how much it explains, both 0..1

alias Differences = texture_storage_2d<rgba32float, write>;
alias Flow = texture_storage_2d<rgba16float, write>;

const CLEARLY: f32 = 0.75;      // share of the other flow's differences below which those of what is turned round are
const MISSED: f32 = 0.85;       // share of the differences without flow from which on it explains nothing,
const EXPLAINED: f32 = 0.6;     // and up to which it explains them

/// Differences of what moves. What a body hides in either frame differs from nothing.
@compute @workgroup_size(WG_X, WG_Y)
fn explain(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let x = vec2f(id) + 0.5;
    let own = textureLoad(values, id, 0).a;
    let other = textureLoad(values_there, id, 0).a;
    let ahead = values_there_at(x + textureLoad(flow, id, 0).xy).a;
    let back = values_at(x + textureLoad(flow_back, id, 0).xy).a;
    let found = abs(ahead - own) + abs(back - other);
    let turned = textureLoad(flow_other, id, 0);
    let to = x - turned.xy;
    let was = came_from(x, turned.xy);
    let landing = inside(vec2i(floor(to)));
    let is_there = is_one_surface(vec2i(id), landing) && textureLoad(change, landing, 0).a > 0.0;
    let is_here = is_one_surface(vec2i(id), vec2i(floor(was))) && textureLoad(change, id, 0).a > 0.0;
    let extrapolated = select(0.0, abs(values_there_at(to).a - own), is_there)
        + select(0.0, abs(values_at(was).a - other), is_here);
    let differs = vec3f(found, 2.0 * abs(other - own), mix(found, extrapolated, turned.z));
    textureStore(differences, id, vec4f(differs, 0.0));
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

/// The flow that explains more.
@compute @workgroup_size(WG_X, WG_Y)
fn choose(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let own = textureLoad(flow, id, 0);
    let turned = textureLoad(flow_other, id, 0);
    let s = square_within(half_size(), 0.5 * (vec2f(id) + 0.5));
    let differs = mixed(s, textureLoad(around, s.pair.xy, 0), textureLoad(around, s.pair.zy, 0),
                        textureLoad(around, s.pair.xw, 0), textureLoad(around, s.pair.zw, 0));
    let differs_other = mixed(s, textureLoad(around_other, s.pair.xy, 0), textureLoad(around_other, s.pair.zy, 0),
                              textureLoad(around_other, s.pair.xw, 0), textureLoad(around_other, s.pair.zw, 0));
    let explains = explained(differs.x, differs.y);
    let other_explains = explained(differs.z, differs.y) * explained(differs_other.x, differs_other.y);
    let is_better = turned.z * other_explains > own.z * explains && differs.z < CLEARLY * differs.x;
    let extrapolated = vec4f(-turned.xy, turned.z, other_explains);
    textureStore(flow_out, id, select(vec4f(own.xyz, explains), extrapolated, is_better));
}

/// How much is explained, 0 to 1, by what differs with flow and without.
fn explained(found: f32, still: f32) -> f32 {
    return clamp((MISSED - found / max(still, 1e-4)) / (MISSED - EXPLAINED), 0.0, 1.0);
}
