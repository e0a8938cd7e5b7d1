// Light that moves: the change of a surface's colour between the time of its frame and the time of the sample.
// It is known on this frame's surfaces at a few times, the nodes (see shading/compose.wgsl).
//#include common/loops.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include methods/gather/search/search.wgsl
//#include methods/gather/shading/active.wgsl
//#include methods/gather/shading/rests.wgsl

struct LightNodes {
    first: f32,         // time of the first one [frame intervals]
    step: f32,          // from one to the next [frame intervals]
    count: u32,         // then follow layers for the light of the previous frame and of the next one
}

@group(1) @binding(9) var linear: sampler;
@group(1) @binding(12) var<uniform> light_nodes: LightNodes;
@group(1) @binding(13) var added_light: texture_2d_array<f32>;  // premultiplied by weight; a: how sure it is; of the last two layers: seen there
@group(1) @binding(14) var<storage, read> light_changes: array<u32>;    // one word, then those of tiles: see active.wgsl

override MOVING_LIGHT: bool = false;    // whether there is any

const SAME_SURFACE: f32 = 1.0;  // a way there and back ends no farther than this from where it began [px]

/// For how long sample `i` stands [frame intervals].
fn sample_duration(times: SampleTimes, i: u32) -> f32 {
    let span = sample_span(times, i);
    return span.y - span.x;
}

/// False at a place of this frame [px] where light rests in all frames: there the addition is 0, and sure.
fn is_light_moving(at: vec2f) -> bool {
    let px = min(vec2u(max(at, vec2f(0.0))), frame.size - 1u);
    return (light_changes[1u + light_tile(px)] & CHANGES) != 0u;
}

/// For a sample `at` [px] of a layer, around the time `t`, for as long as `duration`: the change of its `color`, which covers this
/// much of the pixel.
fn moving_light(color: vec4f, coverage: f32, at: vec2f, layer: u32, t: f32, duration: f32) -> vec4f {
    if layer == 0u {
        let light = light_during(at, t, duration).rgb;
        var added = coverage * light;
        if RESTING { added = share_of(color, coverage, light, at); }
        return vec4f(added, 0.0);
    }
    let f = layer / 2u;
    let offset = offset_of(min(f, 2u));
    let surface = surface_of(vec2i(floor(at)), min(layer, 5u));
    let here = at + displacement5(unpack_trajectory(surface), -offset);
    if !is_light_moving(here) { return vec4f(0.0); }
    let own = surface_of(vec2i(floor(here)), 0u);
    let back = here + displacement5(unpack_trajectory(own), offset) - at;
    let node = light_nodes.count + select(0u, 1u, offset > 0.0);
    let there = textureSampleLevel(added_light, linear, light_uv(here), node, 0.0);
    let same = layer % 2u == 0u && layer < 2u * sources.count && is_inside(here) && dot(back, back) < SAME_SURFACE * SAME_SURFACE;
    let light = light_during(here, t, duration).rgb;
    var change = coverage * (light - there.rgb);
    if RESTING { change = share_of(color, coverage, (1.0 + light) / (1.0 + there.rgb) - 1.0, here); }
    return vec4f(select(vec3f(0.0), there.a * change, same), 0.0);
}

/// A share of a colour that covers this much of the pixel, if this frame's surface at a place [px] is static.
fn share_of(color: vec4f, coverage: f32, share: vec3f, at: vec2f) -> vec3f {
    return select(vec3f(0.0), (color.rgb + coverage * DARK) * share, rests_at(at));
}

/// True if this frame's surface at a place [px] is static.
fn rests_at(at: vec2f) -> bool {
    let trajectory = unpack_trajectory(surface_of(vec2i(floor(at)), 0u));
    return rests(vec4f(displacement5(trajectory, -1.0), displacement5(trajectory, 1.0)));
}

/// Where in the layers of added light a place [px] is.
fn light_uv(at: vec2f) -> vec2f {
    return at / f32(LIGHT_SCALE) / vec2f(textureDimensions(added_light));
}

/// Uncertainty of the light of such a sample, from 0 to 1.
fn light_unknown(at: vec2f, layer: u32, t: f32, duration: f32) -> f32 {
    var here = at;
    if layer > 0u {
        let surface = surface_of(vec2i(floor(at)), min(layer, 5u));
        here += displacement5(unpack_trajectory(surface), -offset_of(min(layer / 2u, 2u)));
    }
    return select(0.0, 1.0 - light_during(here, t, duration).a, is_inside(here));
}

/// Addition at a place of this frame [px]: the mean over a time. a: its confidence.
fn light_during(at: vec2f, t: f32, duration: f32) -> vec4f {
    if !is_light_moving(at) { return vec4f(0.0, 0.0, 0.0, 1.0); }
    let uv = light_uv(at);
    let last = f32(light_nodes.count) - 1.0;
    let half = max(0.5 * duration / light_nodes.step, 0.5);
    let u = clamp((t - light_nodes.first) / light_nodes.step, half - 0.5, max(last - half + 0.5, half - 0.5));
    // A node stands for half a step to either side.
    let first = clamp(ceil(u - half - 0.5), 0.0, last);
    let count = turns_of(u32(clamp(ceil(2.0 * half), 1.0, last + 1.0)) + 1u, u32(max(at.x, 0.0)));
    var sum = vec4f(0.0);
    var total = 0.0;
    for (var k = 0u; k < count; k++) {
        let node = first + f32(k);
        let share = max(min(node + 0.5, u + half) - max(node - 0.5, u - half), 0.0);
        sum += share * textureSampleLevel(added_light, linear, uv, u32(min(node, last)), 0.0);
        total += share;
    }
    return sum / max(total, 1e-6);
}
