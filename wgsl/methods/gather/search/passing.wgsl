// The colours that pass by a pixel while a sample stands: a sample is searched at one instant, and stands for all of
// them until the middle between it and the next. On long ways it is read at two places of its way, so that as few as 16 samples
// leave no steps.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include methods/gather/search/moving_light.wgsl
//#include methods/gather/search/search.wgsl
//#include methods/gather/search/visibility.wgsl

@group(1) @binding(4) var layer_colors: texture_2d_array<f32>;  // front, back per frame; premultiplied by alpha, coverage, weight
@group(1) @binding(5) var mattes: texture_2d_array<u32>;    // stored as r32uint, rg32uint if WEIGHTED: per frame, see pack_matte()
@group(1) @binding(6) var second_differences: texture_2d<u32>;  // stored as rgba32uint: of the frame's own front colours

override WEIGHTED: bool = false;    // pixels have weights

const LONG_WAY: f32 = 1.5;          // from here on a surface is read at two places [px]
const BLURRED: f32 = 0.5;           // squared blur of edges between two texels, as a share of their squared width,
const MOST_OFF: f32 = 0.5;          // and how far they are read from the middle of their way, at most [px]

/// The matte of a pixel of frame `f`.
fn matte_at(px: vec2u, f: u32) -> Matte {
    return unpack_matte(textureLoad(mattes, px, f, 0), WEIGHTED);
}

/// The longest time around sample `i` for which it stands [frame intervals].
fn time_around(times: SampleTimes, i: u32) -> f32 {
    let t = shutter_time(times, i) - times.delay;
    let span = sample_span(times, i);
    return 2.0 * max(min(t - span.x, span.y - t), 0.0);
}

/// The way [px] that a layer's surface goes past its place `at` in the time `around` the time `t` [frame intervals].
fn way_at(at: vec2f, layer: u32, t: f32, around: f32) -> vec2f {
    let surface = surface_of(vec2i(nearest_pixel(at)), layer);
    let u = t - offset_of(layer / 2u);
    return displacement_of(surface, u + 0.5 * around) - displacement_of(surface, u - 0.5 * around);
}

/// How far before and behind the middle of its `way` an edge is read [px]: at two places whose variance, with that of an edge of
/// this `width`, is that of the way; both are the middle if the edge is as wide already.
fn off_middle(way: vec2f, width: f32) -> vec2f {
    let length2 = dot(way, way);
    let off = sqrt(max(length2 / 12.0 - BLURRED * width * width, 0.0));
    return min(off, MOST_OFF) * inverseSqrt(max(length2, 1e-12)) * way;
}

/// The colour of a layer's surface whose place at the time `t` is `at`, its mean over the time `around` it. A place
/// of its way that does not show it, or in another weight, counts as the middle.
fn passing(at: vec2f, layer: u32, t: f32, around: f32, step: f32) -> vec4f {
    var way = vec2f(0.0);
    if step > LONG_WAY { way = way_at(at, layer, t, around); }
    let is_long = dot(way, way) > LONG_WAY * LONG_WAY;
    let count = select(1u, 2u, is_long);
    var sum = vec4f(0.0);
    var i = 0u;
    loop {
        let place = at + (0.5 * f32(i) - 0.25) * way;
        let moves = is_long && shows_same(at, place, layer) && weighs_same(at, place, layer);
        sum += resampled(select(at, place, moves), layer);
        i++;
        if i >= count { break; }
    }
    return sum / f32(count);
}

/// True if two places of a layer show one body, and no edge.
fn shows_same(at: vec2f, place: vec2f, layer: u32) -> bool {
    let z = unpack_depth(surface_of(vec2i(nearest_pixel(at)), layer));
    let there = unpack_depth(surface_of(vec2i(nearest_pixel(place)), layer));
    return there > 0.0 && there < z * BODY_DEPTH_RATIO && z < there * BODY_DEPTH_RATIO;
}

/// True if all that is read at a place of a front layer has the weight of another place, or there are no weights.
fn weighs_same(at: vec2f, place: vec2f, layer: u32) -> bool {
    var is_same = true;
    let wanted = matte_at(nearest_pixel(at), layer / 2u).weight;
    let count = select(0u, 4u, WEIGHTED);
    for (var i = 0u; i < count; i++) {
        let px = nearest_pixel(floor(place - 0.5) + vec2f(vec2u(i & 1u, i >> 1u)));
        is_same = is_same && matte_at(px, layer / 2u).weight == wanted;
    }
    return is_same;
}

/// Catmull-Rom interpolation where the frame's own texel is smooth, bilinear elsewhere. Between two texels the cubic
/// differs from the line by their second differences; those of the nearest texel stand for both. It is never less than half
/// of the line: beside a lamp it would swing far below 0.
fn resampled(at: vec2f, layer: u32) -> vec4f {
    let f = fract(at - 0.5);
    let px = nearest_pixel(at);
    let differences = textureLoad(second_differences, px, 0);
    let across = vec4f(unpack2x16float(differences.x), unpack2x16float(differences.y));
    let down = vec4f(unpack2x16float(differences.z), unpack2x16float(differences.w));
    let share = select(vec2f(0.0), 0.5 * f * (1.0 - f), layer == 0u);
    let line = textureSampleLevel(layer_colors, linear, at / vec2f(frame.size), layer, 0.0);
    return line - share.x * across - share.y * down;
}
