// Samples composited front to back, edges by the texels of their own surface.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/search/moving_light.wgsl
//#include methods/gather/search/passing.wgsl
//#include methods/gather/search/search.wgsl
//#include methods/gather/search/visibility.wgsl

const EDGE_WIDTH: f32 = 0.5;            // of edges between two texels, as a share of the motion from sample to sample,
const LEAST_WIDTH: f32 = 0.667;         // and at least [px]; at 1, they are bilinear

struct Composite {
    color: vec4f,       // premultiplied by coverage
    weight: f32,
    coverage: f32,
    residual: f32,      // distance of composited samples from the pixel, times their coverage [px]
    neighbours: f32,    // the part of the coverage that neighbouring frames gave
    unlit: f32,         // the part whose light moves and is not known
}

fn add(sum: ptr<function, Composite>, one: Composite, share: f32) {
    (*sum).color += share * one.color;
    (*sum).weight += share * one.weight;
    (*sum).coverage += share * one.coverage;
    (*sum).residual += share * one.residual;
    (*sum).neighbours += share * one.neighbours;
    (*sum).unlit += share * one.unlit;
}

/// Composite over one another (Porter and Duff's "over"): edges, by the texels of their own surface, then opaque samples.
fn composite_front_to_back(visible: Visible, t: f32, duration: f32, around: f32, step: f32) -> Composite {
    let front_edge = is_before(visible.front_edge, visible.opaque);
    let back_edge = front_edge && is_before(visible.back_edge, visible.opaque)
        && is_behind(visible.back_edge, visible.front_edge);
    let opaque = visible.opaque.depth < INFINITE;
    let at = visible.opaque.at;
    let layer = visible.opaque.layer;
    var filtered = opaque && visible.opaque.layer % 2u == 0u;   // as a whole, not texel by texel
    if WEIGHTED { filtered = filtered && is_smooth(surface_of(vec2i(nearest_pixel(at)), layer)); }
    let parts = u32(front_edge) + u32(back_edge) + u32(opaque && !filtered);
    var sum = Composite();
    var n = 0u;
    loop {
        var part = visible.opaque;
        if back_edge && n == 1u { part = visible.back_edge; }
        if front_edge && n == 0u { part = visible.front_edge; }
        var one = texels_of(part, t, around, step, n < parts);
        if MOVING_LIGHT && n < parts { one.color += moving_light(one.color, one.coverage, part.at, part.layer, t, duration); }
        one.residual = one.coverage * sqrt(part.residual2);
        var from_around = part.layer > 1u;
        if CONFIDENCE && part.layer == 1u {
            from_around = (surface_of(vec2i(nearest_pixel(part.at)), 1u).w & AROUND) != 0u;
        }
        one.neighbours = select(0.0, one.coverage, from_around);
        if CONFIDENCE && MOVING_LIGHT && n < parts {
            one.unlit = one.coverage * light_unknown(part.at, part.layer, t, duration);
        }
        add(&sum, one, 1.0 - sum.coverage);
        n++;
        if n >= parts { break; }
    }
    if filtered {
        var counts = 1.0;
        if WEIGHTED { counts = matte_at(nearest_pixel(at), layer / 2u).weight; }
        let neighbours = select(0.0, 1.0, visible.opaque.layer > 1u);
        var color = passing(at, layer, t, around, step);
        if MOVING_LIGHT { color += moving_light(color, 1.0, at, visible.opaque.layer, t, duration); }
        var one = Composite(color, counts, 1.0, sqrt(visible.opaque.residual2), neighbours, 0.0);
        if CONFIDENCE && MOVING_LIGHT { one.unlit = light_unknown(at, layer, t, duration); }
        add(&sum, one, 1.0 - sum.coverage);
    }
    return sum;
}

/// The colour of a sample from the texels of its own surface, the mean over the time `around` it; nothing unless `wanted`.
fn texels_of(sample: Sample, t: f32, around: f32, step: f32, wanted: bool) -> Composite {
    let width = width_of(step);
    var off = vec2f(0.0);
    if wanted && step > LONG_WAY { off = off_middle(way_at(sample.at, sample.layer, t, around), width); }
    let count = select(4u, 8u, any(off != vec2f(0.0)));     // of one place or two
    var one = Composite();
    var i = 0u;
    loop {
        if wanted { add_texel(&one, sample, sample.at + select(off, -off, i >= 4u), i % 4u, width); }
        i++;
        if !wanted || i >= count { break; }
    }
    let share = 4.0 / f32(count);
    one.color *= share;
    one.weight *= share;
    one.coverage *= share;
    if sample.layer % 2u == 1u && one.coverage > 1e-4 {     // backgrounds are opaque
        one.color /= one.coverage;
        one.weight /= one.coverage;
        one.coverage = 1.0;
    }
    return one;
}

/// The width of edges between two texels, up to 1, by the longest step from sample to sample [px].
fn width_of(step: f32) -> f32 {
    return clamp(EDGE_WIDTH * step, LEAST_WIDTH, 1.0);
}

/// Add texel `i` of the four around a place `at` of a sample, if it is of the same surface. Bilinear weights hide the gaps between long steps,
/// but blur as much as a motion of 1.4 px. Where edges are narrower, the nearer texel counts for more.
fn add_texel(sum: ptr<function, Composite>, sample: Sample, at: vec2f, i: u32, width: f32) {
    let front = sample.layer / 2u * 2u;
    let is_back = sample.layer % 2u == 1u;
    let corner = floor(at - 0.5);
    let bilinear = at - 0.5 - corner;
    let share = clamp((bilinear - 0.5) / width + 0.5, vec2f(0.0), vec2f(1.0));
    let step = vec2f(vec2u(i & 1u, i >> 1u));
    let px = nearest_pixel(corner + step);
    let shares = mix(1.0 - share, share, step);
    let matte = matte_at(px, front / 2u);
    let from_back = is_back && matte.has_back;
    let z = matte.depth;
    // What lies as deep, and of a back layer the other back layers. What lies before it is composited by itself.
    let is_beyond = z > sample.true_depth * BODY_DEPTH_RATIO;
    let is_before = z < sample.true_depth / BODY_DEPTH_RATIO;
    let belongs = from_back || !(is_beyond || is_before);
    let amount = select(0.0, shares.x * shares.y, belongs);
    (*sum).color += amount * textureLoad(layer_colors, px, front + u32(from_back), 0);
    (*sum).weight += amount * select(matte.weight, 1.0, from_back);
    (*sum).coverage += amount * select(matte.coverage, 1.0, is_back);
}
