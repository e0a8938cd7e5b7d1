// Tests of numbers for being finite, by their bits: compilers fold `x != x` to false.

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

/// Colours beyond this count as infinite: sums of weighted ones shall not overflow [linear].
const BRIGHTEST: f32 = 1e30;

/// True if a colour has a weight.
fn is_color(v: vec4f) -> bool {
    return all((bitcast<vec4u>(v) & vec4u(0x7fffffffu)) <= vec4u(bitcast<u32>(BRIGHTEST)));
}

fn is_finite4(v: vec4f) -> bool {
    return all((bitcast<vec4u>(v) & vec4u(0x7f800000u)) != vec4u(0x7f800000u));
}

/// Pixels that are not finite count as black.
fn finite_or_black(color: vec4f) -> vec4f {
    return select(vec4f(0.0), color, is_finite4(color));
}
