// Surface patterns, each box-filtered over the width of a pixel so that none of them aliases.
//#include common/angle.wgsl
//#include common/hash.wgsl

const PLAIN: u32 = 0u;
const CHECKER: u32 = 1u;
const STRIPES: u32 = 2u;
const BRICKS: u32 = 3u;
const DOTS: u32 = 4u;
const GROUND: u32 = 5u;         // of a backdrop

// Mappings of a pattern onto a body.
const FLAT: u32 = 0u;           // on its faces
const BALL: u32 = 1u;           // round a sphere
const TUBE: u32 = 2u;           // round a cylinder

const MORTAR: f32 = 0.08;       // share of a brick's height that is mortar

/// Colour at the point `at` of a unit body scaled by the half extents `size`; `width` of the pixel there [scene units].
fn pattern_color(pattern: u32, color: vec3f, other: vec3f, at: vec3f, normal: vec3f, size: vec3f,
                 repeats: vec2f, lies: u32, width: f32) -> vec3f {
    if pattern == PLAIN { return color; }
    let side = abs(normal);
    let p = at * size;
    var uv = p.xy;
    if side.x >= side.y && side.x >= side.z { uv = p.zy; }
    if side.y > side.x && side.y >= side.z { uv = p.xz; }
    var scaled = uv * repeats;
    var w = width * max(repeats.x, repeats.y);
    if lies == BALL {
        scaled = vec2f(atan2(at.z, at.x), asin(clamp(at.y, -1.0, 1.0))) / TAU * repeats;
        w = width / (TAU * size.x) * max(repeats.x, repeats.y);
    }
    if lies == TUBE {
        scaled = vec2f(atan2(at.y, at.x) / TAU, p.z) * repeats;
        w = width * max(repeats.x / (TAU * size.x), repeats.y);
    }
    w = max(w, 1e-4);
    var share = 0.0;
    if pattern == CHECKER { share = 0.5 - 0.5 * square_wave(scaled.x, w) * square_wave(scaled.y, w); }
    if pattern == STRIPES { share = 0.5 - 0.5 * square_wave(scaled.x, w); }
    if pattern == DOTS {
        let from_middle = length(fract(scaled) - 0.5);
        share = mix(1.0 - smoothstep(0.3 - 0.5 * w, 0.3 + 0.5 * w, from_middle), 0.28, min(w, 1.0));
    }
    if pattern == BRICKS { return bricks(scaled, w, color, other); }
    return mix(color, other, share);
}

/// A wave that is 1 and -1 by turns, for half a unit each, averaged over `w`.
fn square_wave(x: f32, w: f32) -> f32 {
    let before = abs(fract(x - 0.5 * w) - 0.5);
    let after = abs(fract(x + 0.5 * w) - 0.5);
    return (before - after) / w;
}

/// Rows of bricks of two by one, every second row shifted, each brick a little different.
fn bricks(uv: vec2f, w: f32, color: vec3f, mortar: vec3f) -> vec3f {
    let row = floor(uv.y);
    let x = 0.5 * uv.x + 0.5 * (row - 2.0 * floor(0.5 * row));
    let joint = 1.0 - (1.0 - line(uv.y, MORTAR, w)) * (1.0 - line(x, 0.5 * MORTAR, 0.5 * w));
    let random = unit_float(lattice_hash(vec2i(vec2f(floor(x), row))));
    let tone = 0.75 + 0.5 * mix(random, 0.5, min(w, 1.0));
    return mix(color * tone, mortar, joint);
}

/// Share of the interval of length `w` around `x` that is covered by lines of width `wide` which begin at the integers.
fn line(x: f32, wide: f32, w: f32) -> f32 {
    return (line_integral(x + 0.5 * w, wide) - line_integral(x - 0.5 * w, wide)) / w;
}

fn line_integral(x: f32, wide: f32) -> f32 {
    return floor(x) * wide + min(fract(x), wide);
}
