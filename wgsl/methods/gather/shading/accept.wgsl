// Trust in the flow: it is trusted if it leads back, to equal darkness, along one surface. What is dark by itself, as the
// side of a box is, does not move to another side. Else the flow around replaces it.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/moving.wgsl
//#include methods/gather/shading/one_surface.wgsl

@group(1) @binding(0) var around: texture_2d<f32>;          // stored as rgba32float; of `fill`: `known`, blurred, at half the size
@group(1) @binding(1) var flow_out: Flow;                   // flow [px], trust 0..1
@group(1) @binding(2) var weighted: Weighted;               // flow times weight, weight, trust; of `find_planes`: see `planes`
@group(1) @binding(3) var depth: texture_2d<f32>;           // stored as given
@group(1) @binding(4) var known: texture_2d<f32>;           // stored as rgba32float; of `fill`: output of `weigh`

alias Flow = texture_storage_2d<rgba16float, write>;
alias Weighted = texture_storage_2d<rgba32float, write>;

const ASTRAY: f32 = 12.0;       // distance from where it came from up to which a way back is trusted wholly [px],
const ASTRAY_SHARE: f32 = 0.1;  // and this share of the flow; twice as far, not at all
const UNLIKE: f32 = 0.2;        // difference of values trusted wholly,
const UNLIKE_SHARE: f32 = 0.5;  // and this share of the value
const SLOPE_REACH: i32 = 2;     // [px] to either side, over which the slope of a surface is measured

/// Of the flow as it was found, weighted.
@compute @workgroup_size(WG_X, WG_Y)
fn weigh(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let by = textureLoad(flow, id, 0).xy;
    let value = textureLoad(values, id, 0).a;
    let trusted = trust_in(by, id, value);
    let weight = trusted * min(value / PRESENT, 1.0);
    textureStore(weighted, id, vec4f(weight * by, weight, trusted));
}

/// Untrusted flow is replaced by the flow around it.
@compute @workgroup_size(WG_X, WG_Y)
fn fill(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let own = textureLoad(flow, id, 0).xy;
    let trusted = textureLoad(known, id, 0).w;
    let near = around_at(vec2f(id) + 0.5);
    let keep = trusted * min(near.z / 0.05, 1.0);
    let filled = mix(near.xy / max(near.z, 1e-4), own, keep);
    textureStore(flow_out, id, vec4f(select(own, filled, near.z > 0.01), 0.0, 0.0));
}

/// Of the filled flow.
@compute @workgroup_size(WG_X, WG_Y)
fn trust(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let by = textureLoad(flow, id, 0).xy;
    textureStore(flow_out, id, vec4f(by, trust_in(by, id, textureLoad(values, id, 0).a), 0.0));
}

fn trust_in(by: vec2f, id: vec2u, value: f32) -> f32 {
    let at = vec2f(id) + 0.5 + by;
    let astray = length(by + flow_back_at(at).xy);
    let unlike = abs(values_there_at(at).a - value);
    let stays = is_one_surface(vec2i(id), vec2i(floor(at)));
    return f32(stays) * clamp(2.0 - astray / (ASTRAY + ASTRAY_SHARE * length(by)), 0.0, 1.0)
        * clamp(2.0 - unlike / (UNLIKE + UNLIKE_SHARE * value), 0.0, 1.0);
}

/// The tangent plane at every pixel.
@compute @workgroup_size(WG_X, WG_Y)
fn find_planes(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let own = inverse_depth(px);
    let across = slope_along(px, own, vec2i(SLOPE_REACH, 0));
    let down = slope_along(px, own, vec2i(0, SLOPE_REACH));
    textureStore(weighted, px, vec4f(own, vec2f(across, down) / f32(SLOPE_REACH), 0.0));
}

/// The change of the inverse of depth, to the side where it changes less.
fn slope_along(px: vec2i, own: f32, by: vec2i) -> f32 {
    let ahead = inverse_depth(px + by) - own;
    let behind = own - inverse_depth(px - by);
    return select(behind, ahead, abs(ahead) < abs(behind));
}

fn inverse_depth(px: vec2i) -> f32 {
    let near = inside(px);
    return 1.0 / valid_depth(textureLoad(depth, near, 0).x);
}

fn around_at(at: vec2f) -> vec4f {
    let s = square_within(half_size(), 0.5 * at);
    return mixed(s, textureLoad(around, s.pair.xy, 0), textureLoad(around, s.pair.zy, 0),
                 textureLoad(around, s.pair.xw, 0), textureLoad(around, s.pair.zw, 0));
}
