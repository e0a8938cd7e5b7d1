// Colours of surfaces that no frame shows: taps of the frame itself, and fills from around.
//#include common/frame.wgsl
//#include methods/gather/search/composite.wgsl
//#include methods/gather/search/search.wgsl

@group(1) @binding(7) var own_color: texture_2d<f32>;       // the frame as it came
@group(1) @binding(8) var own_weight: texture_2d<f32>;

const FILL_DIRECTIONS: u32 = 8u;        // see cosine_of()
const SQRT_HALF: f32 = 0.70710678;
const FILL_STEPS: u32 = 13u;            // to every side, each FILL_GROWTH times as far as the one before: 64 px
const FILL_GROWTH: f32 = 1.414213562;
const BORDER_SPREAD: f32 = 0.5;         // half the length of the border that stands for a place beyond it, per distance
const GOLDEN_RATIO: f32 = 0.618034;     // less 1
const FILL_DEPTH_RATIO: f32 = 1.1;      // of surfaces behind another one

/// A tap of the frame itself.
fn tap(p: vec2f) -> Composite {
    var counts = 1.0;
    if WEIGHTED { counts = textureSampleLevel(own_weight, linear, p / vec2f(frame.size), 0.0).x; }
    return Composite(textureSampleLevel(own_color, linear, p / vec2f(frame.size), 0.0), counts, 1.0, 0.0, 0.0, 0.0);
}

/// The place [px] that stands for one of a path, for sample `n` of the exposure: itself, or beyond the border of the
/// picture, a place along the border. The farther a path has left the picture, the less of the border tells what is there:
/// the samples are spread over a longer part of it.
fn at_border(p: vec2f, n: u32) -> vec2f {
    let nearest = clamp(p, vec2f(0.5), vec2f(frame.size) - 0.5);
    let beyond = abs(p - nearest);
    let along = select(vec2f(1.0, 0.0), vec2f(0.0, 1.0), beyond.x > beyond.y);
    let turn = 2.0 * fract(f32(n) * GOLDEN_RATIO + 0.5) - 1.0;      // even over any run of samples
    return select(nearest + BORDER_SPREAD * max(beyond.x, beyond.y) * turn * along, p, is_inside(p));
}

/// Add surfaces that are hidden behind the pixel in all frames: the nearest surfaces behind its own, in FILL_DIRECTIONS
/// directions, weighted by the inverse root of their distances: the nearest alone would change from pixel to pixel.
fn add_hidden(sum: ptr<function, Composite>, id: vec2u, share: f32) {
    let z = abs(unpack_depth(surface_of(vec2i(id), 0u)));
    let count = select(0u, FILL_DIRECTIONS, share > 0.0);
    var filled = Composite();
    var direction = 0u;
    loop {
        let along = vec2f(cosine_of(direction), cosine_of(direction + 6u));
        var distance = 1.0;
        var step = select(FILL_STEPS, 0u, direction < count);
        loop {
            let px = vec2i(floor(vec2f(id) + 0.5 + distance * along));
            let is_there = step < FILL_STEPS && all(px >= vec2i(0)) && all(px < vec2i(frame.size));
            let is_behind = unpack_depth(surface_of(px, 0u)) > z * FILL_DEPTH_RATIO;
            if is_there && is_behind {
                let part = inverseSqrt(distance);
                let counts = matte_at(vec2u(px), 0u).weight;
                add(&filled, Composite(textureLoad(layer_colors, px, 0, 0), counts, 1.0, 0.0, 0.0, 0.0), part);
                step = FILL_STEPS;
            }
            distance *= FILL_GROWTH;
            step++;
            if step >= FILL_STEPS { break; }
        }
        direction++;
        if direction >= count { break; }
    }
    if share > 0.0 {
        if filled.coverage > 0.0 {
            add(sum, filled, share / filled.coverage);
        } else {
            var counts = 1.0;
            if WEIGHTED { counts = textureLoad(own_weight, id, 0).x; }
            add(sum, Composite(textureLoad(own_color, id, 0), counts, 1.0, 0.0, 0.0, 0.0), share);
        }
    }
}

/// Of a number of eighths of a turn.
fn cosine_of(eighths: u32) -> f32 {
    let n = eighths % 8u;
    let size = select(select(1.0, 0.0, n % 4u == 2u), SQRT_HALF, n % 2u == 1u);
    return select(size, -size, n > 2u && n < 6u);
}
