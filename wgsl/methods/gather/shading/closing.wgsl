// The brightest light around on the same surface, which stands for the light without its shadows: greatest values are
// spread, then smallest ones (a closing). So shadows are found that lie on a place in all three frames. Nothing spreads
// from creases, since the sides of a box have a light of their own.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/listed.wgsl

@group(1) @binding(0) var light_here: texture_2d<f32>;  // stored as given
@group(1) @binding(1) var depth_here: texture_2d<f32>;  // stored as given
@group(1) @binding(2) var before: texture_2d<f32>;      // stored as rgba16float: changes to the previous frame, to the next one
@group(1) @binding(3) var after: texture_2d<f32>;       // stored as rgba16float
@group(1) @binding(4) var state: texture_2d<f32>;       // stored as rgba32float, by the pass before: light, depth, negative at a crease, 0 where light rests
@group(1) @binding(5) var output: State;

alias State = texture_storage_2d<rgba32float, write>;

const AS_DEEP: f32 = 1.06;      // ratio of the depths of pixels side by side on one surface
const CREASE: f32 = 2.0;        // change of the slope at a crease [share of the depth, over the picture's width],
const LEAST_CREASE: f32 = 0.004;    // and at least this much [share of the depth per pixel]: depths may be half floats

fn own_light(px: vec2i) -> vec3f {
    return log(valid_light(textureLoad(light_here, px, 0)) + dark());
}

/// The brightest of the three frames, without noise.
@compute @workgroup_size(WG_X, WG_Y)
fn begin(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let surface = select(1.0, -1.0, is_crease(px)) * depth_at(px);
    let most = max(vec3f(0.0), max(textureLoad(before, px, 0).rgb, textureLoad(after, px, 0).rgb));
    textureStore(output, px, vec4f(smooth_light(px, abs(surface)) + most, surface));
}

/// The mean of 3 x 3 pixels of the same surface without the brightest one: noise is no light.
fn smooth_light(px: vec2i, z: f32) -> vec3f {
    var sum = vec4f(0.0);
    var most = vec3f(-1e9);
    for (var k = 0; k < 9; k++) {
        let near = px + vec2i(k % 3, k / 3) - 1;
        let z_near = depth_at(near);
        if max(z, z_near) < AS_DEEP * min(z, z_near) {
            let light = own_light(inside(near));
            sum += vec4f(light, 1.0);
            most = max(most, light);
        }
    }
    return select(own_light(px), (sum.rgb - most) / max(sum.a - 1.0, 1.0), sum.a > 1.0);
}

fn depth_at(px: vec2i) -> f32 {
    let near = inside(px);
    return valid_depth(textureLoad(depth_here, near, 0).x);
}

/// True if the surface turns at the pixel. Along a plane the inverse of depth is linear.
fn is_crease(px: vec2i) -> bool {
    let z = depth_at(px);
    let most = max(CREASE / f32(frame.size.x), LEAST_CREASE);
    var turns = false;
    for (var k = 0; k < 2; k++) {
        let by = vec2i(1 - k, k);
        let a = depth_at(px - by);
        let b = depth_at(px + by);
        let same = max(max(a, b), z) < AS_DEEP * AS_DEEP * min(min(a, b), z);
        turns = turns || (same && abs(z / a + z / b - 2.0) > most);
    }
    return turns;
}

@compute @workgroup_size(WG_X, WG_Y)
fn grow(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    spread(vec2i(id), 1.0);
}

@compute @workgroup_size(WG_X, WG_Y)
fn shrink(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    spread(vec2i(id), -1.0);
}

/// The greatest (`sign` 1) or smallest (-1) of the pixel and the four around it on the same surface.
fn spread(px: vec2i, sign: f32) {
    let own = textureLoad(state, px, 0);
    var most = sign * own.rgb;
    for (var k = 0; k < 4; k++) {
        let by = select(vec2i(0, k * 2 - 5), vec2i(k * 2 - 1, 0), k < 2);
        let near = inside(px + by);
        let there = textureLoad(state, near, 0);
        let same = max(there.a, abs(own.a)) < AS_DEEP * min(there.a, abs(own.a));
        most = max(most, select(most, sign * there.rgb, same));
    }
    textureStore(output, px, vec4f(sign * most, own.a));
}
