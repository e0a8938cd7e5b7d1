// Weights of the features of pyramid.wgsl in the comparison of two pixels.
//#include common/finite.wgsl

const LUMA: vec3f = vec3f(0.299, 0.587, 0.114);     // ITU-R BT.601
const DIRECTION_SCALE: f32 = 0.25;      // directions are stored this many times too large, inverted
const LIKENESS: f32 = 300.0;            // how fast the weight falls with the difference of display colours
const LEAST_WEIGHT: f32 = 0.02;         // of a pixel unlike the centre
const SHADE_WEIGHT: f32 = 0.25;         // of possible changes of light

/// Difference of two pixels: the sum of absolute differences of their 7 features.
fn difference(a0: vec4f, a1: vec3f, b0: vec4f, b1: vec3f) -> f32 {
    return dot(abs(a0 - b0), vec4f(1.0)) + dot(abs(a1 - b1), vec3f(1.0, DIRECTION_SCALE, DIRECTION_SCALE));
}

/// The same where the light may have changed: what all display colours differ by alike, up to `most`, counts less.
fn shaded_difference(a0: vec4f, a1: vec3f, b0: vec4f, b1: vec3f, most: f32) -> f32 {
    let grey = dot(a0.rgb - b0.rgb, vec3f(1.0 / 3.0));
    let shade = (1.0 - SHADE_WEIGHT) * clamp(grey, -most, most);
    return difference(a0 - vec4f(vec3f(shade), 0.0), a1, b0, b1);
}

/// Weight of a pixel near another one: high if their colours are alike, so that it is likely of the same surface.
fn likeness(a: vec3f, b: vec3f) -> f32 {
    let d = dot(abs(a - b), vec3f(1.0));
    return 1.0 / (1.0 + LIKENESS * d * d) + LEAST_WEIGHT;
}

/// The value of a linear colour for flow: 0 to 1.
fn limited(color: vec4f) -> vec4f {
    return vec4f(select(vec3f(0.0), clamp(color.rgb, vec3f(0.0), vec3f(1.0)), is_color(vec4f(color.rgb, 0.0))), 1.0);
}
