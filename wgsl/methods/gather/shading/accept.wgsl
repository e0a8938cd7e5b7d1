// Trust in the flow: it leads back, to equal darkness, along one surface: what is dark by itself, as the side of a box
// is, does not move to another side. Where it cannot be trusted, the flow around replaces it.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl

@group(1) @binding(0) var flow: texture_2d<f32>;        // to the other frame [px]
@group(1) @binding(1) var flow_back: texture_2d<f32>;
@group(1) @binding(2) var values: texture_2d<f32>;
@group(1) @binding(3) var values_there: texture_2d<f32>;
@group(1) @binding(4) var around: texture_2d<f32>;      // of `fill`: weighted flow, weight, blurred
@group(1) @binding(5) var linear: sampler;
@group(1) @binding(6) var flow_out: Flow;               // flow [px], trust 0..1
@group(1) @binding(7) var weighted: Weighted;           // flow times weight, weight

@group(1) @binding(8) var depth: texture_2d<f32>;

alias Flow = texture_storage_2d<rgba16float, write>;
alias Weighted = texture_storage_2d<rgba32float, write>;

const ASTRAY: f32 = 12.0;       // distance from where it came from up to which a way back is trusted wholly [px],
const ASTRAY_SHARE: f32 = 0.1;  // and this share of the flow; twice as far, not at all
const UNLIKE: f32 = 0.2;        // difference of values trusted wholly,
const UNLIKE_SHARE: f32 = 0.5;  // and this share of the value
const SLOPE_REACH: i32 = 2;     // [px] to either side, over which the slope of a surface is measured
const OFF_PLANE: f32 = 0.02;    // by which one surface may leave its tangent plane [share of the depth],
const BEND: f32 = 0.5;          // and this much more over the picture's width: a turn of about 45 degrees
const PRESENT: f32 = 0.1;       // value from which on there is something to move

@compute @workgroup_size(WG_X, WG_Y)
fn trust(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let by = textureLoad(flow, id.xy, 0).xy;
    let at = (vec2f(id.xy) + 0.5 + by) / vec2f(frame.size);
    let value = textureLoad(values, id.xy, 0).a;
    let astray = length(by + textureSampleLevel(flow_back, linear, at, 0.0).xy);
    let unlike = abs(textureSampleLevel(values_there, linear, at, 0.0).a - value);
    let stays = is_one_surface(vec2i(id.xy), vec2i(floor(vec2f(id.xy) + 0.5 + by)));
    let trusted = f32(stays) * clamp(2.0 - astray / (ASTRAY + ASTRAY_SHARE * length(by)), 0.0, 1.0)
        * clamp(2.0 - unlike / (UNLIKE + UNLIKE_SHARE * value), 0.0, 1.0);
    let weight = trusted * min(value / PRESENT, 1.0);
    textureStore(flow_out, id.xy, vec4f(by, trusted, 0.0));
    textureStore(weighted, id.xy, vec4f(weight * by, weight, 0.0));
}

@compute @workgroup_size(WG_X, WG_Y)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let own = textureLoad(flow, id.xy, 0);
    let near = textureLoad(around, id.xy, 0);
    let keep = own.z * min(near.z / 0.05, 1.0);
    let filled = mix(near.xy / max(near.z, 1e-4), own.xy, keep);
    textureStore(flow_out, id.xy, vec4f(select(own.xy, filled, near.z > 0.01), own.z, 0.0));
    textureStore(weighted, id.xy, vec4f(0.0));
}

/// True if each of the pixels is about on the other's tangent plane, along which the inverse of depth is linear.
fn is_one_surface(a: vec2i, b: vec2i) -> bool {
    let way = vec2f(b - a);
    let most = 1.0 + OFF_PLANE + BEND * length(way) / f32(frame.size.x);
    let there = inverse_depth(a) + dot(way, slope(a));
    let here = inverse_depth(b) - dot(way, slope(b));
    return is_as_deep(there, inverse_depth(b), most) && is_as_deep(here, inverse_depth(a), most);
}

fn is_as_deep(a: f32, b: f32, most: f32) -> bool {
    return max(a, b) < most * min(a, b);
}

/// The change of the inverse of depth per pixel, to the sides where it changes less.
fn slope(px: vec2i) -> vec2f {
    return vec2f(slope_along(px, vec2i(SLOPE_REACH, 0)), slope_along(px, vec2i(0, SLOPE_REACH))) / f32(SLOPE_REACH);
}

fn slope_along(px: vec2i, by: vec2i) -> f32 {
    let own = inverse_depth(px);
    let ahead = inverse_depth(px + by) - own;
    let behind = own - inverse_depth(px - by);
    return select(behind, ahead, abs(ahead) < abs(behind));
}

fn inverse_depth(px: vec2i) -> f32 {
    return 1.0 / valid_depth(textureLoad(depth, inside(px), 0).x);
}
